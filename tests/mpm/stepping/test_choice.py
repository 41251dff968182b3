"""Which stepping is advised: jelly that falls explicit ones, metal at rest implicit ones."""

import json
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import pytest

from jaxphys.mpm.materials.plasticity import PERFECT_VON_MISES
from jaxphys.mpm.stepping.choice import LAG, advised, which_stepping
from tests.mpm.cases import block

COUNTED = Path(__file__).parents[3] / "benchmarks/lines/implicit.jsonl"


def test_work_is_counted_in_passes():
    """A step 1000 times the explicit one through 10 cells: 5 sqrt(1000) products, 12 passes. Of
    3 cells it takes no more than one 450 times as long.
    """
    choice = advised(explicit_dt=1e-5, implicit_dt=1e-2, cells=10, time=1.0)
    assert choice.explicit == pytest.approx(1e5)
    assert choice.implicit == pytest.approx(100 * (5 * 31.623 + 12), rel=1e-4)
    assert choice.stepping == "implicit" and "1e+03 explicit" in choice.reason
    small = advised(explicit_dt=1e-5, implicit_dt=1e-2, cells=3, time=1.0)
    assert small.implicit == pytest.approx(100 * (5 * 21.213 + 12), rel=1e-4)


def test_short_implicit_steps_do_not_pay():
    """Where speeds allow ten explicit steps at once, a solve costs more than these."""
    choice = advised(explicit_dt=1e-3, implicit_dt=1e-2, cells=10, time=1.0)
    assert choice.stepping == "explicit" and choice.implicit > choice.explicit


CELLS = {"block": 3, "beam": 8, "press": 3, "inclusion": 4}
SECONDS = {"block": 0.3, "beam": 0.4, "press": 0.3, "inclusion": 0.3}
LINES = [json.loads(line) for line in COUNTED.read_text().splitlines()]


def counted(method, *scenes):
    """(line, explicit steps in its time, what is advised for its steps) of runs of 16 steps."""
    explicit = {(x["scene"], x["modulus"]): x["steps"] for x in LINES if x["method"] == "explicit"}
    for line in LINES:
        scene = line["scene"]
        if line["method"] != method or scene not in scenes or line["least"] != 16:
            continue
        steps, time = explicit[scene, line["modulus"]], SECONDS[scene]
        dt = time / line["steps"]
        yield line, steps, advised(time / steps, dt, CELLS[scene], time)


@pytest.mark.parametrize(
    ("method", "scenes"),
    [("backward-euler", ("press", "inclusion")), ("midpoint", ("beam", "press", "inclusion"))],
)
def test_what_moves_takes_what_is_estimated(method, scenes):
    """Within a factor of two of what was counted, from 1 MPa to 10 GPa; the inclusion meets a floor
    with friction.
    """
    found = [(line["passes"], choice.implicit) for line, _, choice in counted(method, *scenes)]
    assert len(found) == 5 * len(scenes)
    ratios = [estimate / passes for passes, estimate in found]
    assert min(ratios) > 0.5 and max(ratios) < 2


def test_what_comes_to_rest_takes_less_and_the_advice_is_right_where_it_is_clear():
    """Of a block on a floor with friction, and a beam, by backward Euler: both are at rest soon."""
    clear = 0
    for line, steps, choice in counted("backward-euler", *SECONDS):
        assert line["passes"] < 2 * choice.implicit
        gain = steps / line["passes"]
        if not 0.8 < gain < 3:
            clear += 1
            assert choice.stepping == ("implicit" if gain > 1 else "explicit"), line
    assert clear > 8


def test_no_step_is_longer_than_what_is_asked_for():
    one, other = (advised(1e-5, dt, 10, time=1e-3) for dt in (1e-3, 1.0))
    assert one == other and one.ratio == pytest.approx(100)


def test_stiffness_and_rest_decide():
    """The same block, soft and in motion, or stiff and at rest without gravity."""
    config, model, state = block(count=20)
    assert which_stepping(config, model, state, 1 / 24).stepping == "explicit"
    hard = model.parameters | {"youngs_modulus": 1e8 * model.parameters["youngs_modulus"]}
    stiff = replace(model, parameters=hard, gravity=jnp.zeros(3))
    still = state._replace(velocity=0 * state.velocity, affine=0 * state.affine)
    choice = which_stepping(config, stiff, still, 1 / 24)
    assert choice.stepping == "implicit" and choice.reason.startswith("implicit pays")
    assert LAG not in choice.reason
    # The same numbers as matter that yields: the advice comes with what it costs.
    yields = replace(
        config, segments=tuple((PERFECT_VON_MISES, *cut) for _, *cut in config.segments)
    )
    parameters = stiff.parameters | {"yield_stress": jnp.full_like(stiff.mass, 1e6)}
    choice = which_stepping(yields, replace(stiff, parameters=parameters), still, 1 / 24)
    assert choice.stepping == "implicit" and choice.reason.endswith(LAG)

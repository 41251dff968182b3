"""Which stepping is advised: jelly that falls explicit ones, metal at rest implicit ones."""

from dataclasses import replace

import jax.numpy as jnp
import pytest

from jaxphys.mpm.stepping.choice import advised, which_stepping
from tests.mpm.cases import block


def test_work_is_counted_in_passes():
    """A step 1000 times the explicit one through 10 cells: three iterations of 20 and 5 passes."""
    choice = advised(explicit_dt=1e-5, implicit_dt=1e-2, cells=10, time=1.0)
    assert choice.explicit == pytest.approx(1e5)
    assert choice.implicit == pytest.approx(100 * 3 * 25)
    assert choice.stepping == "implicit" and "1e+03 explicit" in choice.reason


def test_short_implicit_steps_do_not_pay():
    """Where speeds allow ten explicit steps at once, a solve costs more than these."""
    choice = advised(explicit_dt=1e-3, implicit_dt=1e-2, cells=10, time=1.0)
    assert choice.stepping == "explicit" and choice.implicit > choice.explicit


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

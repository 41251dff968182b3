from dataclasses import replace

import jax.numpy as jnp
import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance import choice
from jaxphys.guidance.optimise import OptimiseConfig
from jaxphys.guidance.stages import RATES, Stage, ends, stage_at, stepwise, two


def test_stages_share_the_steps():
    stages = (Stage(1.0), Stage(2.0), Stage(1.0, shape=False))
    assert ends(stages, 8) == (2, 6, 8) and ends(stages, 12) == (3, 9, 12)
    assert ends((Stage(),), 7) == (7,) and ends(two(0.15), 5000) == (750, 5000)
    assert ends(two(0.5), 1) == (0, 1)
    found = [stages.index(stage_at(stages, 8, step)) for step in (0, 1, 2, 5, 6, 7, 8)]
    assert found == [0, 0, 1, 1, 2, 2, 2]


def test_a_traced_step_is_answered_by_its_stage():
    answers = [lambda step: 10 + step, lambda step: 20 + step, lambda step: 30 + step]
    found = [int(stepwise(answers, (2, 4, 6))(jnp.int32(step))) for step in (0, 1, 2, 3, 4, 7)]
    assert found == [10, 11, 22, 23, 34, 37]


def test_the_paper_s_two():
    geometry, appearance = two(0.15)
    assert geometry.shape and geometry.density == "none"
    assert not appearance.shape and appearance.density == "compact"


def test_settings_by_name():
    usual = choice.settings("bundled", "bundled")
    assert usual == OptimiseConfig() and len(usual.stages) == 1
    published = choice.settings("stable-diffusion", "point-e")
    assert ends(published.stages, published.steps) == (750, 5000)
    assert choice.settings("stable-diffusion", "point-e", stages="two") == published
    both = choice.settings("bundled", "bundled", stages="two")
    assert replace(both, stages=usual.stages) == usual and ends(both.stages, 160) == (80, 160)
    single = choice.settings("stable-diffusion", "point-e", stages="one")
    assert single.stages == (Stage(rates=published.stages[0].rates),)
    options = {"distillation": "ism", "perp_neg": True}
    ism = choice.settings("stable-diffusion", "bundled", **options).image
    assert (ism.method, ism.guidance, ism.weight, ism.perp_neg) == ("ism", 7.5, "clean", True)
    small = choice.settings("bundled", "bundled", **options).image
    assert replace(small, method="sds", perp_neg=False) == usual.image


def test_bad_stages_are_refused():
    for values, match in (
        ({"share": 0.0}, "share"),
        ({"density": "compcat"}, "compact"),
        ({"rates": RATES[:4]}, "harmonics"),
        ({"rates": (*RATES[:4], ("harmonics", -1.0))}, "at least 0"),
    ):
        with pytest.raises(InputError, match=match):
            Stage(**values)
    with pytest.raises(InputError, match="at least one"):
        OptimiseConfig(stages=())

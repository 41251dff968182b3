"""Scheduler files: what is left out, what is read, what is refused by name."""

import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance.published.scheduler_config import SchedulerConfig

# As published with Stable Diffusion 1.5.
PUBLISHED = {
    "_class_name": "PNDMScheduler",
    "_diffusers_version": "0.6.0",
    "beta_end": 0.012,
    "beta_schedule": "scaled_linear",
    "beta_start": 0.00085,
    "num_train_timesteps": 1000,
    "set_alpha_to_one": False,
    "skip_prk_steps": True,
    "steps_offset": 1,
    "trained_betas": None,
    "clip_sample": False,
}


def read(**values) -> SchedulerConfig:
    return SchedulerConfig.from_json(values, "folder/scheduler_config.json")


def test_the_published_file():
    found = read(**PUBLISHED)
    assert found == SchedulerConfig(
        1000, "scaled_linear", 0.00085, 0.012, "epsilon", "leading", 1, False, False, 1.0
    )
    assert found.kind == "noise" and found.schedule().kind == "scaled_linear"


@pytest.mark.parametrize(
    ("name", "clips", "ends_clean", "spacing"),
    [
        (None, True, True, "leading"),
        ("DDIMScheduler", True, True, "leading"),
        ("DDPMScheduler", True, True, "leading"),
        ("PNDMScheduler", False, False, "leading"),
        ("EulerDiscreteScheduler", False, True, "linspace"),
    ],
)
def test_what_is_left_out_is_as_the_scheduler_has_it(name, clips, ends_clean, spacing):
    found = read(**({"_class_name": name} if name else {}))
    assert (found.clip_sample, found.set_alpha_to_one) == (clips, ends_clean)
    assert found.timestep_spacing == spacing and found.steps_offset == 0
    assert (found.beta_schedule, found.beta_start, found.beta_end) == ("linear", 1e-4, 2e-2)


def test_every_option_is_read():
    found = read(
        _class_name="DDIMScheduler",
        num_train_timesteps=500,
        beta_schedule="squaredcos_cap_v2",
        beta_start=0.001,
        beta_end=1e-2,
        prediction_type="sample",
        timestep_spacing="trailing",
        steps_offset=3,
        set_alpha_to_one=False,
        clip_sample=False,
        clip_sample_range=2,
        thresholding=False,
        rescale_betas_zero_snr=False,
        variance_type="fixed_small",
    )
    assert found == SchedulerConfig(
        500, "squaredcos_cap_v2", 0.001, 1e-2, "sample", "trailing", 3, False, False, 2
    )
    assert found.kind == "clean" and found.schedule().kind == "cosine"
    assert found.schedule().count == 500


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"_class_name": "LCMScheduler"}, r"_class_name: 'LCMScheduler' is not supported"),
        ({"_class_name": ["PNDMScheduler"]}, r"_class_name: "),
        ({"prediction_type": "flow"}, r"prediction_type: 'flow'.*valid: epsilon, sample, v_pre"),
        ({"beta_schedule": "sigmoid"}, "beta_schedule: 'sigmoid'"),
        ({"beta_schedule": "cosine"}, "beta_schedule: 'cosine'.*squaredcos_cap_v2"),
        ({"beta_schedule": 3}, "beta_schedule: expected a text, found 3"),
        ({"timestep_spacing": "karras"}, "timestep_spacing: 'karras'"),
        ({"rescale_betas_zero_snr": True}, "rescale_betas_zero_snr: True is not supported"),
        ({"thresholding": True}, "thresholding: True is not supported"),
        ({"use_karras_sigmas": True}, "use_karras_sigmas: True is not supported"),
        ({"variance_type": "learned_range"}, "variance_type: 'learned_range' is not supported"),
        ({"trained_betas": [0.1] * 1000}, r"trained_betas: \[0\.1, "),
        ({"never_heard_of": 1.5}, "never_heard_of: 1.5 is not supported"),
        ({"steps_offset": -1}, "steps_offset: -1 must be 0 to 999"),
        ({"steps_offset": 1000}, "steps_offset: 1000 must be 0 to 999"),
        ({"steps_offset": 0.5}, "steps_offset: expected a whole number, found 0.5"),
        ({"steps_offset": True}, "steps_offset: expected a whole number, found True"),
        ({"clip_sample": 1}, "clip_sample: expected true or false, found 1"),
        ({"clip_sample_range": 0}, "clip_sample_range: 0 must be above 0"),
        ({"clip_sample_range": float("nan")}, "clip_sample_range: nan is not a finite number"),
        ({"set_alpha_to_one": "no"}, "set_alpha_to_one: expected true or false, found 'no'"),
        ({"num_train_timesteps": 10**12}, "num_train_timesteps: 1000000000000 must be 2 to"),
        ({"beta_end": 2.0}, "betas from"),
    ],
)
def test_what_would_paint_otherwise_is_refused_by_name(changes, said):
    with pytest.raises(InputError, match=f"^folder/scheduler_config.json: {said}") as error:
        read(**(PUBLISHED | changes))
    assert len(str(error.value)) < 350

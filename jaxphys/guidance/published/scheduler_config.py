"""What `scheduler/scheduler_config.json` says, in diffusers' layout: the noise that a network was
trained with, and how pictures are sampled with it.

The method is ours to choose (`text_to_image`: DDIM or DDPM); steps, offset, end and clipping are
the file's. Options that would need another computation are refused, by their name; those of
methods that are not used here do nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Self

import numpy as np

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, nearest, shown
from jaxphys.core.fields import check_ranges
from jaxphys.guidance.diffusion.discrete_schedule import Betas, DiscreteSchedule
from jaxphys.guidance.diffusion.schedule import Kind

Sampler = Literal["ddim", "ddpm"]
SAMPLERS = ("ddim", "ddpm")
MOST_STEPS = 100_000
CLEAN = -1  # the step before the first, at which nothing is noisy

BETAS: dict[str, Betas] = {
    "linear": "linear",
    "scaled_linear": "scaled_linear",
    "squaredcos_cap_v2": "cosine",
}
PREDICTIONS: dict[str, Kind] = {
    "epsilon": "noise",
    "v_prediction": "velocity",
    "sample": "clean",
}
SPACINGS = ("leading", "trailing", "linspace")
CHOICES = {
    "beta_schedule": tuple(BETAS),
    "prediction_type": tuple(PREDICTIONS),
    "timestep_spacing": SPACINGS,
}
# Schedulers of the noise tables here, and what each takes for options that its file leaves out;
# without a name, diffusers' own are those of DDIM. Those that have no such option never clip.
DDIM = {"clip_sample": True, "set_alpha_to_one": True, "timestep_spacing": "leading"}
PNDM = {"clip_sample": False, "set_alpha_to_one": False, "timestep_spacing": "leading"}
SIGMAS = {"clip_sample": False, "set_alpha_to_one": True, "timestep_spacing": "linspace"}
CLASSES = {
    "DDIMScheduler": DDIM,
    "DDPMScheduler": DDIM,
    "PNDMScheduler": PNDM,
    "EulerDiscreteScheduler": SIGMAS,
    "EulerAncestralDiscreteScheduler": SIGMAS,
    "LMSDiscreteScheduler": SIGMAS,
    "HeunDiscreteScheduler": SIGMAS,
    "DPMSolverMultistepScheduler": SIGMAS,
}
# Options of methods that are not used here.
IDLE = {
    "skip_prk_steps", "solver_order", "solver_type", "algorithm_type", "lower_order_final",
    "interpolation_type", "dynamic_thresholding_ratio", "sample_max_value", "final_sigmas_type",
    "timestep_type", "lambda_min_clipped",
}  # fmt: skip
# Any other option must be off, or be this.
PLAIN = {"variance_type": ("fixed_small",)}


@dataclass(frozen=True)
class SchedulerConfig:
    """Fields are named as in the file.

    Attributes:
        beta_schedule, beta_start, beta_end, num_train_timesteps: see `DiscreteSchedule`.
        prediction_type: what the network predicts.
        timestep_spacing: where the sampled steps lie among those of the training, see `visited`.
        steps_offset: added to the steps of "leading" spacing.
        set_alpha_to_one: DDIM ends clean, not at the training's first step. DDPM always does.
        clip_sample, clip_sample_range: clean estimates are clipped to +- the range.
    """

    num_train_timesteps: int = 1000
    beta_schedule: str = "linear"
    beta_start: float = 1e-4
    beta_end: float = 2e-2
    prediction_type: str = "epsilon"
    timestep_spacing: str = "leading"
    steps_offset: int = 0
    set_alpha_to_one: bool = True
    clip_sample: bool = True
    clip_sample_range: float = field(default=1.0, metadata={"above": 0})

    def __post_init__(self):
        for name, valid in CHOICES.items():
            value = getattr(self, name)
            if value not in valid:
                raise InputError(
                    f"{name}: {shown(value)} is not supported; {nearest(value, valid)}"
                )
        if not 2 <= self.num_train_timesteps <= MOST_STEPS:
            raise InputError(
                f"num_train_timesteps: {self.num_train_timesteps} must be 2 to {MOST_STEPS}"
            )
        if not 0 <= self.steps_offset < self.num_train_timesteps:
            raise InputError(
                f"steps_offset: {self.steps_offset} must be 0 to {self.num_train_timesteps - 1}"
            )
        check_ranges(self)
        self.schedule()  # has ranges of its own

    @classmethod
    def from_json(cls, values: Mapping[str, Any], source: str) -> Self:
        """Out of a scheduler_config.json.

        Raises:
            InputError: a scheduler or an option that is not supported, or a value that cannot be
                used; names `source` and the field.
        """
        name = values.get("_class_name", "DDIMScheduler")
        if not isinstance(name, str) or name not in CLASSES:
            tail = nearest(str(name), CLASSES)
            raise InputError(f"{source}: _class_name: {shown(name)} is not supported; {tail}")

        def unknown(option: str, value: Any) -> None:
            valid = (None, False, *PLAIN.get(option, ()))
            if not option.startswith("_") and option not in IDLE and value not in valid:
                allowed = " or ".join(map(repr, valid))
                raise InputError(
                    f"{source}: {option}: {shown(value)} is not supported, only {allowed}"
                )

        return from_json(cls, dict(CLASSES[name]) | dict(values), f"{source}: ", unknown)

    def schedule(self) -> DiscreteSchedule:
        """The noise of each step of the training."""
        betas = BETAS[self.beta_schedule]
        return DiscreteSchedule(betas, self.num_train_timesteps, self.beta_start, self.beta_end)

    @property
    def kind(self) -> Kind:
        """What the network predicts, as `interpret` calls it."""
        return PREDICTIONS[self.prediction_type]

    def visited(self, steps: int, sampler: Sampler) -> tuple[np.ndarray, np.ndarray]:
        """The steps of the training at which the network is asked, falling, and those to which each
        answer leads: two arrays (steps,) of integers, `CLEAN` where nothing is noisy.

        As of N steps n are taken: "leading" takes every (N // n)-th from `steps_offset` on,
        "trailing" every (N / n)-th down from the last, "linspace" n from the first to the last (Lin
        et al. 2024, table 2). DDIM goes N // n steps down from each, DDPM to the next one.

        Raises InputError for more steps than the training had, or none.
        """
        count = self.num_train_timesteps
        if not 1 <= steps <= count:
            raise InputError(f"steps = {steps}: the schedule has 1 to {count}")
        stride = count // steps
        if self.timestep_spacing == "leading":
            places: np.ndarray = np.arange(steps)[::-1] * stride + self.steps_offset
        elif self.timestep_spacing == "trailing":
            places = np.round(count - np.arange(steps) * (count / steps)) - 1
        else:
            places = np.round(np.linspace(0, count - 1, steps))[::-1]
        asked = np.minimum(places, count - 1).astype(int)
        if sampler == "ddpm":
            return asked, np.append(asked[1:], CLEAN)
        reached = asked - stride
        end = CLEAN if self.set_alpha_to_one else 0
        return asked, np.where(reached < 0, end, reached)

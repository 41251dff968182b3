"""The schedules of published diffusion models: a table of noise levels, one for each of N steps.

It answers as `diffusion.Schedule` does, with time in [0, 1] standing for the nearest of the steps 0
to N - 1, so that sampling and distillation need not know which of the two they were given.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError, nearest

Betas = Literal["linear", "scaled_linear", "cosine"]
BETAS = ("linear", "scaled_linear", "cosine")


@dataclass(frozen=True)
class DiscreteSchedule:
    """alpha^2 after step i is the product of 1 - beta_j over j <= i.

    Attributes:
        kind: "linear" betas (Ho et al. 2020), betas with "scaled_linear" roots (Rombach et al.
            2022), or "cosine" alphas (Nichol & Dhariwal 2021, eq. 17), which has its own betas.
        count: N, the steps of the model's training.
        first, last: beta_0 and beta_{N-1}. The defaults are Stable Diffusion's.
    """

    kind: Betas = "scaled_linear"
    count: int = 1000
    first: float = 0.00085
    last: float = 0.012

    def __post_init__(self):
        if self.kind not in BETAS:
            raise InputError(f"unknown schedule {self.kind!r}: {nearest(self.kind, BETAS)}")
        if self.count < 2:
            raise InputError(f"a schedule needs at least two steps, got count = {self.count}")
        if not 0.0 < self.first <= self.last < 1.0:
            raise InputError(
                f"betas from {self.first} to {self.last}: must satisfy 0 < first <= last < 1"
            )

    def alphas_cumulative(self) -> np.ndarray:
        """alpha^2 by step: (count,) float64, falling, read-only."""
        return _alphas_cumulative(self)

    def index(self, time: Array) -> Array:
        """The step nearest to `time` in [0, 1]: int32 of its shape, 0 to count - 1."""
        step = jnp.round(jnp.asarray(time) * (self.count - 1))
        return jnp.clip(step, 0, self.count - 1).astype(jnp.int32)

    def alpha_sigma(self, time: Array) -> tuple[Array, Array]:
        """Signal and noise scale at the step nearest to `time`; same shape as `time`.

        One step before the first, at -1 / (count - 1), and below, samples are clean: (1, 0). Some
        samplers end there.
        """
        kept = self.alphas_cumulative()
        alpha, sigma = self._read(np.sqrt(kept), time), self._read(np.sqrt(1.0 - kept), time)
        clean = jnp.asarray(time) * (self.count - 1) < -0.5
        return jnp.where(clean, 1, alpha), jnp.where(clean, 0, sigma)

    def log_snr(self, time: Array) -> Array:
        """log(alpha^2 / sigma^2) at the step nearest to `time`: falls, finite at both ends."""
        kept = self.alphas_cumulative()
        return self._read(np.log(kept) - np.log1p(-kept), time)

    def step_of_ratio(self, ratio: Array) -> Array:
        """The step, with its fraction, at which sigma / alpha equals `ratio` >= 0: exact at the
        table's entries, linear in alpha^2 between them, 0 and count - 1 beyond them."""
        ratio = jnp.asarray(ratio)
        dtype = jnp.result_type(ratio, float)
        kept = jnp.asarray(self.alphas_cumulative()[::-1], dtype)
        steps = jnp.arange(self.count, dtype=dtype)[::-1]
        return jnp.interp(1.0 / (1.0 + ratio.astype(dtype) ** 2), kept, steps)

    def time_of_ratio(self, ratio: Array) -> Array:
        """Time at which sigma / alpha equals `ratio` >= 0, see `step_of_ratio`."""
        return self.step_of_ratio(ratio) / (self.count - 1)

    def _read(self, table: np.ndarray, time: Array) -> Array:
        return jnp.asarray(table, jnp.result_type(time, float))[self.index(time)]


@cache
def _alphas_cumulative(schedule: DiscreteSchedule) -> np.ndarray:
    first, last, count = schedule.first, schedule.last, schedule.count
    if schedule.kind == "linear":
        betas = np.linspace(first, last, count)
    elif schedule.kind == "scaled_linear":
        betas = np.linspace(first**0.5, last**0.5, count) ** 2
    else:
        angle = (np.arange(count + 1) / count + 0.008) / 1.008 * (0.5 * np.pi)
        kept = np.cos(angle) ** 2
        betas = np.minimum(1.0 - kept[1:] / kept[:-1], 0.999)
    cumulative = np.cumprod(1.0 - betas)
    cumulative.flags.writeable = False
    return cumulative

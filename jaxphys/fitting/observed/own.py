"""A comparison of one's own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from jaxphys.fitting.observed.base import Observed


@dataclass(frozen=True, eq=False)
class Own(Observed):
    """Residuals, or a loss, by a function of one's own.

    Attributes:
        function: of the motion's T frames and of what is drawn (None without `look=`), to residuals
            (T, ...), already over their noise; or to a loss (), where `is_loss`.
        times: (T,) [s].
        is_loss: whether it gives a loss, as a diffusion prior's opinion is one: then there is no
            Gauss-Newton, and no uncertainty comes of it.
    """

    name: ClassVar[str] = "own"
    function: Callable
    times: np.ndarray
    is_loss: bool = False

    def check_own(self, simulation, look):
        if not callable(self.function):
            raise self.fail("function", f"is {self.function!r}; give a function of the motion")

    def noise_of(self, simulation):
        return self.noise or 1.0

    def data(self, simulation, look):
        return ()

    def residuals(self, motion, look, data):
        return jnp.asarray(self.function(motion, look)) * self.weight ** (
            1 if self.is_loss else 0.5
        )

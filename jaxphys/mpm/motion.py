"""How something moved: frames in the object's own order, with the status of each.

The solver sorts particles for the sake of memory; nobody who looks at a motion needs to know. A
frame holds the particles in the order in which the object was given, and says which of them carry
what is drawn, so that no reader has to guess it from a count.
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.state import OK, Status


def _is_traced(status: Status) -> bool:
    return isinstance(status.code, jax.core.Tracer)


class BodyFrame(NamedTuple):
    """Where a rigid body is: its centre [m], (3,), and the quaternion w, x, y, z from its own axes
    to the world's, (4,).
    """

    centre: Array
    orientation: Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Frame:
    """One moment of a motion. A pytree.

    Attributes:
        position: (P, 3) [m], in the object's order.
        deformation: total deformation gradients (P, 3, 3); the elastic ones where a simulation
            keeps no total.
        time: () [s].
        status: whether the simulation was sound up to here; if not, the numbers are NaN.
        carriers: which particle carries each drawn point, int32 (K,).
        body: where the rigid body is, None if there is none.
    """

    position: Array
    deformation: Array
    time: Array
    status: Status
    carriers: Array
    body: BodyFrame | None = None

    def carried(self) -> tuple[Array, Array]:
        """Positions (K, 3) [m] and deformation gradients (K, 3, 3) of the particles that carry
        what is drawn, in the order of what is drawn.
        """
        return self.position[self.carriers], self.deformation[self.carriers]

    def check(self, number: int | None = None) -> "Frame":
        """Itself. Raises `SimulationError` if the simulation failed; `number` is for the message.

        Inside jit, where no number is known yet, nothing is raised: the NaN speak.
        """
        if not _is_traced(self.status):
            check(self.status, number)
        return self


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Motion:
    """T frames, the first one the initial state. A pytree.

    Attributes:
        position: (T, P, 3) [m], in the object's order.
        deformation: (T, P, 3, 3), as in `Frame`.
        time: (T,) [s].
        status: of each frame, arrays (T,); after a failure the frames are NaN.
        carriers: which particle carries each drawn point, int32 (K,).
        body: where the rigid body is, (T, 3) and (T, 4), None if there is none.
    """

    position: Array
    deformation: Array
    time: Array
    status: Status
    carriers: Array
    body: BodyFrame | None = None

    def __len__(self) -> int:
        return self.position.shape[0]

    def __getitem__(self, index: int) -> Frame:
        """Frame `index`, from the end if it is negative."""
        if not -len(self) <= index < len(self):
            raise IndexError(f"frame {index} of a motion of {len(self)} frames")
        return Frame(
            self.position[index],
            self.deformation[index],
            self.time[index],
            Status(*(part[index] for part in self.status)),
            self.carriers,
            jax.tree.map(lambda part: part[index], self.body),
        )

    def check(self) -> "Motion":
        """Itself. Raises `SimulationError` with the first frame that failed, particle and remedy.

        Inside jit, where no number is known yet, nothing is raised: the NaN speak.
        """
        if not _is_traced(self.status):
            failed = np.flatnonzero(np.asarray(self.status.code) != OK)
            if failed.size:
                self[int(failed[0])].check(int(failed[0]))
        return self


def join(frames: list[Frame]) -> Motion:
    """A motion of frames one after the other, all of the same particles.

    Raises:
        InputError: there are no frames.
    """
    if not frames:
        raise InputError("motion: there are no frames")
    library = np if isinstance(frames[0].position, np.ndarray) else jnp
    return Motion(
        library.stack([frame.position for frame in frames]),
        library.stack([frame.deformation for frame in frames]),
        library.stack([frame.time for frame in frames]),
        Status(*(library.stack(parts) for parts in zip(*(f.status for f in frames), strict=True))),
        frames[0].carriers,
        jax.tree.map(lambda *parts: library.stack(parts), *(f.body for f in frames)),
    )

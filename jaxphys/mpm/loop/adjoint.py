"""How a rollout's gradient is computed. The adjoint owns the loop; each gives the same gradient."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import jax

from jaxphys.core.errors import InputError


@dataclass(frozen=True)
class Plain:
    """Keep what every step needs. Fastest; memory grows with the number of steps."""


@dataclass(frozen=True)
class Checkpointed:
    """Keep the state at the start of each segment and run segments again on the way back.

    One more forward pass; memory for `segments` states and the steps of one segment. `segments`
    None is the square root of the number of steps, where the sum of the two is least.
    """

    segments: int | None = None

    def __post_init__(self):
        if self.segments is not None and self.segments < 1:
            raise InputError(
                f"Checkpointed.segments is {self.segments}: give at least 1, or None for the "
                "square root of the number of steps."
            )


Adjoint = Plain | Checkpointed


def repeat(adjoint: Adjoint, body: Callable, carry, length):
    """`carry` after `length` calls of `body(carry) -> carry`.

    A length that is not an int is traced, and then there is no reverse mode.

    """
    if not isinstance(length, int):
        return jax.lax.fori_loop(0, length, lambda _, c: body(c), carry)

    def run(carry, count):
        return jax.lax.scan(lambda c, _: (body(c), None), carry, length=count)[0]

    if isinstance(adjoint, Plain) or length < 2:
        return run(carry, length)
    inner, outer, rest = split(length, adjoint.segments)
    # The scan keeps the recomputation from being merged with the first pass.
    segment = jax.checkpoint(lambda c: run(c, inner), prevent_cse=False)
    carry = jax.lax.scan(lambda c, _: (segment(c), None), carry, length=outer)[0]
    if rest:
        carry = jax.checkpoint(lambda c: run(c, rest))(carry)
    return carry


def split(length: int, segments: int | None) -> tuple[int, int, int]:
    """(steps per segment, segments, steps left over) for `length` steps."""
    if segments is None:
        segments = max(1, round(math.sqrt(length)))
        # A divisor nearby saves compiling the remainder.
        near = range(segments, 2 * segments)
        segments = next((s for s in near if length % s == 0), segments)
    segments = min(segments, length)
    inner = length // segments
    return inner, segments, length - inner * segments


def for_frames(adjoint: Adjoint, frames: int, steps_per_frame: int) -> tuple[Adjoint, bool]:
    """The adjoint within a frame, and whether a frame is itself run again on the way back.

    Checkpointed: as many states in all as for one loop over every step, but at least one a frame.
    """
    if isinstance(adjoint, Plain):
        return adjoint, False
    wanted = adjoint.segments or math.sqrt(frames * steps_per_frame)
    segments = max(1, round(wanted / frames))
    if segments == 1:
        return Plain(), True
    return Checkpointed(min(segments, steps_per_frame)), False

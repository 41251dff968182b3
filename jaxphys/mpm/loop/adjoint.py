"""How a rollout's gradient is computed. The adjoint owns the loop.

`Plain` and `Checkpointed` give the same gradient, `Truncated` gives another one on purpose.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import jax

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.budget import Cost, cost_of


@dataclass(frozen=True)
class Plain:
    """Keep what every step needs. Fastest; memory grows with the number of steps."""


@dataclass(frozen=True)
class Checkpointed:
    """Keep the state at the start of each segment and run segments again on the way back.

    One more forward pass; memory for `segments` states and the steps of one segment. `segments`
    None is the square root of the number of steps, where the sum of the two is least.

    bytes: how much a gradient may keep instead, from which follows what is run again: nothing where
    all steps fit; else as many steps from the start as must be, in segments, and where their starts
    do not fit, in segments of segments, for one more forward pass of those. Of one scene: `vmap`
    multiplies it. `budget.WORK` says what is set aside for the step at hand.

    besides: of these bytes, what is kept elsewhere; `rollout_frames` sets it.
    """

    segments: int | None = None
    bytes: int | None = None
    besides: int = 0

    def __post_init__(self):
        if self.segments is not None and self.segments < 1:
            raise InputError(
                f"Checkpointed.segments is {self.segments}: give at least 1, or None for the "
                "square root of the number of steps."
            )
        if self.bytes is not None and self.bytes < 1:
            raise InputError(f"Checkpointed.bytes is {self.bytes}: give at least 1, or None.")
        if self.bytes is not None and self.segments is not None:
            raise InputError(
                "Checkpointed: segments and bytes are both given; leave one of them None."
            )


@dataclass(frozen=True)
class Truncated:
    """Truncated backpropagation: the gradient goes through the last `window` steps alone.

    BIASED, on purpose: what acts before is taken as given, so that the result is no gradient of the
    rollout's end unless `window` covers it. It keeps the windows' steps only, and derivatives that
    grow from step to step stay small (Williams and Peng 1990). Of `rollout` the last steps; of
    `rollout_frames` the last steps of every frame, so that with fewer than a frame has, no
    derivative reaches back past the frame. Both directions are cut alike.
    """

    window: int

    def __post_init__(self):
        if self.window < 1:
            raise InputError(f"Truncated.window is {self.window}: give at least 1 step.")


Adjoint = Plain | Checkpointed | Truncated


def repeat(adjoint: Adjoint, body: Callable, carry, length):
    """`carry` after `length` calls of `body(carry) -> carry`.

    A length that is not an int is traced, and then there is no reverse mode.

    Raises:
        InputError: the budget of `Checkpointed` is too small, or `Truncated` with a traced length.
    """
    if not isinstance(length, int):
        if isinstance(adjoint, Truncated):
            raise InputError("Truncated: the number of steps is traced; give an int.")
        return jax.lax.fori_loop(0, length, lambda _, c: body(c), carry)
    if isinstance(adjoint, Truncated):
        first = max(0, length - adjoint.window)
        if first:
            # All that the steps use is cut off as well, or they would be differentiated in vain.
            step, used = jax.closure_convert(body, carry)
            carry, used = jax.lax.stop_gradient((carry, used))
            carry = jax.lax.stop_gradient(_run((), lambda c: step(c, *used), carry, first))
        return _run((), body, carry, length - first)
    if isinstance(adjoint, Plain) or length < 2:
        return _run((), body, carry, length)
    if adjoint.bytes is None:
        return _run((adjoint.segments,), body, carry, length)
    again, levels = planned(cost_of(body, carry), length, adjoint)
    carry = _run(levels, body, carry, again)
    return _run((), body, carry, length - again)


def _run(levels: tuple[int | None, ...], body: Callable, carry, length: int):
    """`length` calls of `body` in `levels[0]` segments, each in `levels[1]` segments and so on, the
    starts of which are kept and their insides run again.
    """
    if not levels or length < 2:
        return jax.lax.scan(lambda c, _: (body(c), None), carry, length=length)[0]
    inner, outer, rest = split(length, levels[0])
    # The scan keeps the recomputation from being merged with the first pass.
    segment = jax.checkpoint(lambda c: _run(levels[1:], body, c, inner), prevent_cse=False)
    carry = jax.lax.scan(lambda c, _: (segment(c), None), carry, length=outer)[0]
    if rest:
        carry = jax.checkpoint(lambda c: _run(levels[1:], body, c, rest))(carry)
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


def planned(cost: Cost, length: int, adjoint: Checkpointed) -> tuple[int, tuple[int, ...]]:
    """(steps from the start that are run again, their segments of each level) within the budget.

    Raises:
        InputError: with the least bytes that would do.
    """
    budget = (adjoint.bytes or 0) - adjoint.besides - cost.work
    if length * cost.step <= budget:
        return 0, ()
    one, two = (_least(cost, length, levels) for levels in (1, 2))
    if one[0] <= budget:
        # More steps that keep all leave less to be run again, but also less room for it.
        low, high = 0, length
        while high - low > 1:
            kept = (low + high) // 2
            need = kept * cost.step + _least(cost, length - kept, 1)[0]
            low, high = (kept, high) if need <= budget else (low, kept)
        return length - low, _least(cost, length - low, 1)[1]
    if two[0] <= budget:
        return length, two[1]
    least = min(length * cost.step, one[0], two[0]) + cost.work + adjoint.besides
    raise InputError(
        f"Checkpointed.bytes is {adjoint.bytes}: {length} steps need at least {least}; give more, "
        "or simulate fewer steps or particles."
    )


def _least(cost: Cost, length: int, levels: int) -> tuple[int, tuple[int, ...]]:
    """The least bytes that segments of so many levels keep, and how many segments each has."""
    found = []
    for segments in range(1, min(length, 4 * math.isqrt(length) + 4) + 1):
        inner, outer, rest = split(length, segments)
        longest = max(inner, rest)
        if levels == 1:
            inside, further = longest * cost.step, tuple[int, ...]()
        else:
            inside, further = _square_root(cost, longest)
        found.append(((outer + bool(rest)) * cost.state + inside, (segments, *further)))
    return min(found)


def _square_root(cost: Cost, length: int) -> tuple[int, tuple[int, ...]]:
    """As `_least` of one level, at once: segments of about sqrt(step / state length) steps."""
    segments = max(1, round(math.sqrt(length * cost.step / cost.state)))
    inner, outer, rest = split(length, segments)
    return (outer + bool(rest)) * cost.state + max(inner, rest) * cost.step, (segments,)


def for_frames(
    adjoint: Adjoint, frames: int, steps_per_frame: int, cost: Cost | None = None
) -> tuple[Adjoint, int]:
    """The adjoint within a frame, and how often frames are run again on the way back: not at all,
    each from its own start, or each from the start of its group of `frame_groups`.

    Checkpointed: as many states in all as for one loop over every step, but at least one a frame.
    cost: of one frame under `Plain`, for `Checkpointed.bytes`.
    """
    if isinstance(adjoint, Plain | Truncated):
        return adjoint, 0
    if adjoint.bytes is not None and cost is not None:
        a_step = Cost(cost.state, cost.step // steps_per_frame)
        if frames * cost.step + a_step.work <= adjoint.bytes:
            return Plain(), 0
        groups, size = frame_groups(frames)
        one, two = frames * cost.state, (groups + size) * cost.state
        levels = 1 if 2 * one <= adjoint.bytes or frames < 4 else 2
        return replace(adjoint, besides=one if levels == 1 else two), levels
    wanted = adjoint.segments or math.sqrt(frames * steps_per_frame)
    segments = max(1, round(wanted / frames))
    if segments == 1:
        return Plain(), 1
    return Checkpointed(min(segments, steps_per_frame)), 0


def frame_groups(frames: int) -> tuple[int, int]:
    """(groups, frames in each but a shorter last one)."""
    size = math.ceil(math.sqrt(frames))
    return math.ceil(frames / size), size

"""Random interior points spread to blue noise: even in spacing, without the order of a grid.

Points are soft spheres that push each other apart until none overlap (jax-md: neighbour lists, the
harmonic soft sphere, FIRE descent of Bitzek et al. 2006). Their diameter is the cube root of the
volume each has, at which spheres fill 52 % of space: less than a random packing jams at, so that a
state without overlap, and so without pressure on the surface, exists.
"""

import warnings

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError

_STEPS_AT_ONCE = 20
# Room in the neighbour list, over what the first positions need.
_CAPACITY = 1.25
# Farthest a point moves along an axis, in diameters: one that finds a gap stays near.
_FARTHEST = 0.75


def blue_noise(
    points: np.ndarray,
    diameter: float,
    *,
    fixed: np.ndarray | None = None,
    steps: int = 100,
) -> np.ndarray:
    """Points (M, 3) [m] moved apart to distances of about `diameter`; deterministic.

    Args:
        points: (M, 3) [m], such as `fill_interior` gives.
        diameter: of the spheres [m]; the side of the cube that each point has to itself.
        fixed: surface points (S, 3) [m] that push but do not move.
        steps: of descent, rounded up to a multiple of 20.

    Returns:
        (M, 3) in the dtype of `points`, each within 0.75 diameters of where it was, by axis.

    Raises:
        InputError: `diameter` or `steps` is not positive, a point is not finite, or jax-md is not
            installed (the extra `relax`).
    """
    if not diameter > 0 or steps < 1:
        raise InputError("blue noise: diameter and steps must be positive")
    points = np.asarray(points)
    fixed = np.zeros((0, 3)) if fixed is None else np.asarray(fixed)
    everything = np.concatenate([points, fixed]).astype(np.float64)
    if not np.isfinite(everything).all():
        raise InputError("blue noise: a point is not finite; leave it out")
    if len(points) < 1 or len(everything) < 2:
        return points.copy()
    with warnings.catch_warnings():
        # jax-md mixes int64 and int32 indices of small systems where float64 is enabled.
        warnings.filterwarnings("ignore", "scatter inputs have incompatible types", FutureWarning)
        return _relax(everything, len(points), diameter, steps).astype(points.dtype)


def _relax(everything: np.ndarray, moving: int, diameter: float, steps: int) -> np.ndarray:
    """The first `moving` of the points `everything` (N, 3), relaxed."""
    # jax-md takes seconds to import.
    try:
        from jax_md import energy, minimize, quantity, space
    except ImportError as error:
        raise InputError(
            "relaxing a filling needs jax-md: pip install 'jaxphys-splats[relax]'; or leave "
            "`relax` out, the filling is even without"
        ) from error

    # In diameters, with room to move inside the box of the neighbour search.
    low = everything.min(axis=0) - diameter
    start = jnp.asarray((everything - low) / diameter, jnp.float32)
    box = np.asarray((np.ptp(everything, axis=0) + 2 * diameter) / diameter, np.float32)
    moves = (jnp.arange(len(everything)) < moving)[:, None]
    displacement, _ = space.free()
    neighbours, potential = energy.soft_sphere_neighbor_list(
        displacement,
        box,
        sigma=1.0,
        epsilon=1.0,
        alpha=2.0,
        dr_threshold=0.3,
        capacity_multiplier=_CAPACITY,
    )
    push = quantity.force(potential)

    found = neighbours.allocate(start)
    template = found

    # The list goes through jax-md's own jit as a bare array: its other fields are static, hold
    # arrays, and cannot be compared with those of an earlier call.
    def force(position, pairs, **_):
        return jnp.where(moves, push(position, neighbor=template.set(idx=pairs)), 0)

    def shift(position, change, **_):
        return start + jnp.clip(position + change - start, -_FARTHEST, _FARTHEST)

    initialise, descend = minimize.fire_descent(force, shift)

    @jax.jit
    def advance(state, found):
        def body(_, carry):
            state, found = carry
            found = found.update(state.position)
            return descend(state, pairs=found.idx), found

        return jax.lax.fori_loop(0, _STEPS_AT_ONCE, body, (state, found))

    state = initialise(start, pairs=found.idx)
    extra = 0
    for _ in range(-(-steps // _STEPS_AT_ONCE)):
        following, after = advance(state, found)
        while bool(after.did_buffer_overflow):
            # From the same state again, with room for more neighbours of each point.
            extra = max(2 * extra, 4)
            found = neighbours.allocate(state.position, extra_capacity=extra)
            following, after = advance(state, found)
        state, found = following, after
    return np.asarray(state.position[:moving], np.float64) * diameter + low

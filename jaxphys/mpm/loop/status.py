"""Whether a step was sound, what failed first, and what is said of it."""

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.mpm.state import (
    CODES,
    COLLAPSED,
    INVERTED,
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_CONVERGED,
    NOT_FINITE,
    OK,
    STEP_TOO_LARGE,
    TOO_MANY_STEPS,
    UNSTABLE_STEP,
    Config,
    Status,
)

LANES = 16
COLLAPSE = 1e-3  # share of its volume below which a particle counts as collapsed


class SimulationError(InputError):
    """A simulation failed. `frame`, `step`, `particle` and `code` say where and how."""

    def __init__(self, message: str, frame: int | None, step: int, particle: int, code: int):
        super().__init__(message)
        self.frame, self.step, self.particle, self.code = frame, step, particle, code


_CAUSES = {
    NOT_FINITE: (
        "became infinite or not a number",
        "take a smaller dt, a softer material, or less force",
    ),
    LEFT_GRID: (
        "left the grid",
        "enlarge the domain, add a boundary that holds particles inside, or let one through which "
        "soft matter sank act on nodes (acts_on)",
    ),
    STEP_TOO_LARGE: (
        "moved more than one cell, or was deformed by more than its own size, in one step",
        "take a smaller dt, or lower the speed",
    ),
    LEFT_WINDOW: (
        "outgrew the window of the grid",
        "enlarge Config.window (and Config.slabs), or set them to None",
    ),
    INVERTED: (
        "is turned inside out (det F <= 0)",
        "start from deformation gradients with det F > 0",
    ),
    COLLAPSED: (
        "was pressed to less than a thousandth of its volume",
        "take a stiffer material, less force, a smaller dt, or for elastic or jelly the law "
        "neo-Hookean (--set law=neo-Hookean), which resists without bound",
    ),
    UNSTABLE_STEP: (
        "is stiffer than the step allows",
        "take a smaller dt (mpm.largest_stable_dt gives one), or a softer or denser material",
    ),
    TOO_MANY_STEPS: (
        "keeps the steps so short that a frame takes more than the most allowed",
        "raise Adaptive.most_steps, or take a softer or denser material or a coarser grid",
    ),
    NOT_CONVERGED: (
        "the equations of an implicit step were not solved, however short it was",
        "raise the tolerance, the iterations or most_steps of Implicit, or take explicit steps",
    ),
}


def check(status: Status, frame: int | None = None) -> None:
    """Raise `SimulationError` with the frame, step, particle and remedy unless all is well.

    Waits for the computation that `status` comes from. Not for use inside jit.
    """
    code = int(status.code)
    if code == OK:
        return
    what, remedy = _CAUSES[code]
    where = "" if frame is None else f"frame {frame}, "
    number, particle = int(status.step), int(status.particle)
    who = f"particle {particle} " if particle >= 0 else ""
    raise SimulationError(
        f"Simulation failed at {where}step {number}: {who}{what}; {remedy}.",
        frame,
        number,
        particle,
        code,
    )


def failure(
    config: Config,
    lowest: Array,
    highest: Array,
    before: Array,
    position: Array,
    velocity: Array,
    C: Array,
    F: Array,
    dt: Array,
) -> Array:
    """Code (N,) int32 of each particle after a step: OK, or what failed.

    A step multiplies det F by det(I + dt C), so that only one with |dt C| >= 1 can turn a particle
    inside out: that is a step too large. What is inverted without one was given so, and no law
    brings it back: Hencky's take a mirror image for rest.

    lowest, highest: `base_node` (3,) that the window has room for; before: positions (3, N) from
    which the step started.
    """
    grid, kernel = config.grid, config.kernel
    # Sums written out: a reduction within a fusion is not vectorised.
    v, c, f = (algebra.numbers(x) for x in (velocity, C, F))
    finite = jnp.isfinite(algebra.total(v) + algebra.total(f))
    slow = algebra.total(x * x for x in v) * dt**2 <= grid.spacing**2
    slow &= algebra.total(x * x for x in c) * dt**2 <= 1
    volume = algebra.determinant(F)
    code = jnp.full(finite.shape, OK, jnp.int32)
    if config.follows:
        # A particle outside of the window was clamped in the transfers of this very step.
        base = kernel.base_node(before, grid.spacing, grid.shape)
        held = (base >= lowest[:, None]) & (base <= highest[:, None])
        code = jnp.where(jnp.all(held, axis=0), code, LEFT_WINDOW)
    code = jnp.where(kernel.inside(position, grid.spacing, grid.shape), code, LEFT_GRID)
    code = jnp.where(volume < COLLAPSE, COLLAPSED, code)
    code = jnp.where(volume <= 0, INVERTED, code)
    code = jnp.where(slow, code, STEP_TOO_LARGE)
    return jnp.where(finite, code, NOT_FINITE)


def first_failure(code: Array, index: Array) -> Array:
    """One number () int32 for codes (N,) of particles `index` (N,): the least of it over any
    particles names the lowest that failed, and how. Those of a negative index do not count.
    """
    failed = (code != OK) & (index >= 0)
    return least(jnp.where(failed, CODES * index + code, NO_FAILURE))


def least(x: Array) -> Array:
    """The least of (..., N) along the last axis; in lanes where N allows, as vector units want."""
    if x.shape[-1] % LANES == 0:
        x = jnp.min(x.reshape(*x.shape[:-1], -1, LANES), axis=-2)
    return jnp.min(x, axis=-1)


NO_FAILURE = 2**31 - 1
MOST_PARTICLES = NO_FAILURE // CODES


def after_step(status: Status, first: Array) -> Status:
    """The status after a step, with `first_failure` of it. The first failure of all stays."""
    fails = (status.code == OK) & (first < NO_FAILURE)
    return Status(
        code=jnp.where(fails, first % CODES, status.code),
        step=jnp.where(fails, status.taken, status.step),
        particle=jnp.where(fails, first // CODES, status.particle),
        taken=status.taken + 1,
    )


def of_start(status: Status, F: Array) -> Status:
    """The status before a step from F (3, 3, N): what is inside out is told as such, whatever its
    law makes of it.
    """
    code = jnp.where(algebra.determinant(F) <= 0, INVERTED, OK)
    first = first_failure(code, jnp.arange(F.shape[-1], dtype=jnp.int32))
    return after_step(status, first)._replace(taken=status.taken)

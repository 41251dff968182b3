"""Gradients of the catalogue's scenes at short horizons, against central differences, in float64.

A loss is a random linear function of all that comes out; its derivative along a random direction of
all that goes in is held against the difference of two runs. A step of 1e-6 leaves some 1e-9.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.extreme import motion, pictures
from benchmarks.extreme.case import Case, Cell, Measure, judged
from benchmarks.extreme.matter import COUNT, SPACING, cube, scene, strained
from jaxphys.core.splats import Splats
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.state import OK
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.render import Settings, render

METHODS = ("gradient float64",)
H, STEPS = 1e-6, 4
# Without the cut-offs, at which pictures jump.
SMOOTH = Settings(alpha_min=1e-12, transmittance_min=0.0)
WEIGHTS = np.random.default_rng(7)
PULL = WEIGHTS.normal(size=(COUNT, 3)), WEIGHTS.normal(size=(COUNT, 3, 3))
PAINT = WEIGHTS.normal(size=(pictures.SIZE, pictures.SIZE, 3))


@partial(jax.jit, static_argnums=0)
def _motion(config, free, model, state, dt):
    """(loss, gradient) of E, x, v and F: each given as 1 + what is free of its own scale."""
    middle, speed = jnp.mean(state.position, axis=1, keepdims=True), SPACING / dt

    def loss(free):
        E, x, v, F = free
        values = {
            **model.parameters,
            "youngs_modulus": model.parameters["youngs_modulus"] * (1 + E),
        }
        start = state._replace(
            position=state.position + SPACING * x,
            velocity=state.velocity + 0.01 * speed * v,
            deformation=state.deformation * (1 + F),
        )
        end = rollout(config, replace(model, parameters=values), start, dt=dt, steps=STEPS)
        moved = jnp.sum((end.position - middle).T * PULL[0]) / SPACING
        size = jnp.max(jnp.abs(state.deformation))
        grown = jnp.sum(jnp.moveaxis(end.deformation, -1, 0) * PULL[1]) / size
        return moved + grown, end.status.code

    return jax.value_and_grad(loss, has_aux=True)(free)


@jax.jit
def _drawn(free, splats, camera):
    """(loss, gradient) of all numbers of the splats, each given relative to its own size."""

    def loss(free):
        m, c, o, k = free
        moved = Splats(
            splats.means + 0.1 * m,
            splats.covariances * (1 + 0.5 * (c + jnp.swapaxes(c, 1, 2))),
            splats.opacities * (1 + o),
            splats.colours + k,
        )
        image = render(moved, camera, settings=SMOOTH, capacity=pictures.ROOM)
        return jnp.sum(image.colour * PAINT)

    return jax.value_and_grad(loss)(free)


def _held(function, shapes, room) -> Cell:
    """`function(free)` -> (loss, gradient), along one direction."""
    random = np.random.default_rng(11)
    zero = tuple(jnp.zeros(shape) for shape in shapes)
    along = tuple(jnp.asarray(random.normal(size=shape)) for shape in shapes)
    ends = [function(jax.tree.map(lambda a, s=s: s * H * a, along))[0] for s in (1, -1)]
    slope = float(ends[0] - ends[1]) / (2 * H)
    parts = [float(jnp.sum(a * g)) for a, g in zip(along, function(zero)[1], strict=True)]
    size = max(abs(slope), max(abs(part) for part in parts))
    return judged((Measure("gradient", abs(sum(parts) - slope) / size, room),))


def of_motion(build, room, method: str) -> Cell:
    """One scene's gradient, over four steps."""
    made = build("float64")
    dt = 0.5 * largest_stable_dt(made.config, made.model, made.state).limit

    def function(free):
        (loss, code), slope = _motion(made.config, free, made.model, made.state, dt)
        assert int(code) == OK, f"the motion failed with code {int(code)}"
        return loss, slope

    return _held(function, ((COUNT,), (3, COUNT), (3, COUNT), (3, 3, COUNT)), room)


def of_picture(values, field, distance, room, method: str) -> Cell:
    """One picture's gradient."""
    splats = Splats(*(jnp.asarray(v) for v in values))
    camera = pictures.camera_of(field, "float64", distance)
    shapes = [leaf.shape for leaf in splats]
    return _held(lambda free: _drawn(free, splats, camera), shapes, room)


def _motions() -> dict:
    half = np.where(np.arange(COUNT) % 2 == 0, 1.0, 0.0)
    i = np.arange(COUNT)
    thread = np.stack([0.12 + 0.02 * i, 0.75 + 0 * i, 0.731 + 0 * i], 1)
    skew = 1e3 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0.0]])
    side = np.where(i < COUNT // 2, -1.0, 1.0)
    fast = np.stack([-0.45 * motion.sound() * side, 0 * side, 0 * side], 1)
    meeting = cube() + np.stack([0.05 * side, 0 * side, 0 * side], 1)
    block, lone = motion.block, motion.lone
    return {
        "E 1e2": partial(block, E=1e2),
        "E 1e11": partial(block, E=1e11),
        "nu -0.9": partial(block, nu=-0.9),
        "nu 0.4999": partial(block, nu=0.4999),
        "densities 1 to 1e4": partial(block, density=1.0 + 9999 * half),
        "moduli 1e4 to 1e10": partial(block, E=1e4 + 1e10 * half),
        "impact at Mach 0.9": partial(scene, position=meeting, velocity=fast),
        "flat to 5 %": partial(lone, F=np.diag([0.05, 1, 1]) @ strained(0.01)),
        "stretched 20 times": partial(lone, F=np.diag([20.0, 1, 1]) @ strained(0.01)),
        "1e3 rad/s": partial(lone, affine=skew, E=1e7),
        "thread": partial(block, position=thread),
        "coincident pairs": partial(block, position=cube()[i // 2 * 2]),
        "on nodes": partial(block, position=np.round(cube(2.0) / SPACING) * SPACING),
        "10 times its size apart": partial(block, position=cube(5.0)),
    }  # fmt: skip


def cases() -> list[Case]:
    """All gradients."""
    by = "central differences"
    found = [
        Case(
            f"gradient, {name}",
            "gradient",
            partial(of_motion, build, 1e-5),
            METHODS,
            by,
            quick=name in ("E 1e2", "E 1e11", "nu 0.4999", "flat to 5 %"),
        )
        for name, build in _motions().items()
    ]
    pick = (
        "plain", "points without a size", "needles", "pancakes", "300 km wide",
        "the camera within a splat", "just beyond the near plane", "1,000 km away", "opacity 1",
        "a field of 1 degrees", "a field of 170 degrees", "far aside, a field of 170 degrees",
    )  # fmt: skip
    drawn = pictures.scenes()
    for name in pick:
        values, _, field, distance = drawn[name]
        task = partial(of_picture, values, field, distance, 1e-5)
        quick = name in ("needles", "300 km wide", "a field of 170 degrees")
        found.append(Case(f"gradient, {name}", "gradient", task, METHODS, by, quick=quick))
    return found

"""Gaussians that look like photographs: Kerbl et al. (2023), section 5, at a fixed capacity.

A step draws one picture and compares it. The schedule is in shares of the run, so that a short run
is a whole one: all slow down, means by a hundred, and Gaussians are added during its first half.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.gaussians.density import DensityConfig, carry_moments, control_density, with_capacity
from jaxphys.gaussians.gaussians import Gaussians, select, to_splats
from jaxphys.reconstruction.capture import Shot
from jaxphys.reconstruction.similarity import (
    peak_signal_to_noise,
    photometric,
    structural_similarity,
)
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import Image, next_capacity, render, required_pairs
from jaxphys.render.settings import Settings

SETTINGS = Settings(depth=False)


@dataclass(frozen=True)
class ReconstructConfig:
    """Choices of `optimise`; lengths in units of the room's half side (`start.room`).

    Attributes:
        steps: of the optimisation.
        capacity: Gaussians at most.
        similarity: weight of the structural similarity in the loss, in [0, 1].
        rates: learning rate by field of `Gaussians`, at the start; that of means falls to a
            hundredth, the others to a tenth.
        rest_rate: of the harmonics above degree 0, as a share of the others.
        density_every: steps between two rounds of density control.
        density_from, density_until: shares of the run between which there is any.
        density: its thresholds; a gradient counts relative to the mean.
    """

    steps: int = 3000
    capacity: int = 20_000
    similarity: float = 0.2
    rates: tuple[tuple[str, float], ...] = (
        ("means", 2e-3),
        ("log_scales", 2e-2),
        ("quaternions", 1e-2),
        ("opacity_logits", 5e-2),
        ("harmonics", 1e-2),
    )
    rest_rate: float = 0.1
    density_every: int = 100
    density_from: float = 0.1
    density_until: float = 0.6
    density: DensityConfig = field(
        default_factory=lambda: DensityConfig(
            gradient_threshold=2.5, split_size=0.02, least_opacity=0.01, largest_size=0.3
        )
    )

    def __post_init__(self):
        if self.steps < 1 or self.capacity < 1:
            raise InputError("steps and capacity: must be at least 1")


class Photographs(NamedTuple):
    """Pictures of one size and their cameras, stacked.

    Attributes:
        camera: arrays with a leading axis (B, ...).
        pictures: uint8 (B, H, W, 4).
    """

    camera: Camera
    pictures: Array


class ReconstructState(NamedTuple):
    """All that the next step depends on: saved and restored, a run goes on to the same bytes."""

    gaussians: Gaussians
    alive: Array
    optimiser: Any
    pull: Array
    step: Array


def photographs(shots: list[Shot], pictures: list[np.ndarray]) -> list[Photographs]:
    """Shots and their pictures, stacked by size."""
    sizes: dict[tuple[int, ...], list[int]] = {}
    for index, picture in enumerate(pictures):
        sizes.setdefault(picture.shape, []).append(index)
    return [
        Photographs(
            jax.tree.map(
                lambda *x: jnp.stack(x), *(camera_of(shots[i], pictures[i]) for i in members)
            ),
            jnp.asarray(np.stack([pictures[i] for i in members])),
        )
        for members in sizes.values()
    ]


def camera_of(shot: Shot, picture: np.ndarray) -> Camera:
    """The camera of a shot for its picture (H, W, 4), whatever size that was brought to."""
    height, width = picture.shape[:2]
    scale = np.array([width / shot.size[0], height / shot.size[1]])
    return Camera(
        rotation=jnp.asarray(shot.rotation, jnp.float32),
        translation=jnp.asarray(shot.translation, jnp.float32),
        focal=jnp.asarray(scale * shot.focal, jnp.float32),
        centre=jnp.asarray(scale * shot.centre, jnp.float32),
        width=width,
        height=height,
    )


def _transform(config: ReconstructConfig, size: float) -> optax.GradientTransformation:
    rates = dict(config.rates)
    rates["means"] *= size
    groups = {
        name: optax.adam(
            optax.exponential_decay(rate, config.steps, 0.01 if name == "means" else 0.1), eps=1e-15
        )
        for name, rate in rates.items()
    }
    names: dict[str, Any] = {name: name for name in rates}
    return optax.multi_transform(groups, Gaussians(**names))


def start(gaussians: Gaussians, config: ReconstructConfig, size: float) -> ReconstructState:
    """The state before the first step. size: of the room, half its side."""
    gaussians, alive = with_capacity(gaussians, max(config.capacity, gaussians.count))
    return ReconstructState(
        gaussians,
        alive,
        _transform(config, size).init(gaussians),
        jnp.zeros(alive.shape, gaussians.means.dtype),
        jnp.zeros((), jnp.int32),
    )


def drawn(gaussians: Gaussians, camera: Camera, ground: Array, capacity: int | None) -> Image:
    """What a camera sees over a colour (3,)."""
    splats = to_splats(gaussians, position(camera))
    return render(splats, camera, background=ground, settings=SETTINGS, capacity=capacity)


def over(picture: Array, ground: Array) -> Array:
    """An uint8 picture (H, W, 4) over a colour (3,), in [0, 1]."""
    value = picture.astype(jnp.float32) / 255
    return value[..., :3] * value[..., 3:] + ground * (1 - value[..., 3:])


@partial(jax.jit, static_argnames=("config", "capacity", "size"))
def advance(
    state: ReconstructState,
    among: Photographs,
    index: Array,
    key: Array,
    config: ReconstructConfig,
    capacity: int,
    size: float,
) -> tuple[ReconstructState, Array]:
    """A step by the picture `index`; and whether it needed more room than `capacity`."""
    camera = jax.tree.map(lambda x: x[index], among.camera)
    ground = jax.random.uniform(jax.random.fold_in(key, state.step), (3,))
    seen = over(among.pictures[index], ground)

    def loss(gaussians: Gaussians):
        picture = drawn(gaussians, camera, ground, capacity)
        return photometric(picture.colour, seen, config.similarity), picture.overflow

    gradient, overflow = jax.grad(loss, has_aux=True)(state.gaussians)
    alive = state.alive
    gradient = jax.tree.map(
        lambda g: jnp.where(alive.reshape(-1, *(1,) * (g.ndim - 1)), g, 0), gradient
    )
    updates, optimiser = _transform(config, size).update(gradient, state.optimiser, state.gaussians)
    rest = jnp.ones((updates.harmonics.shape[1], 1)).at[1:].set(config.rest_rate)
    updates = replace(updates, harmonics=rest * updates.harmonics)
    pull = state.pull + jnp.linalg.norm(gradient.means, axis=1)
    gaussians = optax.apply_updates(state.gaussians, updates)
    return state._replace(
        gaussians=gaussians, optimiser=optimiser, pull=pull, step=state.step + 1
    ), overflow


@partial(jax.jit, static_argnames=("config", "size"))
def adapt(
    state: ReconstructState, key: Array, config: ReconstructConfig, size: float
) -> ReconstructState:
    """Density control."""
    mean = jnp.sum(state.pull) / jnp.maximum(jnp.sum(state.alive), 1)
    relative = state.pull / jnp.maximum(mean, jnp.finfo(mean.dtype).tiny)
    limits = config.density
    scaled = replace(
        limits, split_size=size * limits.split_size, largest_size=size * limits.largest_size
    )
    update = control_density(
        state.gaussians, state.alive, relative, jax.random.fold_in(key, state.step), scaled
    )
    return state._replace(
        gaussians=update.gaussians,
        alive=update.alive,
        optimiser=carry_moments(update, state.optimiser),
        pull=jnp.zeros_like(state.pull),
    )


def room_for_pairs(gaussians: Gaussians, among: list[Photographs]) -> list[int]:
    """Capacity for the pictures of each size: twice what the neediest of a few asks for."""
    rooms = []
    for group in among:
        needs = []
        for index in np.linspace(0, len(group.pictures) - 1, 4).astype(int):
            camera = jax.tree.map(lambda x, i=index: x[i], group.camera)
            splats = to_splats(gaussians, position(camera))
            needs.append(int(required_pairs(splats, camera, SETTINGS)))
        rooms.append(next_capacity(2 * max(needs) + 1))
    return rooms


def order(counts: list[int], steps: int, seed: int) -> list[tuple[int, int]]:
    """(group, index) of the picture of each step: all in turn, shuffled anew each time."""
    random = np.random.default_rng(seed)
    every = [(group, index) for group, count in enumerate(counts) for index in range(count)]
    found: list[tuple[int, int]] = []
    while len(found) < steps:
        found += [every[i] for i in random.permutation(len(every))]
    return found[:steps]


def optimise(
    state: ReconstructState,
    among: list[Photographs],
    config: ReconstructConfig,
    *,
    size: float,
    seed: int = 0,
    on_step: Callable[[ReconstructState], None] | None = None,
) -> ReconstructState:
    """Steps from `state` to the end.

    Args:
        state: where it goes on from.
        among: pictures to look like.
        config: see there.
        size: half the side of the room.
        seed: of the order of pictures, grounds and splits.
        on_step: sees every new state, to save or show it; may raise KeyboardInterrupt.
    """
    key = jax.random.key(seed)
    rooms = room_for_pairs(state.gaussians, among)
    turns = order([len(group.pictures) for group in among], config.steps, seed)
    first, last = (config.steps * s for s in (config.density_from, config.density_until))
    while int(state.step) < config.steps:
        group, index = turns[int(state.step)]
        following, overflow = advance(
            state, among[group], jnp.int32(index), key, config, rooms[group], size
        )
        if overflow:
            rooms[group] = next_capacity(rooms[group] + 1)
            continue
        state, step = following, int(following.step)
        if step % config.density_every == 0 and first <= step <= last:
            state = adapt(state, key, config, size)
        if on_step is not None:
            on_step(state)
    return state


def result(state: ReconstructState, least: float = 0.02) -> Gaussians:
    """The Gaussians that are alive and at least so opaque."""
    visible = np.asarray(jax.nn.sigmoid(state.gaussians.opacity_logits)) >= least
    return select(state.gaussians, np.flatnonzero(np.asarray(state.alive) & visible))


class Judged(NamedTuple):
    """Of pictures: peak signal-to-noise ratio [dB] and structural similarity, and what was drawn
    and seen, (H, W, 3) each."""

    psnr: list[float]
    ssim: list[float]
    drawn: list[np.ndarray]
    seen: list[np.ndarray]


def judge(gaussians: Gaussians, among: list[Photographs], ground: float = 1.0) -> Judged:
    """How like pictures the Gaussians look, over a ground of one grey."""
    found = Judged([], [], [], [])
    colour = jnp.full(3, ground)
    for group in among:
        for index in range(len(group.pictures)):
            camera = jax.tree.map(lambda x, i=index: x[i], group.camera)
            picture = jnp.clip(drawn(gaussians, camera, colour, None).colour, 0, 1)
            seen = over(group.pictures[index], colour)
            found.psnr.append(float(peak_signal_to_noise(picture, seen)))
            found.ssim.append(float(structural_similarity(picture, seen)))
            found.drawn.append(np.asarray(picture))
            found.seen.append(np.asarray(seen))
    return found

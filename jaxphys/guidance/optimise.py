"""From a sentence to 3D Gaussians: a cloud from the point prior, refined by score distillation.

As GSGEN (Chen et al. 2024): points first, then Gaussians moved by the 2D and the 3D prior, in one
or more stages (`stages.py`). The 3D prior judges the centres in its own frame, which is the
object's here: nothing is placed, turned or scaled before it is done.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from flax import nnx
from jax import Array
from tqdm import tqdm

from jaxphys.core.errors import InputError
from jaxphys.gaussians.compact import close_gaps
from jaxphys.gaussians.density import DensityConfig, carry_moments, control_density, with_capacity
from jaxphys.gaussians.gaussians import Gaussians, from_points, select
from jaxphys.gaussians.harmonics import dc_to_rgb
from jaxphys.gaussians.surface import gaussians_from_samples
from jaxphys.guidance import views
from jaxphys.guidance.bundled.pixel_guide import bundled_image_guide
from jaxphys.guidance.bundled.shape_guide import bundled_shape_guide
from jaxphys.guidance.clouds import even_subset
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.guides import Guides
from jaxphys.guidance.pictures import neighbour_sizes, room_for_pairs, view_picture
from jaxphys.guidance.stages import ONE, Stage, ends, stage_at, stepwise
from jaxphys.guidance.surfaces import surface_of_cloud
from jaxphys.render import next_capacity


@dataclass(frozen=True)
class OptimiseConfig:
    """Choices of `text_to_gaussians`; lengths in object lengths.

    Attributes:
        count: Gaussians that distillation starts from, drawn from the 3D prior.
        oversampling: so many times `count` are drawn, for `clouds.even_subset` to choose from.
        cloud, surface: of an object that is not distilled, the points drawn and the flat Gaussians
            that are laid on the surface through the better half of them.
        room: capacity for density control, as a multiple of `count`.
        steps: of distillation; with 0 the surface of the sampled cloud is the result.
        views: pictures a step.
        image, shape: of the two distillations.
        image_weight, shape_weight, regular_weight: of the losses.
        stages: parts of the optimisation, one after another: what each asks and learns.
        size, opacity: Gaussians start with `size` times the distance to their nearest neighbours.
        largest: standard deviations above are pulled back.
        density_every: steps between two rounds of density control, in stages that have it; 0 for
            none.
    """

    count: int = 2048
    oversampling: float = 3.0
    cloud: int = 16_384
    surface: int = 30_000
    room: float = 1.25
    steps: int = 160
    views: int = 4
    image: DistillationConfig = DistillationConfig(
        guidance=25.0, rescale=0.0, weight="clean", time=(0.02, 0.25, 0.1)
    )
    shape: DistillationConfig = DistillationConfig(
        guidance=3.0, rescale=0.7, weight="clean", time=(0.02, 0.12, 0.05)
    )
    image_weight: float = 1.0
    shape_weight: float = 0.5
    regular_weight: float = 1.0
    stages: tuple[Stage, ...] = ONE
    size: float = 0.7
    opacity: float = 0.85
    largest: float = 0.04
    density_every: int = 80
    density: DensityConfig = field(
        default_factory=lambda: DensityConfig(
            gradient_threshold=3.0, split_size=0.02, least_opacity=0.02, largest_size=0.15
        )
    )

    def __post_init__(self):
        if not self.stages:
            raise InputError("stages: an optimisation needs at least one")


class OptimiseState(NamedTuple):
    """All that the next step depends on: saved and restored, a run goes on to the same bytes."""

    gaussians: Gaussians
    alive: Array
    optimiser: Any
    pull: Array
    step: Array


def initial_gaussians(guides: Guides, key: Array, config: OptimiseConfig) -> Gaussians:
    """Gaussians at evenly spread points of a cloud drawn from the 3D prior."""
    drawn = guides.shape.sample(key, math.ceil(config.count * config.oversampling))
    points, colours = (np.asarray(array) for array in drawn)
    kept = even_subset(points, config.count)
    points, colours = points[kept], colours[kept]
    sizes = neighbour_sizes(points, config.size, config.largest)
    return from_points(points, colours, sizes, opacity=config.opacity)


def surface_gaussians(guides: Guides, key: Array, config: OptimiseConfig) -> Gaussians:
    """Flat Gaussians on the surface of a cloud drawn from the 3D prior, without distillation."""
    points, colours = (np.asarray(a) for a in guides.shape.sample(key, config.cloud))
    kept = even_subset(points, -(-len(points) // 2))
    samples = surface_of_cloud(points[kept], colours[kept], config.surface)
    return gaussians_from_samples(samples)


def _transform(config: OptimiseConfig) -> optax.GradientTransformation:
    """Adam. Rates fall to a tenth over all steps, in whatever stages these are."""
    steps, groups = max(config.steps, 1), {}
    for name, _ in config.stages[0].rates:
        rates = [dict(stage.rates)[name] for stage in config.stages]
        decays = [optax.exponential_decay(rate, steps, 0.1) for rate in rates]
        rate = stepwise(decays, ends(config.stages, steps))
        groups[name] = optax.adam(rate, eps=1e-15)
    names: dict[str, Any] = {name: name for name in groups}
    return optax.multi_transform(groups, Gaussians(**names))


def start(gaussians: Gaussians, config: OptimiseConfig) -> OptimiseState:
    """The state before the first step."""
    capacity = int(np.ceil(config.room * gaussians.count))
    gaussians, alive = with_capacity(gaussians, capacity)
    pull = jnp.zeros(capacity, gaussians.means.dtype)
    return OptimiseState(
        gaussians, alive, _transform(config).init(gaussians), pull, jnp.zeros((), jnp.int32)
    )


def draw_views(key: Array, count: int, dtype=jnp.float32) -> tuple[Array, Array]:
    """(B,) azimuths spread around, elevations uniform over the sphere's trained band [rad]."""
    first, second, third = jax.random.split(key, 3)
    turn = (jnp.arange(count, dtype=dtype) + jax.random.uniform(first, (count,), dtype)) / count
    azimuth = 2 * jnp.pi * (turn + jax.random.uniform(third, (), dtype))
    low, high = (math.sin(elevation) for elevation in views.ELEVATIONS)
    return azimuth, jnp.arcsin(jax.random.uniform(second, (count,), dtype, low, high))


def regularity(gaussians: Gaussians, alive: Array, config: OptimiseConfig) -> Array:
    """Mean penalty on large and needle-like Gaussians and on colours outside [0, 1]."""
    large = jax.nn.relu(gaussians.log_scales - math.log(config.largest)) ** 2
    needle = jnp.var(gaussians.log_scales, axis=1, keepdims=True)
    colour = dc_to_rgb(gaussians.harmonics[:, 0])
    outside = jax.nn.relu(colour - 1) ** 2 + jax.nn.relu(-colour) ** 2
    return jnp.mean(jnp.where(alive[:, None], large + 0.02 * needle + outside, 0))


@nnx.jit(static_argnames=("config", "capacity"))
def advance(
    guides: Guides, state: OptimiseState, key: Array, config: OptimiseConfig, capacity: int
) -> tuple[OptimiseState, Array]:
    """One step of distillation. Returns the next state and whether a picture overflowed."""
    key = jax.random.fold_in(key, state.step)
    view_key, ground_key, image_key, shape_key = jax.random.split(key, 4)
    dtype = state.gaussians.means.dtype
    azimuth, elevation = draw_views(view_key, config.views, dtype)
    ground = jax.random.uniform(ground_key, (config.views, 3), dtype)
    progress = state.step.astype(dtype) / max(config.steps, 1)

    def loss(gaussians: Gaussians) -> tuple[Array, Array]:
        def picture(view):
            turn, rise, floor = view
            image = view_picture(gaussians, turn, rise, floor, capacity, guides.image.resolution)
            return image.colour, image.overflow

        images, overflow = jax.lax.map(picture, (azimuth, elevation, ground))
        image = guides.image.distil(images, azimuth, elevation, image_key, config.image, progress)
        value = config.image_weight * image.value / image.clean[0].size

        def judged(gaussians: Gaussians) -> Array:
            # What is alive at the start is judged in 3D; what density control adds lies close by.
            means = gaussians.means[: config.count]
            colours = dc_to_rgb(gaussians.harmonics[: config.count, 0])
            shape = guides.shape.distil(means, colours, shape_key, config.shape, progress)
            return shape.value / (6 * config.count)

        asked = {stage.shape for stage in config.stages}
        if asked == {True, False}:
            answers = [lambda _, stage=stage: stage.shape for stage in config.stages]
            wanted = stepwise(answers, ends(config.stages, config.steps))(state.step)
            nothing = jnp.zeros_like(value)
            shape_value = jax.lax.cond(wanted, judged, lambda _: nothing, gaussians)
            value = value + config.shape_weight * shape_value
        elif asked == {True}:
            value = value + config.shape_weight * judged(gaussians)
        value = value + config.regular_weight * regularity(gaussians, state.alive, config)
        return value, overflow.any()

    gradient, overflow = jax.grad(loss, has_aux=True)(state.gaussians)
    gradient = jax.tree.map(
        lambda g: jnp.where(state.alive.reshape(-1, *(1,) * (g.ndim - 1)), g, 0), gradient
    )
    updates, optimiser = _transform(config).update(gradient, state.optimiser, state.gaussians)
    gaussians = optax.apply_updates(state.gaussians, updates)
    pull = state.pull + jnp.linalg.norm(gradient.means, axis=1)
    return state._replace(
        gaussians=gaussians, optimiser=optimiser, pull=pull, step=state.step + 1
    ), overflow


@partial(jax.jit, static_argnames="config")
def adapt(state: OptimiseState, key: Array, config: OptimiseConfig) -> OptimiseState:
    """Density control; gradients count relative to their mean, so that no unit enters."""
    mean = jnp.sum(state.pull) / jnp.maximum(jnp.sum(state.alive), 1)
    relative = state.pull / jnp.maximum(mean, jnp.finfo(mean.dtype).tiny)
    key = jax.random.fold_in(key, state.step)
    update = control_density(state.gaussians, state.alive, relative, key, config.density)
    return state._replace(
        gaussians=update.gaussians,
        alive=update.alive,
        optimiser=carry_moments(update, state.optimiser),
        pull=jnp.zeros_like(state.pull),
    )


def tighten(state: OptimiseState) -> OptimiseState:
    """Gaussians in the gaps between others, see `close_gaps`; not for use inside jit."""
    update = close_gaps(state.gaussians, state.alive)
    return state._replace(
        gaussians=update.gaussians,
        alive=update.alive,
        optimiser=carry_moments(update, state.optimiser),
    )


def optimise(
    guides: Guides,
    state: OptimiseState,
    key: Array,
    config: OptimiseConfig,
    *,
    progress: bool = False,
    on_step: Callable[[OptimiseState], None] | None = None,
) -> OptimiseState:
    """Steps from `state` to the end; `on_step` sees every new state, to save or show it."""
    capacity = room_for_pairs(state.gaussians, guides.image.resolution)
    bar = tqdm(
        total=config.steps,
        initial=int(state.step),
        desc="distil",
        disable=not progress,
        leave=False,
    )
    with bar:
        while int(state.step) < config.steps:
            following, overflow = advance(guides, state, key, config, capacity)
            if overflow:
                capacity = next_capacity(capacity + 1)
                continue
            state = following
            step = int(state.step)
            if config.density_every and step % config.density_every == 0 and step < config.steps:
                density = stage_at(config.stages, config.steps, step).density
                state = adapt(state, key, config) if density != "none" else state
                state = tighten(state) if density == "compact" else state
            if on_step is not None:
                on_step(state)
            bar.update()
    return state


def text_to_gaussians(
    prompt: str,
    *,
    seed: int = 0,
    progress: bool = False,
    config: OptimiseConfig = OptimiseConfig(),
    guides: Guides | None = None,
    resume: OptimiseState | None = None,
    on_step: Callable[[OptimiseState], None] | None = None,
) -> Gaussians:
    """Gaussians of what `prompt` describes: centred, z up, front +x, longest side about 1.

    Args:
        prompt: refined text, see `refine`; its first comma-separated part names the object.
        seed: the same seed gives the same Gaussians on the same device.
        progress: show a bar.
        config: see `OptimiseConfig`.
        guides: the priors, told the prompt; by default the bundled ones.
        resume: a state that `on_step` was given: go on from there.
        on_step: called with the state after each step.

    Raises:
        InputError: nothing to draw, or the bundled weights are missing or damaged.
    """
    if not prompt.strip():
        raise InputError("prompt is empty: say what to make, for example 'a strawberry'")
    if config.count < 1:
        raise InputError(f"count = {config.count}: needs at least one Gaussian")
    if guides is None:
        guides = Guides(bundled_image_guide(prompt), bundled_shape_guide(prompt))
    cloud_key, step_key = jax.random.split(jax.random.key(seed))
    if config.steps == 0:
        return surface_gaussians(guides, cloud_key, config)
    state = resume
    if state is None:
        state = start(initial_gaussians(guides, cloud_key, config), config)
    state = optimise(guides, state, step_key, config, progress=progress, on_step=on_step)
    return select(state.gaussians, np.flatnonzero(np.asarray(state.alive)))

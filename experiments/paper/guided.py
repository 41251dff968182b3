"""A material's stiffness by guidance: Adam on the loss of an image prior, through one substep.

The role of DreamPhysics (Huang et al. 2024), whose video prior judges films and whose gradient
goes through the last substep before each picture (`Truncated(1)`: what came before is taken as
given). Here the bundled image prior judges a few moments of the motion, each as a picture by
itself: it knows what the object looks like and nothing of how things move. So whatever stiffness
it finds is one that keeps the object looking like itself.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import optax
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.fitting.motion import motion_at, steps_for
from jaxphys.guidance import views
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.guides import ImageGuide
from jaxphys.guidance.optimise import OptimiseConfig, draw_views
from jaxphys.guidance.pictures import picture_settings
from jaxphys.mpm.loop.adjoint import Truncated
from jaxphys.mpm.simulation import Simulation
from jaxphys.pipeline.draw import draw, frame_splats
from jaxphys.render import Camera, look_at, next_capacity, required_pairs
from jaxphys.render.camera import position
from jaxphys.scene.look import Look

ONE_SUBSTEP = Truncated(1)
MOST_DOUBLED = 4  # times the steps that the bounds ask for: matter stiffens as it is pressed


@dataclass(frozen=True)
class Search:
    """Choices of `stiffness`.

    Attributes:
        steps: of Adam.
        rate: of Adam, on the logarithm of the modulus.
        moments: pictures a step, evenly spread over the motion, each from a view of its own.
        image: of the distillation.
    """

    steps: int = 30
    rate: float = 0.1
    moments: int = 4
    image: DistillationConfig = OptimiseConfig().image


def camera_at(points: Array, size: float, azimuth: Array, elevation: Array, side: int) -> Camera:
    """The camera of the prior's view [rad] around drawn points (K, 3) of something `size` long."""
    middle = jax.lax.stop_gradient(points.mean(axis=0))
    away = size * views.camera_position(azimuth, elevation, xp=jnp).astype(points.dtype)
    return look_at(
        middle + away, middle, field_of_view=views.FIELD_OF_VIEW, width=side, height=side
    )


@nnx.jit(static_argnames=("times", "steps", "capacity", "search", "size"))
def slope(
    logarithm: Array,
    simulation: Simulation,
    look: Look,
    guide: ImageGuide,
    key: Array,
    progress: Array,
    *,
    times: tuple[float, ...],
    steps: int,
    capacity: int,
    search: Search,
    size: float,
) -> tuple[Array, Array]:
    """The derivative of the guide's loss by log E, and the pairs that the pictures need."""
    view_key, ground_key, noise_key = jax.random.split(key, 3)
    dtype = logarithm.dtype
    azimuth, elevation = draw_views(view_key, len(times), dtype)
    ground = jax.random.uniform(ground_key, (len(times), 3), dtype)
    side = guide.resolution

    def loss(logarithm: Array) -> tuple[Array, Array]:
        changed = simulation.with_(youngs_modulus=jnp.exp(logarithm))
        motion = motion_at(changed, times, steps, adjoint=ONE_SUBSTEP)
        pictures, needed = [], []
        for moment in range(len(times)):
            frame = motion[moment]
            camera = camera_at(frame.carried()[0], size, azimuth[moment], elevation[moment], side)
            image = draw(
                look,
                frame,
                camera,
                background=ground[moment],
                settings=picture_settings(side),
                capacity=capacity,
            )
            pictures.append(image.colour)
            needed.append(image.required)
        images = jnp.stack(pictures)
        judged = guide.distil(images, azimuth, elevation, noise_key, search.image, progress)
        return judged.value, jnp.max(jnp.stack(needed))

    return jax.grad(loss, has_aux=True)(logarithm)


def stiffness(
    simulation: Simulation,
    look: Look,
    guide: ImageGuide,
    start: float,
    *,
    seconds: float,
    size: float,
    seed: int = 0,
    search: Search = Search(),
) -> list[float]:
    """Young's moduli [Pa] from `start` on, one more than steps; the last one is what is found.

    Args:
        simulation, look: from `scene.build`; the look's colours as the method draws them.
        guide: told what the object is.
        seconds: how long the motion is.
        size: longest side of the object [m].
        seed: of views, grounds and noise.

    Raises:
        InputError: a modulus allows no step of any use, or its motion failed.
    """
    adam = optax.adam(search.rate)
    value = jnp.asarray(np.log(start), simulation.model.mass.dtype)
    state, found = adam.init(value), [start]
    times = tuple(float(t) for t in np.linspace(0, seconds, search.moments + 1)[1:])
    rest = simulation.frame(simulation.state)
    side = guide.resolution
    camera = camera_at(rest.carried()[0], size, jnp.asarray(0.0), jnp.asarray(0.3), side)
    splats = frame_splats(look, rest, position(camera))
    capacity = next_capacity(2 * int(required_pairs(splats, camera, picture_settings(side))))
    steps = 0
    for step in range(search.steps):
        fewest = steps_for(simulation.with_(youngs_modulus=found[-1]), times[0])
        steps = max(steps, fewest)
        key = jax.random.fold_in(jax.random.key(seed), step)
        given = value, simulation, look, guide, key, jnp.asarray(step / search.steps)
        ask = partial(slope, *given, times=times, search=search, size=size)
        gradient, needed = ask(steps=steps, capacity=capacity)
        while not np.isfinite(gradient) and 2 * steps <= MOST_DOUBLED * fewest:
            steps *= 2
            gradient, needed = ask(steps=steps, capacity=capacity)
        if int(needed) > capacity:
            capacity = next_capacity(int(needed))
            gradient, needed = ask(steps=steps, capacity=capacity)
        if not np.isfinite(gradient):
            raise InputError(
                f"guidance: the motion at a modulus of {found[-1]:.4g} Pa failed with {steps} steps"
                f" between moments; start from another one, or on a coarser grid"
            )
        change, state = adam.update(gradient, state)
        value = value + change
        found.append(float(np.exp(value)))
    return found

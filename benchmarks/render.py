"""Suite 'render': value, and value and gradient, of one large and many small pictures.

`ball` is the picture that the cost of rasterisation is quoted for: 100,000 splats on a ball a third
of a 1958 x 1090 image wide, some 445,000 pairs of splat and 16 x 16 tile. `thumbnail` is what score
distillation renders at every step: a few thousand splats at 64 x 64, from several cameras.
"""

import math
import time
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.case import Case, Prepared
from jaxphys.core.splats import Splats
from jaxphys.render import (
    Camera,
    Settings,
    look_at,
    next_capacity,
    orbit,
    render,
    required_pairs,
)

WIDTH, HEIGHT = 1958, 1090


def ball_splats(count: int = 100_000, radius: float = 0.5, seed: int = 0) -> Splats:
    """Flat splats tangent to a sphere of `radius` [m], coloured by direction, float32."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Discs with a scatter of sizes, a tenth as thick as wide; about 2.5 pixels in the benchmark.
    width = 0.0106 * radius * math.sqrt(100_000 / count) * np.exp(rng.normal(size=count) * 0.3)
    outer = normals[:, :, None] * normals[:, None, :]
    covariances = width[:, None, None] ** 2 * (np.eye(3) - 0.99 * outer)
    return Splats(
        jnp.asarray(radius * normals, jnp.float32),
        jnp.asarray(covariances, jnp.float32),
        jnp.asarray(rng.uniform(0.2, 1.0, size=count), jnp.float32),
        jnp.asarray(0.5 + 0.5 * normals, jnp.float32),
    )


def ball_camera(width: int = WIDTH, height: int = HEIGHT) -> Camera:
    """A camera that sees a ball of radius 0.5 m about the origin a third of the image wide."""
    distance = 3.0
    half = 0.5 / math.sqrt(distance**2 - 0.5**2)
    view = 2 * math.atan(3 * half)
    return look_at(
        (distance, 0.0, 0.0), (0.0, 0.0, 0.0), field_of_view=view, width=width, height=height
    )


def thumbnail_cameras(count: int = 4, size: int = 64) -> Camera:
    """Cameras around the ball, their arrays stacked, for `jax.lax.map`."""
    cameras = [
        orbit((0, 0, 0), 2.0, 2 * math.pi * k / count, 0.3, width=size, height=size)
        for k in range(count)
    ]
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *cameras)


def picture(settings: Settings, capacity: int):
    """A jitted function of (splats, camera) that renders."""
    return jax.jit(lambda s, c: render(s, c, settings=settings, capacity=capacity))


def picture_gradient(settings: Settings, capacity: int):
    """A jitted function of (splats, camera): value and gradient of the mean square of a picture."""

    def loss(splats, camera):
        return jnp.mean(render(splats, camera, settings=settings, capacity=capacity).colour ** 2)

    return jax.jit(jax.value_and_grad(loss))


def thumbnails_gradient(settings: Settings, capacity: int):
    """The same for the mean over stacked cameras, drawn one after another."""

    def loss(splats, cameras):
        def one(camera):
            image = render(splats, camera, settings=settings, capacity=capacity)
            return jnp.mean(image.colour**2)

        return jnp.mean(jax.lax.map(one, cameras))

    return jax.jit(jax.value_and_grad(loss))


def prepare(program, splats: Splats, camera: Camera, counted: Camera) -> Prepared:
    """Compiles `program(settings, capacity)` with room for what the camera `counted` needs."""
    settings = Settings()
    required = int(required_pairs(splats, counted, settings))
    run = program(settings, next_capacity(required))
    start = time.perf_counter()
    run.lower(splats, camera).compile()
    seconds = time.perf_counter() - start
    return Prepared(
        lambda: jax.block_until_ready(run(splats, camera)),
        work=1.0,
        compile_seconds=seconds,
        extra={"pairs": required},
    )


def prepare_ball(program, count: int, width: int, height: int) -> Prepared:
    """One picture of the ball."""
    camera = ball_camera(width, height)
    return prepare(program, ball_splats(count), camera, camera)


def prepare_thumbnails(count: int) -> Prepared:
    """Value and gradient over four 64 x 64 pictures."""
    closest = orbit((0, 0, 0), 1.9, 0.0, 0.3, width=64, height=64)
    return prepare(thumbnails_gradient, ball_splats(count), thumbnail_cameras(), closest)


def cases(quick: bool) -> list[Case]:
    """Forward and gradient of the large picture; gradient of four thumbnails."""
    count, width, height = (5_000, 320, 180) if quick else (100_000, WIDTH, HEIGHT)
    size = {"splats": count, "width": width, "height": height}
    ball = partial(prepare_ball, count=count, width=width, height=height)
    return [
        Case("forward", "jaxphys", partial(ball, picture), size),
        Case("value-and-gradient", "jaxphys", partial(ball, picture_gradient), size),
        Case("thumbnails", "jaxphys", partial(prepare_thumbnails, 4_000), {"splats": 4_000}),
    ]

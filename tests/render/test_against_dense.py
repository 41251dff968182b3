"""Tiles against the dense reference: values in both precisions, gradients of everything."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.render import Settings, render

from .reference import render_dense
from .scenes import cast, random_splats, test_camera

BACKGROUND = jnp.array([0.1, 0.5, 0.9])
CONVENTIONS = {
    "default": Settings(),
    "gsplat": Settings.gsplat(tile_size=16),
    "inria": Settings.inria(),
    "antialias": Settings(antialias=True, chunk_size=3, group_size=5),
}


@pytest.fixture(scope="module")
def scene():
    return random_splats(120), test_camera()


def parts(image):
    return image[:3]


@pytest.mark.parametrize("name", CONVENTIONS)
def test_values(scene, name):
    splats, camera = scene
    settings = CONVENTIONS[name]
    expected = render_dense(splats, camera, BACKGROUND, settings)
    # Both precisions share every line of code: one convention in both is enough.
    precisions = ((jnp.float64, 1e-12), (jnp.float32, 2e-5))
    for dtype, tolerance in precisions if name == "default" else precisions[1:]:
        image = render(
            cast(splats, dtype),
            cast(camera, dtype),
            background=BACKGROUND.astype(dtype),
            settings=settings,
        )
        for got, want in zip(parts(image), expected, strict=True):
            assert got.dtype == dtype
            np.testing.assert_allclose(got, want, atol=tolerance, rtol=0)


@pytest.mark.parametrize("name", ["default", "antialias"])
def test_gradients(scene, name):
    splats, camera = scene
    settings = CONVENTIONS[name]
    shapes = ((camera.height, camera.width, 3),) + 2 * ((camera.height, camera.width),)
    weights = [np.random.default_rng(k).normal(size=s) for k, s in enumerate(shapes)]

    def total(images):
        return sum(jnp.sum(a * w) for a, w in zip(images, weights, strict=True))

    def own(splats, camera, background):
        return total(parts(render(splats, camera, background=background, settings=settings)))

    def dense(splats, camera, background):
        return total(render_dense(splats, camera, background, settings))

    inputs = (splats, camera, BACKGROUND)
    expected = jax.jit(jax.grad(dense, argnums=(0, 1, 2)))(*inputs)
    for dtype, tolerance in ((jnp.float64, 1e-10), (jnp.float32, 1e-4)):
        got = jax.grad(own, argnums=(0, 1, 2))(*cast(inputs, dtype))
        for a, b in zip(jax.tree.leaves(got), jax.tree.leaves(expected), strict=True):
            assert a.dtype == dtype
            np.testing.assert_allclose(a, b, atol=tolerance * np.abs(b).max(), rtol=0)


def test_reference_sees_a_wrong_convention(scene):
    # The comparison has teeth: another low-pass, clamp or extent is far outside the tolerance.
    splats, camera = scene
    splats = splats._replace(opacities=jnp.full_like(splats.opacities, 0.99))
    expected = render_dense(splats, camera, BACKGROUND, Settings())[0]
    for wrong in (
        replace(Settings(), low_pass=0.1),
        replace(Settings(), alpha_max=0.9),
        replace(Settings(), extent="three_sigma"),
    ):
        got = render(splats, camera, background=BACKGROUND, settings=wrong).colour
        assert np.abs(got - expected).max() > 1e-3

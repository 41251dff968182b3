"""Splats that would break a careless renderer give finite pictures and gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.splats import Splats
from jaxphys.render import Settings, position, render, usable

from .scenes import cast, random_splats, test_camera


@pytest.fixture(scope="module")
def gradient():
    def loss(splats, camera, background):
        image = render(splats, camera, background=background, capacity=4096)
        return jnp.sum(image.colour**2) + jnp.sum(image.depth) + jnp.sum(image.alpha), image

    return jax.jit(jax.value_and_grad(loss, argnums=(0, 1, 2), has_aux=True))


def spoil(splats, camera):
    """Forty splats, every one of them hard in its own way, some of them past drawing."""
    eye = position(camera)
    means, covariances, opacities, colours = splats
    means = means.at[0].set(jnp.nan).at[1, 0].set(jnp.inf).at[2].set(eye)
    means = means.at[3].set(eye + (eye - means[3])).at[4].set(1e11).at[5].set(1e30)
    # Just beyond the near plane, one coincident pair, one in the plane of the camera.
    forward = camera.rotation[2]
    means = means.at[6].set(eye + 0.0101 * forward).at[7].set(means[8])
    means = means.at[9].set(eye + camera.rotation[0])
    covariances = (
        covariances.at[10].set(0).at[11].set(1e11 * jnp.eye(3, dtype=means.dtype)).at[12].set(1e35)
    )
    covariances = (
        covariances.at[13, 0, 1].set(jnp.nan).at[14].set(-0.01 * jnp.eye(3, dtype=means.dtype))
    )
    covariances = covariances.at[15].set(jnp.diag(jnp.array([1e6, 1e-12, 0.0], means.dtype)))
    covariances = covariances.at[16, 0, 1].set(100.0)
    opacities = opacities.at[17].set(0).at[18].set(1).at[19].set(jnp.nan).at[20].set(-1)
    opacities = opacities.at[21].set(1 / 255).at[22].set(50.0)
    colours = colours.at[23].set(jnp.nan).at[24].set(jnp.inf)
    return Splats(means, covariances, opacities, colours)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_finite(gradient, dtype):
    camera = test_camera(dtype=dtype)
    splats = spoil(cast(random_splats(40, seed=1), dtype), camera)
    background = jnp.zeros(3, dtype)
    (_, image), grads = gradient(splats, camera, background)
    for leaf in jax.tree.leaves((image, grads)):
        assert np.isfinite(np.asarray(leaf, float)).all()
    assert not bool(image.overflow)
    assert image.alpha.min() >= 0 and image.alpha.max() <= 1 + 1e-6
    broken = np.asarray(~usable(splats))
    assert set(np.flatnonzero(broken)) == {0, 1, 5, 12, 13, 19, 23, 24}
    for leaf in grads[0]:
        assert (np.asarray(leaf)[broken] == 0).all()
    # Leaving out the broken ones changes nothing.
    healthy = jax.tree.map(lambda leaf: leaf[~broken], splats)
    clean = render(healthy, camera, background=background, capacity=4096)
    np.testing.assert_allclose(clean.colour, image.colour, atol=1e-6)


def test_inside_the_object(gradient):
    camera = test_camera(eye=(0.05, 0.02, 0.03), dtype=jnp.float32)
    splats = cast(random_splats(60, seed=2), jnp.float32)
    (_, image), grads = gradient(splats, camera, jnp.zeros(3, jnp.float32))
    for leaf in jax.tree.leaves((image, grads)):
        assert np.isfinite(np.asarray(leaf, float)).all()
    assert not bool(image.overflow) and image.alpha.max() > 0.5


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_splats(count):
    camera = test_camera()
    splats = jax.tree.map(lambda leaf: leaf[:count], random_splats(2, opacity=(0.9, 1.0)))
    background = jnp.full((camera.height, camera.width, 3), 0.25)

    def loss(splats, background):
        return jnp.sum(render(splats, camera, background=background).colour)

    image = render(splats, camera, background=background)
    assert image.colour.shape == (camera.height, camera.width, 3)
    np.testing.assert_allclose(image.colour[0, 0], 0.25)
    assert (image.alpha.max() > 0.5) == (count == 1)
    for leaf in jax.tree.leaves(jax.grad(loss, argnums=(0, 1))(splats, background)):
        assert np.isfinite(np.asarray(leaf)).all()


def test_central_differences():
    # Away from the skip and the stop: opacities below the clamp, few and wide splats.
    camera = test_camera(width=24, height=20)
    splats = random_splats(6, seed=5, size=0.3, opacity=(0.3, 0.6))
    settings = Settings(alpha_min=1e-9)
    rng = np.random.default_rng(0)
    weight = jnp.array(rng.normal(size=(20, 24, 3)))

    @jax.jit
    def loss(splats, camera):
        image = render(splats, camera, settings=settings, capacity=256)
        return jnp.sum(image.colour * weight) + jnp.sum(image.depth * weight[..., 0])

    inputs = (splats, camera)
    grads = jax.jit(jax.grad(loss, argnums=(0, 1)))(*inputs)
    leaves, structure = jax.tree.flatten(inputs)
    directions = [jnp.array(rng.normal(size=leaf.shape)) for leaf in leaves]
    step = 1e-6
    for k in range(len(leaves)):
        # Symmetric directions only: the antisymmetric part of a covariance does not count.
        move = directions[k]
        if leaves[k].ndim == 3:
            move = 0.1 * (move + jnp.swapaxes(move, 1, 2))
        ends = [
            loss(
                *jax.tree.unflatten(
                    structure, [*leaves[:k], leaves[k] + s * move, *leaves[k + 1 :]]
                )
            )
            for s in (step, -step)
        ]
        slope = (ends[0] - ends[1]) / (2 * step)
        expected = jnp.sum(jax.tree.leaves(grads)[k] * move)
        np.testing.assert_allclose(slope, expected, rtol=1e-5, atol=1e-5)

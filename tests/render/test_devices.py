"""Pictures over devices: rows of tiles of one, several side by side, and several under vmap."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.ensemble import over_devices
from jaxphys.core.errors import InputError
from jaxphys.render import Settings, render, required_pairs

from .scenes import random_splats, test_camera

CAPACITY = 2048
# Five rows of tiles: no number of devices but one divides them.
SMALL = Settings()


@pytest.fixture(scope="module")
def scene():
    return random_splats(60, seed=2), test_camera()


def weights(camera, seed=0):
    return jnp.asarray(np.random.default_rng(seed).normal(size=(camera.height, camera.width, 4)))


def value_and_gradient(settings, capacity=CAPACITY):
    """A jitted function of (splats, camera): a picture, and the slope of a sum of all its pixels
    by everything.
    """

    def loss(splats, camera):
        image = render(splats, camera, settings=settings, capacity=capacity)
        weight = weights(camera)
        value = jnp.sum(image.colour * weight[..., :3]) + jnp.sum(image.depth * weight[..., 3])
        return value, image

    return jax.jit(jax.value_and_grad(loss, argnums=(0, 1), has_aux=True))


@pytest.fixture(scope="module")
def alone(scene):
    return value_and_gradient(SMALL)(*scene)


@pytest.mark.parametrize("devices", [2, 4])
def test_devices_share_a_picture(scene, alone, devices):
    settings = replace(SMALL, devices=devices)
    program = value_and_gradient(settings)
    found = program(*scene)
    (value, image), slope = found
    (expected, picture), gradient = alone
    np.testing.assert_allclose(value, expected, rtol=1e-12)
    for one, other in zip(image[:3], picture[:3], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)
    for one, other in zip(jax.tree.leaves(slope), jax.tree.leaves(gradient), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())
    again = program(*scene)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(again), strict=True):
        assert np.asarray(one).tobytes() == np.asarray(other).tobytes()


def test_room_is_counted_for_the_one_that_needs_most(scene):
    splats, camera = scene
    settings = replace(SMALL, devices=2)
    needed = int(required_pairs(splats, camera, settings))
    assert needed >= int(required_pairs(splats, camera, SMALL))
    image = render(splats, camera, settings=settings, capacity=needed)
    assert int(image.required) == needed and not image.overflow
    assert render(splats, camera, settings=settings, capacity=needed - 2).overflow


def test_more_devices_than_there_are(scene):
    with pytest.raises(InputError, match="99 devices"):
        render(*scene, settings=replace(SMALL, devices=99), capacity=CAPACITY)


@pytest.fixture(scope="module")
def cameras():
    eyes = [(1.2, -1.5, 0.8), (-1.0, -1.6, 0.4), (0.2, 1.9, 0.3)]
    views = [test_camera(eye=eye) for eye in eyes]
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *views)


def seen(splats, cameras, mapped):
    """Weighted sum of the pictures from several cameras, drawn by `mapped`."""

    def draw(camera):
        return render(splats, camera, settings=SMALL, capacity=CAPACITY).colour

    pictures = mapped(draw)(cameras)
    return jnp.sum(pictures * weights(test_camera(), 1)[..., :3])


MAPPED = {
    "over devices": lambda draw: over_devices(draw, 2, in_turn=True),
    "in lockstep": jax.vmap,
}


@pytest.mark.parametrize("name", MAPPED)
def test_several_cameras_with_gradient(scene, cameras, name):
    splats, _ = scene

    def of(mapped):
        return jax.jit(jax.value_and_grad(lambda *x: seen(*x, mapped), argnums=(0, 1)))

    value, slope = of(MAPPED[name])(splats, cameras)
    expected, gradient = of(lambda draw: lambda x: jax.lax.map(draw, x))(splats, cameras)
    np.testing.assert_allclose(value, expected, rtol=1e-12)
    for one, other in zip(jax.tree.leaves(slope), jax.tree.leaves(gradient), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())
        assert np.abs(other).max() > 0


def test_several_splats_under_vmap_with_gradient(scene, alone):
    splats, camera = scene
    # One as it is, one moved, one behind the camera.
    shifts = jnp.array([0.0, 0.4, 50.0])

    def moved(shift):
        return splats._replace(means=splats.means + shift)

    def value(shift):
        image = render(moved(shift), camera, settings=SMALL, capacity=CAPACITY)
        return jnp.sum(image.colour * weights(camera)[..., :3]), image.required

    many = jax.jit(jax.vmap(jax.value_and_grad(value, has_aux=True)))
    (values, required), slopes = many(shifts)
    one = jax.jit(jax.value_and_grad(value, has_aux=True))
    for k, shift in enumerate(shifts):
        (expected, needed), slope = one(shift)
        np.testing.assert_allclose(values[k], expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(slopes[k], slope, rtol=1e-9, atol=1e-9)
        assert int(required[k]) == int(needed)
    assert required[0] != required[1] and required[2] == 0 < required[1]

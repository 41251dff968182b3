import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import axis_angle_to_matrix, quaternion_to_matrix
from jaxphys.gaussians import ColourRange, Gaussians, covariances, to_splats, transform
from jaxphys.pipeline.deform import Similarity, bake, deform, to_solver, to_world

CAMERA = jnp.array([3.0, -2.0, 1.0])


def random_gaussians(count=12, degree=3, dtype=jnp.float64, seed=0):
    k = jax.random.split(jax.random.key(seed), 5)
    return Gaussians(
        jax.random.normal(k[0], (count, 3), dtype),
        jax.random.normal(k[1], (count, 3), dtype) - 2,
        jax.random.normal(k[2], (count, 4), dtype),
        jax.random.normal(k[3], (count,), dtype),
        0.3 * jax.random.normal(k[4], (count, (degree + 1) ** 2, 3), dtype),
    )


def motion(count, dtype=jnp.float64, seed=5):
    k = jax.random.split(jax.random.key(seed), 3)
    turn = quaternion_to_matrix(jax.random.normal(k[0], (count, 4), dtype))
    F = turn @ (jnp.eye(3, dtype=dtype) + 0.3 * jax.random.normal(k[1], (count, 3, 3), dtype))
    return jax.random.normal(k[2], (count, 3), dtype), F


def rotation(angle=0.7):
    return axis_angle_to_matrix(jnp.array([1.0, 2.0, -1.0]), jnp.asarray(angle))


def assert_same(a, b, **tolerance):
    for x, y in zip(a, b, strict=True):
        np.testing.assert_allclose(x, y, **tolerance)


def test_rest_is_the_undeformed_picture():
    g = random_gaussians()
    F = jnp.broadcast_to(jnp.eye(3), (g.count, 3, 3))
    assert_same(deform(g, g.means, F, CAMERA), to_splats(g, CAMERA), atol=1e-12)


def test_covariance_is_pushed_forward():
    g = random_gaussians()
    x, F = motion(g.count)
    s = deform(g, x, F, CAMERA)
    np.testing.assert_array_equal(s.means, x)
    np.testing.assert_allclose(s.covariances, F @ covariances(g) @ jnp.swapaxes(F, 1, 2), rtol=1e-9)
    np.testing.assert_array_equal(s.covariances, jnp.swapaxes(s.covariances, 1, 2))


def test_rigid_motion_is_the_rigidly_moved_object():
    g, R, t = random_gaussians(), rotation(), jnp.array([0.3, -1.0, 2.0])
    moved = transform(g, R, 1.0, t)
    F = jnp.broadcast_to(R, (g.count, 3, 3))
    s = deform(g, moved.means, F, CAMERA)
    assert_same(s, to_splats(moved, CAMERA), atol=1e-11)
    # Stretch that comes with the rotation does not change where colours are looked up.
    stretched = deform(g, moved.means, F @ jnp.diag(jnp.array([1.0, 2.0, 0.5])), CAMERA)
    np.testing.assert_allclose(stretched.colours, s.colours, atol=1e-11)


@pytest.mark.parametrize("dtype,tolerance", [(jnp.float64, 1e-10), (jnp.float32, 5e-5)])
def test_baked_gaussians_draw_the_same(dtype, tolerance):
    g = random_gaussians(dtype=dtype)
    x, F = motion(g.count, dtype)
    F = F.at[::3].multiply(-1)  # inverted ones as well
    baked = bake(g, x, F)
    assert all(leaf.dtype == dtype for leaf in jax.tree.leaves(baked))
    for camera in (CAMERA, jnp.array([-1.0, 4.0, 0.5])):
        camera = camera.astype(dtype)
        a, b = deform(g, x, F, camera), to_splats(baked, camera)
        assert_same(b, a, rtol=tolerance, atol=tolerance)


def test_baking_keeps_a_disc_thin():
    g = random_gaussians(6, dtype=jnp.float32)
    g = dataclasses.replace(g, log_scales=jnp.log(jnp.array([[1, 1, 1e-4]] * 6, jnp.float32)))
    R = rotation().astype(jnp.float32)
    baked = bake(g, g.means, jnp.broadcast_to(R, (6, 3, 3)))
    thinnest = np.exp(np.min(baked.log_scales, axis=1))
    np.testing.assert_allclose(thinnest, 1e-4, rtol=0.02)


def test_solver_frame_is_undone():
    g = random_gaussians()
    x, F = motion(g.count)
    frame = Similarity(rotation(1.1), jnp.asarray(0.4), jnp.array([1.0, 1.0, 1.0]))
    Q = frame.rotation
    inside = to_solver(frame, x)
    F_inside = Q @ F @ Q.T
    back = to_world(frame, inside, F_inside)
    assert_same(back, (x, F), atol=1e-12)
    expected = deform(g, x, F, CAMERA)
    assert_same(deform(g, inside, F_inside, CAMERA, similarity=frame), expected, atol=1e-10)
    baked = bake(g, inside, F_inside, similarity=frame)
    assert_same(to_splats(baked, CAMERA), expected, atol=1e-9)
    # Mapping back positions but not rotations, as the PhysGaussian code does, shows in colours.
    wrong = deform(g, x, F_inside, CAMERA)
    assert jnp.abs(wrong.colours - expected.colours).max() > 0.05


@pytest.mark.parametrize("count", [11, 17])
def test_every_gaussian_has_a_particle_and_no_particle_more(count):
    g = random_gaussians()
    x, F = motion(count)
    with pytest.raises(InputError, match=f"12 Gaussians on positions \\({count}, 3\\)"):
        deform(g, x, F, CAMERA)
    with pytest.raises(InputError, match="one of each for every Gaussian"):
        bake(g, g.means, F)


def test_colours_are_regularised_by_the_given_range():
    g = random_gaussians()
    x, F = motion(g.count)
    bounds = ColourRange(jnp.asarray(0.2), jnp.asarray(0.9))
    plain, regular = (deform(g, x, F, CAMERA, colours=c) for c in (None, bounds))
    np.testing.assert_allclose(
        regular.colours, np.clip((plain.colours - 0.2) / 0.7, 0, 1), atol=1e-12
    )


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1, 0), (0, 0, 0), (1e3, 1, 1e-3), (1, 1, -1)])
def test_degenerate_deformation_is_finite(dtype, stretch):
    g = random_gaussians(2, dtype=dtype)
    F = jnp.broadcast_to(jnp.diag(jnp.array(stretch, dtype)), (2, 3, 3))

    def total(g, x, F):
        return sum(jnp.sum(part) for part in deform(g, x, F, CAMERA.astype(dtype)))

    value, gradient = jax.jit(jax.value_and_grad(total, argnums=(0, 1, 2)))(g, g.means, F)
    assert jnp.isfinite(value)
    assert all(bool(jnp.isfinite(leaf).all()) for leaf in jax.tree.leaves(gradient))
    assert all(bool(jnp.isfinite(leaf).all()) for leaf in jax.tree.leaves(bake(g, g.means, F)))


def test_gradient_of_deform():
    g = random_gaussians(3)
    _, F = motion(3, seed=8)
    check_grads(lambda x, F: deform(g, x, F, CAMERA), (g.means, F), order=1, modes=["rev"])
    rest = jnp.broadcast_to(jnp.eye(3), (3, 3, 3))  # repeated singular values
    check_grads(lambda F: deform(g, g.means, F, CAMERA), (rest,), order=1, modes=["rev"])


def test_constant_colours_need_no_rotation():
    shapes = (jnp.zeros((4, 3)), jnp.zeros((4, 3, 3)), CAMERA)
    plain = str(jax.make_jaxpr(deform)(random_gaussians(4, 0), *shapes))
    turned = str(jax.make_jaxpr(deform)(random_gaussians(4, 1), *shapes))
    assert plain.count(" = ") < 0.5 * turned.count(" = ")

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxphys.core import rotations
from jaxphys.core.rotations import (
    quaternion_product,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)


def quaternions(dtype, count=200):
    q = np.random.default_rng(5).normal(size=(count, 4)).astype(dtype)
    return q / np.linalg.norm(q, axis=1, keepdims=True)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_matrices_agree_with_scipy(dtype):
    q = quaternions(dtype)
    expected = Rotation.from_quat(q[:, [1, 2, 3, 0]]).as_matrix()
    got = rotations.quaternion_to_matrix(q)
    assert got.dtype == dtype
    np.testing.assert_allclose(got, expected, atol=3e-6 if dtype == np.float32 else 1e-14)
    np.testing.assert_allclose(rotations.quaternion_to_matrix(7 * q), got, atol=3e-6)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_round_trip_up_to_sign(dtype):
    q = quaternions(dtype)
    q[:3] = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]  # half turns, where w = 0
    back = np.asarray(rotations.matrix_to_quaternion(rotations.quaternion_to_matrix(q)))
    assert (back[:, 0] >= 0).all()
    alignment = np.abs(np.sum(back * q, axis=1))
    np.testing.assert_allclose(alignment, 1, atol=1e-5 if dtype == np.float32 else 1e-13)


def test_a_zero_quaternion_is_the_identity_with_zero_gradient():
    zero = jnp.zeros((1, 4))
    np.testing.assert_array_equal(rotations.quaternion_to_matrix(zero)[0], np.eye(3))
    gradient = jax.grad(lambda q: rotations.quaternion_to_matrix(q).sum())(zero)
    np.testing.assert_array_equal(gradient, 0)


def test_axis_angle_turns_by_the_right_hand_rule():
    R = rotations.axis_angle_to_matrix(jnp.array([0.0, 0.0, 2.0]), jnp.pi / 2)
    np.testing.assert_allclose(R @ jnp.array([1.0, 0, 0]), [0, 1, 0], atol=1e-15)
    axis = np.array([1.0, -2.0, 0.5])
    expected = Rotation.from_rotvec(0.7 * axis / np.linalg.norm(axis)).as_matrix()
    np.testing.assert_allclose(
        rotations.axis_angle_to_matrix(jnp.asarray(axis), 0.7), expected, atol=1e-14
    )


def test_rotation_vectors_and_products_agree_with_scipy():
    random = np.random.default_rng(5)
    vectors = random.normal(size=(6, 3)) * np.array([1, 1e-3, 1e-5, 1e-9, 0, 2.0])[:, None]
    vectors[5] *= 3.1 / np.linalg.norm(vectors[5])
    rotations = Rotation.from_rotvec(vectors)
    ours = rotation_vector_to_quaternion(jnp.asarray(vectors))
    theirs = np.roll(rotations.as_quat(), 1, axis=1)
    theirs *= np.sign(theirs[:, :1])
    np.testing.assert_allclose(ours, theirs, atol=1e-15)
    np.testing.assert_allclose(quaternion_to_rotation_vector(-ours), vectors, atol=1e-14)
    product = quaternion_product(ours[:3], ours[3:])
    expected = (rotations[:3] * rotations[3:]).as_rotvec()
    np.testing.assert_allclose(quaternion_to_rotation_vector(product), expected, atol=1e-14)


def test_rotation_vectors_have_derivatives_at_rest():
    there = jax.jacfwd(rotation_vector_to_quaternion)(jnp.zeros(3))
    np.testing.assert_allclose(there, np.concatenate([np.zeros((1, 3)), 0.5 * np.eye(3)]))
    back = jax.jacrev(quaternion_to_rotation_vector)(jnp.array([1.0, 0, 0, 0]))
    np.testing.assert_allclose(back, np.concatenate([np.zeros((3, 1)), 2 * np.eye(3)], 1))

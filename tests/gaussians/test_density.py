from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.density import (
    DensityConfig,
    carry_moments,
    control_density,
    lower_opacity,
    with_capacity,
)
from jaxphys.gaussians.gaussians import from_points, opacities, scales

CONFIG = DensityConfig(gradient_threshold=1.0, split_size=0.5, least_opacity=0.05)
control = jax.jit(partial(control_density, config=CONFIG))


def scene(capacity=8):
    points = np.arange(12.0).reshape(4, 3)
    sizes = np.array([0.1, 0.1, 1.0, 0.1])  # the third is large
    opacity = np.array([0.8, 0.8, 0.8, 0.01])  # the fourth is faint
    return with_capacity(from_points(points, np.eye(4, 3), sizes, opacity=opacity), capacity)


def test_clone_split_and_prune():
    g, alive = scene()
    gradients = jnp.array([0.0, 2.0, 3.0, 9.0, 9.0, 0, 0, 0])
    update = control(g, alive, gradients, jax.random.key(0))
    # 3 is pruned first, and its slot is the first free one: it gets the half of 2.
    assert update.alive.tolist() == [True] * 5 + [False] * 3
    assert update.source.tolist() == [0, 1, 2, 2, 1, 5, 6, 7]
    assert update.fresh.tolist() == [False, False, True, True, True, True, True, True]
    assert int(update.unserved) == 0
    new = update.gaussians
    np.testing.assert_array_equal(new.means[jnp.array([0, 1, 4])], g.means[jnp.array([0, 1, 1])])
    np.testing.assert_array_equal(new.harmonics[3], g.harmonics[2])
    np.testing.assert_allclose(scales(new)[2:4], 1 / 1.6, rtol=1e-12)
    assert 0 < jnp.abs(new.means[2] - new.means[3]).max() < 8
    # Original and clone together cover as the original did.
    covered = 1 - (1 - opacities(new)[1]) * (1 - opacities(new)[4])
    np.testing.assert_allclose(covered, 0.8, rtol=1e-12)
    np.testing.assert_allclose(opacities(new)[2:4], 0.8, rtol=1e-12)
    assert opacities(new)[5:].max() < 1e-6


def test_too_little_room_is_reported_and_the_neediest_served():
    g, alive = scene(capacity=4)
    update = control(g, alive, jnp.array([4.0, 2.0, 3.0, 0.0]), jax.random.key(0))
    assert update.alive.all() and int(update.unserved) == 2
    assert update.source.tolist() == [0, 1, 2, 0]


def test_nothing_to_do_is_the_identity():
    g, alive = scene()
    bright, _ = with_capacity(from_points(np.zeros((4, 3)), np.eye(4, 3), 0.1), 8)
    update = control(bright, alive, jnp.zeros(8), jax.random.key(0))
    for a, b in zip(jax.tree.leaves(bright), jax.tree.leaves(update.gaussians), strict=True):
        np.testing.assert_array_equal(a, b)
    assert update.alive.tolist() == alive.tolist()
    oversized = DensityConfig(1.0, 0.5, largest_size=0.5)
    pruned = control_density(g, alive, jnp.zeros(8), jax.random.key(0), oversized)
    assert pruned.alive.tolist() == [True, True, False, True] + [False] * 4


def test_halves_are_drawn_from_the_original():
    points, sizes = np.zeros((2000, 3)), np.broadcast_to([2.0, 1.0, 0.6], (2000, 3))
    g, alive = with_capacity(from_points(points, np.ones(3), sizes, degree=1), 4000)
    update = control(g, alive, jnp.full(4000, 2.0), jax.random.key(3))
    assert update.alive.all()
    np.testing.assert_allclose(update.gaussians.means.std(axis=0), [2, 1, 0.6], rtol=0.06)


def test_moments_follow_their_gaussians():
    g, alive = scene()
    adam = optax.adam(1e-2)
    state = adam.init(g)
    filled = jax.tree.map(
        lambda leaf: (
            leaf + jnp.arange(1, 9).reshape((8,) + (1,) * (leaf.ndim - 1))
            if leaf.ndim
            else leaf + 7
        ),
        state,
    )
    update = control(g, alive, jnp.array([0.0, 2.0, 3.0, 0, 0, 0, 0, 0]), jax.random.key(0))
    carried = carry_moments(update, filled)
    assert jax.tree.structure(carried) == jax.tree.structure(state)
    assert int(carried[0].count) == 7
    np.testing.assert_array_equal(carried[0].mu.opacity_logits, [1, 2, 0, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(carried[0].nu.means[:, 0], [1, 2, 0, 0, 0, 0, 0, 0])
    adam.update(g, carried, update.gaussians)


def test_same_key_same_result_and_capacity_is_checked():
    g, alive = scene()
    gradients = jnp.full(8, 5.0)
    a, b = (control(g, alive, gradients, jax.random.key(k)) for k in (1, 1))
    np.testing.assert_array_equal(a.gaussians.means, b.gaussians.means)
    with pytest.raises(InputError, match="capacity of 3"):
        with_capacity(g, 3)


def test_opacity_is_lowered_only_where_above():
    g, _ = scene()
    lowered = opacities(lower_opacity(g, 0.02))
    np.testing.assert_allclose(lowered[:4], [0.02, 0.02, 0.02, 0.01], rtol=1e-9)

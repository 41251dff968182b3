"""What must not change the picture: order, motion of the world, tiles, capacity."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import axis_angle_to_matrix
from jaxphys.core.splats import Splats
from jaxphys.render import Camera, Settings, next_capacity, project, render, required_pairs
from jaxphys.render.binning import make_grid, tile_boxes, tile_lists

from .scenes import cast, random_splats, test_camera

CAPACITY = 2048


@pytest.fixture(scope="module")
def scene():
    return cast(random_splats(150, seed=3), jnp.float32), cast(test_camera(), jnp.float32)


def test_permutation_changes_nothing_but_the_last_bit(scene):
    """A splat's place in a vector register may decide how its projection is rounded."""
    splats, camera = scene
    shuffle = np.random.default_rng(0).permutation(150)
    shuffled = jax.tree.map(lambda leaf: leaf[shuffle], splats)
    first = render(splats, camera, capacity=CAPACITY)
    second = render(shuffled, camera, capacity=CAPACITY)
    assert int(first.required) == int(second.required)
    for a, b in zip(first[:3], second[:3], strict=True):
        np.testing.assert_allclose(a, b, atol=2e-6)


def test_rigid_motion_of_the_world(scene):
    splats, camera = cast(scene[0], jnp.float64), cast(scene[1], jnp.float64)
    Q, shift = axis_angle_to_matrix(jnp.array([0.3, -1.0, 0.5]), 1.1), jnp.array([5.0, -2.0, 1.0])
    moved = splats._replace(
        means=splats.means @ Q.T + shift,
        covariances=jnp.einsum("ij,njk,lk->nil", Q, splats.covariances, Q),
    )
    rotation = camera.rotation @ Q.T
    follows = Camera(
        rotation,
        camera.translation - rotation @ shift,
        camera.focal,
        camera.centre,
        camera.width,
        camera.height,
    )
    first = render(splats, camera, capacity=CAPACITY)
    second = render(moved, follows, capacity=CAPACITY)
    np.testing.assert_allclose(first.colour, second.colour, atol=1e-11)
    np.testing.assert_allclose(first.depth, second.depth, atol=1e-11)


def test_tiles_chunks_and_capacity_do_not_show(scene):
    splats, camera = scene
    plain = render(splats, camera, capacity=CAPACITY)
    for settings in (
        Settings(tile_size=16),
        Settings(tile_size=5, chunk_size=3, group_size=7),
        Settings(tile_size=64, chunk_size=1),
    ):
        other = render(splats, camera, settings=settings)
        np.testing.assert_allclose(other.colour, plain.colour, atol=2e-6)
    roomy = render(splats, camera, capacity=2 * CAPACITY)
    np.testing.assert_array_equal(roomy.colour, plain.colour)


def test_both_sorts_give_the_same_lists(scene):
    # Millions of splats that draw nothing push the key beyond 32 bits.
    splats, camera = scene
    settings = Settings(tile_size=1)
    grid = make_grid(camera.width, camera.height, settings)
    count = 2**32 // grid.tiles
    projected = project(splats, camera, settings)
    boxes = tile_boxes(projected, grid, settings)
    capacity = next_capacity(int(boxes.required))
    short = tile_lists(projected, boxes, grid, settings, capacity)
    padding = count - splats.means.shape[0]
    padded = jax.tree.map(
        lambda leaf: jnp.pad(leaf, [(0, 0)] * (leaf.ndim - 1) + [(0, padding)]), projected
    )
    tail = jax.tree.map(lambda leaf: jnp.pad(leaf, (0, padding)) if leaf.ndim else leaf, boxes)
    long = tile_lists(padded, tail, grid, settings, capacity)
    np.testing.assert_array_equal(short.offsets, long.offsets)
    end = int(short.offsets[-1])
    np.testing.assert_array_equal(short.ranks[:end], long.ranks[:end])
    assert (grid.tiles + 1) * 150 <= 2**32 < (grid.tiles + 1) * count


def test_overflow_is_flagged_and_drops_the_far(scene):
    splats, camera = scene
    required = int(required_pairs(splats, camera))
    short = render(splats, camera, capacity=required // 2)
    assert bool(short.overflow) and int(short.required) == required
    assert np.isfinite(np.asarray(short.colour)).all()
    full = render(splats, camera)
    assert not bool(full.overflow)
    assert np.abs(full.colour - short.colour).max() > 0.01
    assert (short.alpha <= full.alpha + 1e-6).all()


def test_too_many_pairs_to_count():
    count = 60_000
    splats = Splats(
        jnp.zeros((count, 3)),
        jnp.broadcast_to(jnp.eye(3), (count, 3, 3)) * 100.0,
        jnp.ones(count),
        jnp.ones((count, 1)),
    )
    camera = test_camera(width=1600, height=1200)
    assert int(required_pairs(splats, camera)) == 2**31 - 1
    with pytest.raises(InputError, match="pairs"):
        render(splats, camera)


def test_two_runs_give_the_same_bits(scene):
    def loss(splats, camera):
        image = render(splats, camera, capacity=CAPACITY)
        return jnp.sum(jnp.sin(7 * image.colour)) + jnp.sum(image.depth)

    gradient = jax.jit(jax.value_and_grad(loss, argnums=(0, 1)))
    for a, b in zip(*map(jax.tree.leaves, (gradient(*scene), gradient(*scene))), strict=True):
        np.testing.assert_array_equal(a, b)


def test_compiles_once_and_needs_a_capacity_inside_jit(scene):
    splats, camera = scene
    traces = []

    @jax.jit
    def picture(splats, camera):
        traces.append(1)
        return render(splats, camera, capacity=CAPACITY).colour

    picture(splats, camera)
    picture(splats._replace(means=splats.means * 1.01), camera)
    assert len(traces) == 1
    with pytest.raises(InputError, match="capacity"):
        jax.jit(lambda s: render(s, camera).colour)(splats)


def test_several_cameras(scene):
    splats, _ = scene
    eyes = [(1.2, -1.5, 0.8), (-1.0, -1.6, 0.4)]
    cameras = [test_camera(dtype=jnp.float32, eye=eye) for eye in eyes]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *cameras)

    def draw(camera):
        return render(splats, camera, capacity=CAPACITY).colour

    singly = np.stack([draw(camera) for camera in cameras])
    np.testing.assert_allclose(jax.lax.map(draw, stacked), singly, atol=1e-6)
    np.testing.assert_allclose(jax.vmap(draw)(stacked), singly, atol=1e-6)

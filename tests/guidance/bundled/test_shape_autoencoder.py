import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.guidance.bundled.shape_autoencoder import READ, AutoencoderConfig, ShapeAutoencoder

TINY = AutoencoderConfig(
    width=16,
    side=2,
    channels=4,
    cells=3,
    features=5,
    head_width=8,
    hidden=16,
    reading=1,
    writing=1,
    answer=8,
    half=0.6,
)
CELL = 0.2


@pytest.fixture(scope="module")
def network():
    return ShapeAutoencoder(TINY, rngs=nnx.Rngs(0))


def cloud(count=60, seed=0):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (2, count, 3))
    normals = rng.normal(size=(2, count, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    arrays = points, normals, rng.uniform(size=(2, count, 3))
    return [jnp.asarray(array, jnp.float32) for array in arrays]


def test_latents_are_of_unit_size_whatever_the_order_of_points(network):
    read = cloud()
    encode = nnx.jit(ShapeAutoencoder.encode)
    latents = encode(network, *read)
    assert latents.shape == (2, 8, 4)
    np.testing.assert_allclose(jnp.mean(latents**2, -1), 1, atol=1e-3)
    order = np.random.default_rng(1).permutation(60)
    again = encode(network, *(array[:, order] for array in read))
    np.testing.assert_allclose(again, latents, atol=1e-5)
    other = encode(network, read[0], read[1], 1 - read[2])
    assert np.abs(other - latents).max() > 1e-3


def test_a_point_is_found_in_its_cell(network):
    # Blocks of 3 cells of 0.2: x = 0.13 lies in the fourth cell from -0.6, the first of block 1.
    points = jnp.array([[[0.13, -0.55, -0.1], [0.13, -0.55, -0.1]]], jnp.float32)
    normals = jnp.array([[[0, 0, 1.0], [0, 1.0, 0]]], jnp.float32)
    colours = jnp.array([[[1.0, 0.5, 0], [1.0, 0.5, 1.0]]], jnp.float32)
    held = np.array(network._cells(points, normals, colours)).reshape(8, 27, READ)
    block, cell = 4, (0 * 3 + 0) * 3 + 2  # (1, 0, 0) of 2x2x2, (0, 0, 2) of 3x3x3
    offset = [0.65 - 0.5, 0.25 - 0.5, 0.5 - 0.5]  # (place + 0.6) / 0.2, less its whole part
    wanted = [1, *offset, 0, 0.5, 0.5, 1, 0, 0]
    np.testing.assert_allclose(held[block, cell], wanted, atol=1e-5)
    held[block, cell] = 0
    np.testing.assert_array_equal(held, 0)


def test_between_cells_features_are_linear(network):
    axis = (np.arange(6) + 0.5) * CELL - 0.6
    middles = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    ramp = np.random.default_rng(2).normal(size=(3, 5))
    features = jnp.asarray(middles @ ramp, jnp.float32)[None]
    places = np.random.default_rng(3).uniform(-0.5, 0.5, (1, 40, 3))
    between = nnx.jit(ShapeAutoencoder._between)
    places = np.concatenate([places, np.full((1, 1, 3), 5.0)], 1)
    found = between(network, features, jnp.asarray(places, jnp.float32))[0]
    np.testing.assert_allclose(found[:-1], places[0, :-1] @ ramp, atol=1e-5)
    # Beyond the outermost middles the value there is kept.
    np.testing.assert_allclose(found[-1], np.full(3, 0.5) @ ramp, atol=1e-5)


def test_blocks_are_laid_out_as_they_are_read(network):
    """What a latent unfolds to stands in its own block."""
    latents = jnp.asarray(np.random.default_rng(5).normal(size=(1, 8, 4)), jnp.float32)
    first = nnx.clone(network)
    first.write = nnx.List([])  # without attention, blocks do not know of one another
    unfold = nnx.jit(ShapeAutoencoder.unfold)
    changed = np.abs(unfold(first, latents.at[:, 4].add(1.0)) - unfold(first, latents))
    changed = np.array(changed).reshape(6, 6, 6, 5).max(-1)
    assert changed[3:, :3, :3].min() > 0
    changed[3:, :3, :3] = 0
    np.testing.assert_array_equal(changed, 0)


def test_fields_are_in_range_and_each_place_by_itself(network):
    latents = jnp.asarray(np.random.default_rng(5).normal(size=(2, 8, 4)), jnp.float32)
    places = jnp.asarray(np.random.default_rng(4).uniform(-0.5, 0.5, (2, 30, 3)), jnp.float32)
    decode = nnx.jit(ShapeAutoencoder.decode)
    field = decode(network, latents, places)
    assert field.distance.shape == (2, 30) and field.colour.shape == (2, 30, 3)
    assert np.abs(field.distance).max() <= TINY.reach
    assert field.colour.min() >= 0 and field.colour.max() <= 1
    part = decode(network, latents, places[:, 10:20])
    np.testing.assert_allclose(part.distance, field.distance[:, 10:20], atol=1e-6)
    slope = jax.jit(jax.grad(lambda p: network.decode(latents, p).distance.sum()))
    towards = slope(places)
    assert np.abs(towards).max() > 0 and np.isfinite(towards).all()

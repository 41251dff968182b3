import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.parity.arrays import pseudo_random, weights
from jaxphys.core.errors import InputError
from jaxphys.networks.attention import attend, join_heads, split_heads
from jaxphys.networks.layers import Conv2d, Embedding, GroupNorm, Linear
from jaxphys.networks.parameters import fill, named_parameters, published_name, published_shape


class Small(nnx.Module):
    def __init__(self):
        self.layers = nnx.List([Linear(3, 4), Conv2d(4, 5)])
        self.norm = GroupNorm(2, 4)
        self.words = Embedding(6, 3)


SHAPES = {
    "layers.0.weight": (4, 3),
    "layers.0.bias": (4,),
    "layers.1.weight": (5, 4, 3, 3),
    "layers.1.bias": (5,),
    "norm.weight": (4,),
    "norm.bias": (4,),
    "words.weight": (6, 3),
}
ARRAYS = weights(SHAPES)
KNOWN = [0.6248838901519775, -0.9393483400344849, -0.6943293809890747, -0.04361844062805176]


def test_names_and_shapes_are_those_of_checkpoints():
    found = named_parameters(nnx.eval_shape(Small))
    assert {published_name(n): published_shape(n, v.shape) for n, v in found.items()} == SHAPES


@pytest.mark.parametrize("dtype", [jnp.bfloat16, jnp.float32, jnp.float64])
def test_kernels_are_turned_round(dtype):
    small = fill(Small, ARRAYS, source="file", dtype=dtype)
    kernel = small.layers[1].kernel[...]
    assert kernel.dtype == dtype
    expected = ARRAYS["layers.1.weight"].transpose(2, 3, 1, 0)
    np.testing.assert_allclose(kernel.astype(jnp.float32), expected, rtol=1e-2)
    x = pseudo_random("x", (2, 3))
    found = fill(Small, ARRAYS, source="file").layers[0](jnp.asarray(x))
    expected = x @ ARRAYS["layers.0.weight"].T + ARRAYS["layers.0.bias"]
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_older_names_and_single_pixel_convolutions_load():
    old = {f"net.{name}": array for name, array in ARRAYS.items()} | {"net.step": np.arange(3)}
    old["net.layers.0.weight"] = old["net.layers.0.weight"][:, :, None, None]
    options = {"renames": [(r"^net\.", "")], "ignore": ["step"]}
    found = named_parameters(fill(Small, old, source="file", **options))
    plain = named_parameters(fill(Small, ARRAYS, source="file"))
    assert all((found[name] == plain[name]).all() for name in plain)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"extra": np.zeros(3)}, "file: array 'extra' belongs to no part"),
        ({"norm.bias": None}, "file: 1 arrays are missing, the first is 'norm.bias'"),
        ({"norm.bias": np.zeros(5)}, r"'norm.bias' has shape \(5,\) instead of \(4,\)"),
        ({"layers.0.weight": np.zeros((3, 4))}, r"has shape \(3, 4\) instead of \(4, 3\)"),
        ({"norm.bias": np.zeros(4, int)}, "holds int64, not floating point"),
        ({"old.norm.bias": np.zeros(4)}, "are the same parameter"),
    ],
)
def test_other_checkpoints_are_refused(changes, said):
    arrays = {k: v for k, v in (ARRAYS | changes).items() if v is not None}
    with pytest.raises(InputError, match=said):
        fill(Small, arrays, source="file", renames=[(r"^old\.", "")])


def plain_attention(queries, keys, values, causal):
    logits = np.einsum("bhqd,bhkd->bhqk", queries, keys) / np.sqrt(queries.shape[-1])
    if causal:
        later = np.triu_indices(logits.shape[-1], 1)
        logits[..., later[0], later[1]] = -1e30
    logits = np.exp(logits - logits.max(-1, keepdims=True))
    return np.einsum("bhqk,bhkd->bhqd", logits / logits.sum(-1, keepdims=True), values)


@pytest.mark.parametrize("slice_size", [None, 1, 4, 10])
@pytest.mark.parametrize("causal", [False, True])
def test_attention_whole_and_in_slices(slice_size, causal):
    queries, keys, values = (pseudo_random(name, (2, 3, 10, 4)) for name in "qkv")
    found = attend(queries, keys, values, causal=causal, slice_size=slice_size)
    expected = plain_attention(queries, keys, values, causal)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_gradient_of_attention_in_slices():
    arrays = tuple(pseudo_random(name, (1, 2, 7, 4)) for name in "qkv")

    def slope(slice_size):
        return jax.grad(lambda arrays: jnp.sum(attend(*arrays, slice_size=slice_size) ** 2))(arrays)

    for whole, sliced in zip(slope(None), slope(3), strict=True):
        np.testing.assert_allclose(sliced, whole, atol=1e-6)


def test_heads_split_and_join():
    x = pseudo_random("x", (2, 5, 12))
    heads = split_heads(jnp.asarray(x), 3)
    np.testing.assert_array_equal(heads[1, 2, 4], x[1, 4, 8:])
    np.testing.assert_array_equal(join_heads(heads), x)


def test_pseudo_random_numbers_never_change():
    """The committed references hold outputs only: their weights are made by these functions."""
    found = pseudo_random("a.weight", (2, 2))
    np.testing.assert_array_equal(found, pseudo_random("a.weight", (4,)).reshape(2, 2))
    assert (found != pseudo_random("b.weight", (2, 2))).all()
    many = pseudo_random("many", (100_000,), 2.0)
    assert abs(many.mean()) < 0.02 and many.min() >= -2 and many.max() < 2
    np.testing.assert_allclose(many.std(), 2 / 3**0.5, rtol=0.01)
    np.testing.assert_allclose(found.ravel(), KNOWN, rtol=1e-6)

"""The scorer's network: a picture to a unit vector that is compared with those of sentences."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path
from jaxphys.guidance.bundled.adaptive import TrainableLinear, normalise
from jaxphys.guidance.bundled.text_encoder import WIDTH
from jaxphys.networks.parameters import named_parameters, with_parameters

RESOLUTION = 64
WEIGHTS = Path(__file__).with_name("weights.safetensors")


@dataclass(frozen=True)
class ScorerConfig:
    """Widths of the stages, whose grids have 16, 8, 4 ... cells a side, and blocks in each."""

    widths: tuple[int, ...] = (32, 128, 176)
    blocks: tuple[int, ...] = (1, 1, 1)


def to_depth(x: Array) -> Array:
    """(B, H, W, C) -> (B, H / 2, W / 2, 4 C): blocks of two by two cells side by side."""
    batch, height, width, channels = x.shape
    x = x.reshape(batch, height // 2, 2, width // 2, 2, channels).transpose(0, 1, 3, 2, 4, 5)
    return x.reshape(batch, height // 2, width // 2, 4 * channels)


def windows(x: Array) -> Array:
    """(B, H, W, C) -> (B, H, W, 9 C): each cell with its eight neighbours, zero past the border.

    A convolution is then a matrix product, which the CPU backend computes far faster.
    """
    height, width = x.shape[1:3]
    padded = jnp.pad(x, ((0, 0), (1, 1), (1, 1), (0, 0)))
    return jnp.concatenate(
        [padded[:, i : i + height, j : j + width] for i in range(3) for j in range(3)], -1
    )


class Block(nnx.Module):
    """x + a 3 x 3 and a 1 x 1 convolution of it, after a norm (He et al. 2016)."""

    def __init__(self, width: int, *, rngs: nnx.Rngs):
        self.inner = TrainableLinear(9 * width, width, rngs=rngs)
        self.outer = TrainableLinear(width, width, rngs=rngs, zero=True)

    def __call__(self, x: Array) -> Array:
        return x + self.outer(jax.nn.relu(self.inner(windows(normalise(x)))))


class Scorer(nnx.Module):
    """Pictures (B, 64, 64, 3) in [0, 1] to unit vectors (B, 384) among those of sentences.

    Computes in the dtype of the pictures; the last norm in float32 or better.
    """

    def __init__(self, config: ScorerConfig = ScorerConfig(), *, rngs: nnx.Rngs):
        self.config = config
        inputs, stages = 12, []
        for width, count in zip(config.widths, config.blocks, strict=True):
            down = TrainableLinear(4 * inputs, width, rngs=rngs)
            stages.append(nnx.List([down, *(Block(width, rngs=rngs) for _ in range(count))]))
            inputs = width
        self.stages = nnx.List(stages)
        self.head = TrainableLinear(inputs, WIDTH, rngs=rngs)
        self.log_sharpness = nnx.Param(jnp.asarray(2.5, jnp.float32))

    def __call__(self, pictures: Array) -> Array:
        x = to_depth(2 * pictures - 1)
        for down, *blocks in self.stages:
            x = down(to_depth(x))
            for block in blocks:
                x = block(x)
        vectors = self.head(normalise(x).mean((1, 2)))
        return normalise(vectors.astype(jnp.promote_types(x.dtype, jnp.float32))) * WIDTH**-0.5


@nnx.jit
def _embed(module: Scorer, pictures: Array) -> Array:
    return module(pictures)


def embed(module: Scorer, pictures: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """(N, 384) float32 unit vectors of pictures (N, 64, 64, 3) in [0, 1], 96 at a time."""
    pictures = np.asarray(pictures, np.float32)
    if pictures.ndim != 4 or pictures.shape[1:] != (RESOLUTION, RESOLUTION, 3):
        raise InputError(f"scorer: pictures of shape {pictures.shape}, expected (N, 64, 64, 3)")
    rows = []
    for start in range(0, len(pictures), 96):
        part = pictures[start : start + 96]
        padded = np.pad(part, ((0, 96 - len(part)), (0, 0), (0, 0), (0, 0)))
        rows.append(np.asarray(_embed(module, padded))[: len(part)])
    return np.concatenate(rows) if rows else np.zeros((0, WIDTH), np.float32)


def save(path: Path, parameters: dict[str, Array], config: ScorerConfig) -> None:
    """Writes the parameters as float16 safetensors, whole or not at all."""
    arrays = {name: np.asarray(value, np.float16) for name, value in parameters.items()}
    metadata = {name: ",".join(map(str, np.atleast_1d(v))) for name, v in asdict(config).items()}
    with atomic_path(path) as aside:
        save_file(arrays, aside, metadata)


def load(path: Path = WEIGHTS) -> Scorer:
    """The scorer in float32. Raises InputError if the file is missing, damaged or does not fit."""
    try:
        with safe_open(path, "numpy") as file:
            metadata = file.metadata() or {}
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        widths, blocks = (
            tuple(map(int, metadata[name].split(","))) for name in ("widths", "blocks")
        )
        config = ScorerConfig(widths, blocks)
    except (OSError, SafetensorError, KeyError, ValueError) as error:
        raise InputError(
            f"scorer: {path} holds no weights ({error!r}); train them with experiments.scorer.train"
        ) from error
    module = nnx.eval_shape(lambda: Scorer(config, rngs=nnx.Rngs(0)))
    expected = named_parameters(module)
    wrong = [n for n, v in expected.items() if n not in arrays or arrays[n].shape != v.shape]
    if wrong:
        raise InputError(f"scorer: {path} has no array {wrong[0]!r} of the shape that it needs")
    return with_parameters(module, {n: jnp.asarray(arrays[n].astype("float32")) for n in expected})

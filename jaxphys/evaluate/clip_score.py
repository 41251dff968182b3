"""How well pictures fit a sentence: the cosine of their CLIP embeddings (Hessel et al. 2021)."""

from dataclasses import dataclass, replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.files import read_json
from jaxphys.networks.clip_block import unit_norm
from jaxphys.networks.clip_config import TextConfig, VisionConfig
from jaxphys.networks.clip_pictures import as_pixels
from jaxphys.networks.clip_text import ClipText, load_clip_text
from jaxphys.networks.clip_tokenizer import ClipTokenizer
from jaxphys.networks.clip_vision import ClipVision, load_clip_vision
from jaxphys.weights.safetensors_files import open_arrays

PUBLISHED = "openai/clip-vit-large-patch14"
PUBLISHED_VISION = VisionConfig(
    hidden_size=1024,
    intermediate_size=4096,
    projection_dim=768,
    num_hidden_layers=24,
    num_attention_heads=16,
    patch_size=14,
)


@nnx.jit
def _embed(tower: ClipText | ClipVision, inputs: Array) -> Array:
    return unit_norm(tower(inputs))


@dataclass(frozen=True)
class Clip:
    """Both towers and what they read.

    Attributes:
        variant: which CLIP it is: scores of different ones do not compare.
        size: side of the pictures [pixels].
    """

    variant: str
    size: int
    tokenizer: ClipTokenizer
    text: ClipText
    vision: ClipVision

    def texts(self, texts: list[str]) -> np.ndarray:
        """(B, D) unit embeddings, each of the first 75 word pieces."""
        with jax.default_matmul_precision("highest"):
            return np.asarray(_embed(self.text, jnp.asarray(self.tokenizer(texts))))

    def pictures(self, pictures: np.ndarray, batch: int = 8) -> np.ndarray:
        """(N, D) unit embeddings of (N, size, size, 3) uint8, `batch` at a time."""
        rows = []
        for start in range(0, len(pictures), batch):
            part = pictures[start : start + batch]
            # The last batch is filled up, so that one program is compiled.
            filled = np.concatenate(
                [part, np.zeros((batch - len(part), *part.shape[1:]), np.uint8)]
            )
            with jax.default_matmul_precision("highest"):
                found = _embed(self.vision, jnp.asarray(as_pixels(filled)))
            rows.append(np.asarray(found)[: len(part)])
        return np.concatenate(rows)


def load_clip(folder: str | Path) -> Clip:
    """The CLIP in a folder: config.json, model.safetensors and the tokenizer's files.

    Raises:
        InputError: a file is missing, damaged or of another kind of model.
    """
    folder = Path(folder)
    source = folder / "config.json"
    values = read_json(source)
    text = TextConfig.from_json(values, str(source))
    vision = VisionConfig.from_json(values, str(source))
    tokenizer = ClipTokenizer(folder)
    if tokenizer.size > text.vocab_size:
        raise InputError(
            f"{source}: vocab_size: {text.vocab_size} is below the {tokenizer.size} word pieces"
            " of the tokenizer; copy both from the same model"
        )
    arrays = open_arrays(folder)
    return Clip(
        variant(vision),
        vision.image_size,
        tokenizer,
        load_clip_text(arrays, text, str(folder)),
        load_clip_vision(arrays, vision, str(folder)),
    )


def variant(config: VisionConfig) -> str:
    """The name of the published model with this picture tower, or a description of another."""
    if replace(config, layer_norm_eps=PUBLISHED_VISION.layer_norm_eps) == PUBLISHED_VISION:
        return PUBLISHED
    return (
        f"another CLIP ({config.num_hidden_layers} layers of width {config.hidden_size}, patches of"
        f" {config.patch_size} pixels), not comparable with {PUBLISHED}"
    )


def clip_score(cosines: np.ndarray) -> float:
    """100 max(cos, 0), averaged over pictures: Hessel et al. 2021, eq. 1, with w = 100 instead of
    their 2.5, as is usual since.
    """
    return float(np.mean(100.0 * np.maximum(cosines, 0.0)))

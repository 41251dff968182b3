"""CLIP's text tower (Radford et al. 2021), which is also Stable Diffusion's text encoder."""

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.networks.clip_block import ClipTransformer
from jaxphys.networks.clip_config import LEGACY_END, TextConfig
from jaxphys.networks.layers import Embedding, LayerNorm, Linear
from jaxphys.networks.parameters import fill

# Text encoders of diffusion models are stored with and without this prefix.
TOWER_RENAMES = ((r"^text_model\.", ""),)
TOWER_IGNORES = (
    r"embeddings\.position_ids",
    r"vision_model\..*",
    r"(text|visual)_projection\.weight",
    "logit_scale",
)
TEXT_IGNORES = (
    r"text_model\.embeddings\.position_ids",
    r"vision_model\..*",
    r"visual_projection\.weight",
    "logit_scale",
)


class TextOutput(NamedTuple):
    """`hidden` (B, T, width) after the last norm; `pooled` (B, width), its row at the end mark."""

    hidden: Array
    pooled: Array


class TextEmbeddings(nnx.Module):
    """Word pieces plus learned positions: ids (B, T) -> (B, T, width)."""

    def __init__(self, config: TextConfig):
        self.token_embedding = Embedding(config.vocab_size, config.hidden_size)
        self.position_embedding = Embedding(config.max_position_embeddings, config.hidden_size)

    def __call__(self, ids: Array) -> Array:
        return self.token_embedding(ids) + self.position_embedding(jnp.arange(ids.shape[1]))


class TextTower(nnx.Module):
    """Ids (B, T) with start and end marks -> `TextOutput`. A token reads those before it only, so
    padding behind the end mark needs no mask.
    """

    def __init__(self, config: TextConfig):
        self.config = config
        self.embeddings = TextEmbeddings(config)
        self.encoder = ClipTransformer(config)
        self.final_layer_norm = LayerNorm(config.hidden_size, epsilon=config.layer_norm_eps)

    def __call__(self, ids: Array) -> TextOutput:
        most = self.config.max_position_embeddings
        if ids.shape[1] > most:
            raise InputError(f"CLIP reads {most} tokens at most, got {ids.shape[1]}")
        hidden = self.final_layer_norm(self.encoder(self.embeddings(ids), causal=True))
        end = self.config.eos_token_id
        # Of several ends (padding may be the same token) argmax takes the first.
        position = jnp.argmax(ids if end == LEGACY_END else ids == end, axis=1)
        pooled = jnp.take_along_axis(hidden, position[:, None, None], axis=1)[:, 0]
        return TextOutput(hidden, pooled)


class ClipText(nnx.Module):
    """Ids (B, T) -> embeddings (B, projection), not normalised, to compare with `ClipVision`'s."""

    def __init__(self, config: TextConfig):
        self.text_model = TextTower(config)
        self.text_projection = Linear(config.hidden_size, config.projection_dim, bias=False)

    def __call__(self, ids: Array) -> Array:
        return self.text_projection(self.text_model(ids).pooled)


def load_text_tower(
    arrays: Mapping[str, np.ndarray],
    config: TextConfig,
    source: str,
    dtype: jnp.dtype | str = jnp.float32,
) -> TextTower:
    """From a text encoder's file, or from that of a whole CLIP. InputError as `parameters.fill`."""
    return fill(
        lambda: TextTower(config),
        arrays,
        source=source,
        renames=TOWER_RENAMES,
        ignore=TOWER_IGNORES,
        dtype=dtype,
    )


def load_clip_text(
    arrays: Mapping[str, np.ndarray],
    config: TextConfig,
    source: str,
    dtype: jnp.dtype | str = jnp.float32,
) -> ClipText:
    """From the file of a whole CLIP or of its text half. InputError as `parameters.fill`."""
    return fill(lambda: ClipText(config), arrays, source=source, ignore=TEXT_IGNORES, dtype=dtype)

"""CLIP's picture tower, a vision transformer (Dosovitskiy et al. 2021; Radford et al. 2021)."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.networks.clip_block import ClipTransformer
from jaxphys.networks.clip_config import VisionConfig
from jaxphys.networks.layers import Conv2d, Embedding, LayerNorm, Linear
from jaxphys.networks.parameters import fill

VISION_IGNORES = (
    r"vision_model\.embeddings\.position_ids",
    r"text_model\..*",
    r"text_projection\.weight",
    "logit_scale",
)


class VisionEmbeddings(nnx.Module):
    """A class token, then the patches row by row, plus learned positions: pixels (B, H, W, 3) ->
    (B, 1 + patches, width).
    """

    def __init__(self, config: VisionConfig):
        width, patch = config.hidden_size, config.patch_size
        self.size = config.image_size
        self.class_embedding = nnx.Param(jnp.zeros((width,)))
        self.patch_embedding = Conv2d(3, width, size=patch, stride=patch, padding=0, bias=False)
        self.position_embedding = Embedding((self.size // patch) ** 2 + 1, width)

    def __call__(self, pixels: Array) -> Array:
        if pixels.shape[1:] != (self.size, self.size, 3):
            raise InputError(
                f"CLIP reads pictures of shape {(self.size, self.size, 3)}, got {pixels.shape[1:]}"
            )
        patches = self.patch_embedding(pixels)
        batch, width = patches.shape[0], patches.shape[-1]
        first = jnp.broadcast_to(self.class_embedding[...].astype(pixels.dtype), (batch, 1, width))
        tokens = jnp.concatenate([first, patches.reshape(batch, -1, width)], axis=1)
        positions = self.position_embedding(jnp.arange(tokens.shape[1]))
        return tokens + positions.astype(pixels.dtype)


class VisionTower(nnx.Module):
    """Pixels (B, H, W, 3) as from `clip_pictures.as_pixels` -> (B, width): the class token."""

    def __init__(self, config: VisionConfig):
        width, epsilon = config.hidden_size, config.layer_norm_eps
        self.embeddings = VisionEmbeddings(config)
        self.pre_layrnorm = LayerNorm(width, epsilon=epsilon)  # spelled so in every checkpoint
        self.encoder = ClipTransformer(config)
        self.post_layernorm = LayerNorm(width, epsilon=epsilon)

    def __call__(self, pixels: Array) -> Array:
        tokens = self.encoder(self.pre_layrnorm(self.embeddings(pixels)), causal=False)
        return self.post_layernorm(tokens[:, 0])


class ClipVision(nnx.Module):
    """Pixels (B, H, W, 3) -> embeddings (B, projection), not normalised."""

    def __init__(self, config: VisionConfig):
        self.vision_model = VisionTower(config)
        self.visual_projection = Linear(config.hidden_size, config.projection_dim, bias=False)

    def __call__(self, pixels: Array) -> Array:
        return self.visual_projection(self.vision_model(pixels))


def load_clip_vision(
    arrays: Mapping[str, np.ndarray],
    config: VisionConfig,
    source: str,
    dtype: jnp.dtype | str = jnp.float32,
) -> ClipVision:
    """From the file of a whole CLIP or of its picture half. InputError as `parameters.fill`."""
    return fill(
        lambda: ClipVision(config), arrays, source=source, ignore=VISION_IGNORES, dtype=dtype
    )

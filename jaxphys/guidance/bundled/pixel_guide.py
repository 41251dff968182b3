"""The bundled pixel prior told a prompt, and its score distillation."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.guidance.bundled.pixel_prior import PixelCondition, PixelPrior
from jaxphys.guidance.bundled.priors import load_pixel_prior
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.perp_neg import Negatives
from jaxphys.guidance.diffusion.score_distillation import (
    Distillation,
    DistillationConfig,
    score_distillation,
)
from jaxphys.guidance.view_prompts import unwanted_views
from jaxphys.guidance.views import view_features


def image_distillation(
    prior: PixelPrior,
    images: Array,
    text: Array,
    view: Array,
    key: Array,
    config: DistillationConfig,
    progress: Array | float = 0.0,
    *,
    negative: Array | None = None,
    unwanted: Negatives | None = None,
) -> Distillation:
    """Distillation of pictures by the pixel prior.

    Args:
        prior: the pixel prior, its parameters not differentiated.
        images: (B, R, R, 3) in [0, 1], opaque, on random backgrounds as in training.
        text: (B, R, D) embeddings of the prompt, see `prompt_embeddings`.
        view: (B, 4), `view_features` of each picture.
        key: decides noise levels and noise.
        config: see `DistillationConfig`.
        progress: how far the optimisation is, in [0, 1].
        negative: (B, R, D) embeddings that guidance moves away from instead of from no text.
        unwanted: what guidance steers clear of.
    """
    told = PixelCondition(text, view)
    untold = PixelCondition(jnp.zeros_like(text) if negative is None else negative, view)
    samples = 2.0 * images - 1.0
    return score_distillation(prior, samples, told, untold, key, config, progress, unwanted)


class PixelGuide(NamedTuple):
    """The bundled pixel prior and the embeddings (R, D) of the prompt and of the negative prompt,
    None if there is none."""

    prior: PixelPrior
    text: Array
    negative: Array | None = None

    @property
    def resolution(self) -> int:
        return self.prior.config.resolution

    def distil(self, images, azimuth, elevation, key, config, progress) -> Distillation:
        """The prior is told views as numbers: what Perp-Neg moves away from is the same text, seen
        from the front and from the side."""
        view = view_features(azimuth, elevation, xp=jnp)
        count, negative, unwanted = images.shape[0], None, None
        text = jnp.broadcast_to(self.text, (count, *self.text.shape))
        if self.negative is not None:
            negative = jnp.broadcast_to(self.negative, text.shape)
        if config.perp_neg:
            side = jnp.where(jnp.sin(azimuth) < 0, -0.5 * jnp.pi, 0.5 * jnp.pi)
            others = (view_features(turn, elevation, xp=jnp) for turn in (0 * side, side))
            conditions = tuple(PixelCondition(text, other.astype(view.dtype)) for other in others)
            unwanted = Negatives(conditions, unwanted_views(azimuth, elevation))
        return image_distillation(
            self.prior,
            images,
            text,
            view,
            key,
            config,
            progress,
            negative=negative,
            unwanted=unwanted,
        )


def bundled_image_guide(prompt: str, negative: str = "") -> PixelGuide:
    """The pixel prior that comes with the package, told a refined prompt and a negative one.

    Raises InputError if its weights are missing or damaged.
    """
    prior = load_pixel_prior()[0]
    phrases = prior.config.phrases
    avoided = prompt_embeddings(negative, phrases) if negative.strip() else None
    return PixelGuide(prior, prompt_embeddings(prompt, phrases), avoided)

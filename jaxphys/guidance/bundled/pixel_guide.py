"""The bundled pixel prior told a prompt, and its score distillation."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.guidance.bundled.pixel_prior import PixelCondition, PixelPrior
from jaxphys.guidance.bundled.priors import load_pixel_prior
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.score_distillation import (
    Distillation,
    DistillationConfig,
    score_distillation,
)
from jaxphys.guidance.views import view_features


def image_distillation(
    prior: PixelPrior,
    images: Array,
    text: Array,
    view: Array,
    key: Array,
    config: DistillationConfig,
    progress: Array | float = 0.0,
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
    """
    told = PixelCondition(text, view)
    untold = PixelCondition(jnp.zeros_like(text), view)
    return score_distillation(prior, 2.0 * images - 1.0, told, untold, key, config, progress)


class PixelGuide(NamedTuple):
    """The bundled pixel prior and the prompt's embeddings (R, D)."""

    prior: PixelPrior
    text: Array

    @property
    def resolution(self) -> int:
        return self.prior.config.resolution

    def distil(self, images, azimuth, elevation, key, config, progress) -> Distillation:
        view = view_features(azimuth, elevation, xp=jnp)
        text = jnp.broadcast_to(self.text, (images.shape[0], *self.text.shape))
        return image_distillation(self.prior, images, text, view, key, config, progress)


def bundled_image_guide(prompt: str) -> PixelGuide:
    """The pixel prior that comes with the package, told a refined prompt.

    Raises InputError if its weights are missing or damaged.
    """
    prior = load_pixel_prior()[0]
    return PixelGuide(prior, prompt_embeddings(prompt, prior.config.phrases))

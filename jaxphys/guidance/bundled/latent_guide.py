"""The bundled latent prior told a prompt: surfaces drawn from it, and its score distillation."""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.guidance.bundled.latent_prior import (
    LatentCondition,
    LatentPrior,
    LatentSampling,
    sample_latents,
)
from jaxphys.guidance.bundled.priors import load_latent_prior, load_shape_autoencoder
from jaxphys.guidance.bundled.shape_autoencoder import ShapeAutoencoder
from jaxphys.guidance.bundled.surface import surface_points
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.score_distillation import (
    Distillation,
    DistillationConfig,
    score_distillation,
)


class LatentGuide(NamedTuple):
    """The autoencoder, the prior over its latents, and the prompt's embeddings (R, D)."""

    autoencoder: ShapeAutoencoder
    prior: LatentPrior
    text: Array

    def sample(self, key, count) -> tuple[Array, Array]:
        draw, spread = jax.random.split(key)
        latents = sample_latents(self.prior, self.text[None], draw)[0]
        seed = int(jax.random.randint(spread, (), 0, jnp.iinfo(jnp.int32).max))
        found = surface_points(self.autoencoder, latents, count, seed)
        return jnp.asarray(found.points), jnp.asarray(found.colours)

    def distil(
        self, points, colours, key, config: DistillationConfig, progress: Array | float
    ) -> Distillation:
        """Through the encoder, which reads the points without normals."""
        unknown = jnp.zeros_like(points)
        latents = self.autoencoder.encode(points[None], unknown[None], colours[None])
        samples = (latents - self.prior.mean[...]) / self.prior.deviation[...]
        told, untold = self.text[None], jnp.zeros_like(self.text[None])
        return score_distillation(
            self.prior,
            samples,
            LatentCondition(told),
            LatentCondition(untold),
            key,
            replace(config, limit=LatentSampling().limit),
            progress,
        )


def bundled_latent_guide(prompt: str) -> LatentGuide:
    """The latent prior that comes with the package, told a refined prompt.

    Raises InputError if its weights are missing or damaged.
    """
    prior = load_latent_prior()[0]
    text = prompt_embeddings(prompt, prior.config.phrases)
    return LatentGuide(load_shape_autoencoder()[0], prior, text)

"""The bundled point prior told a prompt, and its score distillation."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.guidance.bundled.point_prior import PointCondition, PointPrior, sample_points, to_frame
from jaxphys.guidance.bundled.priors import load_point_prior
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.score_distillation import (
    Distillation,
    DistillationConfig,
    score_distillation,
)


def point_distillation(
    prior: PointPrior,
    points: Array,
    colours: Array,
    text: Array,
    key: Array,
    config: DistillationConfig,
    progress: Array | float = 0.0,
) -> Distillation:
    """Distillation of Gaussian centres and colours by the point prior.

    Args:
        prior: the point prior, its parameters not differentiated.
        points: (N, 3) centres *in the prior's object frame* (centred, z up, front +x, longest side
            1): undo any placement of the object first.
        colours: (N, 3) in [0, 1].
        text: (R, D) embeddings of the prompt, see `prompt_embeddings`.
    """
    samples, text = to_frame(points, colours)[None], text[None]
    told, untold = PointCondition(text), PointCondition(jnp.zeros_like(text))
    # Of the two keys the other once chose a subset: the same seed still makes the same object.
    inner = jax.random.split(key)[1]
    return score_distillation(prior, samples, told, untold, inner, config, progress)


class PointGuide(NamedTuple):
    """The bundled point prior and the prompt's embeddings (R, D)."""

    prior: PointPrior
    text: Array

    def sample(self, key, count) -> tuple[Array, Array]:
        points, colours = sample_points(self.prior, self.text[None], key, count=count)
        return points[0], colours[0]

    def distil(self, points, colours, key, config, progress) -> Distillation:
        return point_distillation(self.prior, points, colours, self.text, key, config, progress)


def bundled_point_guide(prompt: str) -> PointGuide:
    """The point prior that comes with the package, as `bundled_image_guide`."""
    prior = load_point_prior()[0]
    return PointGuide(prior, prompt_embeddings(prompt, prior.config.phrases))

"""What distillation asks of a prior: an image guide judges pictures, a shape guide points.

A guide is a prior together with what it is told of one prompt. All are pytrees of arrays, made to
be passed into jitted functions.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp

from jaxphys.guidance import views
from jaxphys.guidance.distillation import (
    Distillation,
    DistillationConfig,
    image_distillation,
    point_distillation,
)
from jaxphys.guidance.pixel_prior import PixelPrior
from jaxphys.guidance.point_prior import PointPrior, sample_points
from jaxphys.guidance.priors import load_pixel_prior, load_point_prior
from jaxphys.guidance.text_encoder import load_text_encoder

Array = jax.Array


class ImageGuide(Protocol):
    """A 2D prior told a prompt."""

    @property
    def resolution(self) -> int:
        """Pixels a side of the pictures that it judges."""

    def distil(
        self,
        images: Array,
        azimuth: Array,
        elevation: Array,
        key: Array,
        config: DistillationConfig,
        progress: Array | float,
    ) -> Distillation:
        """Loss of pictures (B, R, R, 3) in [0, 1] seen from azimuths and elevations (B,) [rad]."""


class ShapeGuide(Protocol):
    """A 3D prior told a prompt. Points are in the object frame: centred, z up, front +x, longest
    side about 1; colours in [0, 1]."""

    def sample(self, key: Array, count: int) -> tuple[Array, Array]:
        """Points (M, 3) and colours (M, 3) of one object, M >= count."""

    def distil(
        self,
        points: Array,
        colours: Array,
        key: Array,
        config: DistillationConfig,
        progress: Array | float,
    ) -> Distillation:
        """Loss of centres (N, 3) and their colours (N, 3)."""


class Guides(NamedTuple):
    """The two guides of one prompt."""

    image: ImageGuide
    shape: ShapeGuide


class PixelGuide(NamedTuple):
    """The bundled pixel prior and the prompt's embedding (D,)."""

    prior: PixelPrior
    text: Array

    @property
    def resolution(self) -> int:
        return self.prior.config.resolution

    def distil(self, images, azimuth, elevation, key, config, progress) -> Distillation:
        view = views.view_features(azimuth, elevation, xp=jnp)
        text = jnp.broadcast_to(self.text, (images.shape[0], *self.text.shape))
        return image_distillation(self.prior, images, text, view, key, config, progress)


class PointGuide(NamedTuple):
    """The bundled point prior and the prompt's embedding (D,)."""

    prior: PointPrior
    text: Array

    def sample(self, key, count) -> tuple[Array, Array]:
        points, colours = sample_points(self.prior, self.text[None], key, count=count)
        return points[0], colours[0]

    def distil(self, points, colours, key, config, progress) -> Distillation:
        return point_distillation(self.prior, points, colours, self.text, key, config, progress)


def object_of(prompt: str) -> str:
    """The part of a refined prompt that names the object, its first."""
    return prompt.split(",")[0].strip()


def _embedding(prompt: str) -> Array:
    return jnp.asarray(load_text_encoder()([object_of(prompt)])[0], jnp.float32)


def bundled_image_guide(prompt: str) -> PixelGuide:
    """The pixel prior that comes with the package, told the object of a refined prompt.

    Raises InputError if its weights are missing or damaged.
    """
    return PixelGuide(load_pixel_prior()[0], _embedding(prompt))


def bundled_shape_guide(prompt: str) -> PointGuide:
    """The point prior that comes with the package, as `bundled_image_guide`."""
    return PointGuide(load_point_prior()[0], _embedding(prompt))

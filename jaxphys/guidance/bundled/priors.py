"""The bundled priors: modules from named arrays, and the arrays from files."""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any, TypeVar

import jax.numpy as jnp
from flax import nnx

from jaxphys import weights
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.latent_prior import LatentPrior, LatentPriorConfig
from jaxphys.guidance.bundled.pixel_prior import PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, ShapeAutoencoder
from jaxphys.networks.parameters import named_parameters, with_parameters

Module = TypeVar("Module", bound=nnx.Module)


def require_prior(name: str) -> None:
    """Raises `InputError` where the weights of a prior are not bundled, before any work is done."""
    if name not in weights.manifest():
        raise InputError(
            f"generate: this version comes without the weights {name}; train them "
            "(experiments/priors/README.md), or move an object you have with `jaxphys animate`"
        )


def _load(
    name: str, kind: Callable[..., Module], config_type: type
) -> tuple[Module, dict[str, Any]]:
    arrays, entry = weights.load(name)
    known = {field.name for field in fields(config_type)}
    config = config_type(**{k: v for k, v in entry["config"].items() if k in known})
    module = nnx.eval_shape(lambda: kind(config, rngs=nnx.Rngs(0)))
    expected = named_parameters(module)
    wrong = [n for n, v in expected.items() if n not in arrays or arrays[n].shape != v.shape]
    if wrong:
        raise InputError(f"weights {name!r}: no array {wrong[0]!r} of the shape that it needs")
    parameters = {n: jnp.asarray(arrays[n].astype("float32")) for n in expected}
    return with_parameters(module, parameters), entry


@cache
def load_point_prior() -> tuple[PointPrior, dict[str, Any]]:
    """The bundled point prior in float32 and its manifest entry (data, steps, held-out loss ...).

    Raises InputError if the file is missing, damaged, or does not fit its entry.
    """
    return _load("point_prior", PointPrior, PointPriorConfig)


@cache
def load_shape_autoencoder() -> tuple[ShapeAutoencoder, dict[str, Any]]:
    """The bundled autoencoder of surfaces, as `load_point_prior`."""
    return _load("shape_autoencoder", ShapeAutoencoder, AutoencoderConfig)


@cache
def load_latent_prior() -> tuple[LatentPrior, dict[str, Any]]:
    """The bundled prior over its latents, as `load_point_prior`."""
    return _load("latent_prior", LatentPrior, LatentPriorConfig)


@cache
def load_pixel_prior() -> tuple[PixelPrior, dict[str, Any]]:
    """The bundled pixel prior, as `load_point_prior`."""
    return _load("pixel_prior", PixelPrior, PixelPriorConfig)

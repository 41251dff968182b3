"""Point-E (Nichol et al. 2022) as a 3D prior: it draws clouds for a text, and judges clouds.

Its objects face -y (Blender's front) where ours face +x; both have z up and a longest side of 1.
Points are given and taken in our frame, except where Point-E's is named.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.discrete_schedule import DiscreteSchedule
from jaxphys.guidance.diffusion.karras import DenoiseAtSigma, discrete_denoiser, sample_karras
from jaxphys.guidance.diffusion.samplers import karras_ratios
from jaxphys.guidance.diffusion.schedule import Kind, guided
from jaxphys.guidance.diffusion.score_distillation import (
    Distillation,
    DistillationConfig,
    score_distillation,
)
from jaxphys.networks.parameters import fill
from jaxphys.networks.point_e import CHANNELS, PointEBase, PointEConfig, PointEUpsampler
from jaxphys.weights.safetensors_files import open_arrays
from jaxphys.weights.torch_zip import read_torch_zip

SLICE = 1089  # queries of the upsampler at a time: four slices of 4,353 tokens
BASE_SCHEDULE = DiscreteSchedule("cosine", 1024)
UPSAMPLER_SCHEDULE = DiscreteSchedule("linear", 1024, 1000 / 1024 * 1e-4, 1000 / 1024 * 0.02)
SCALES = np.array([2.0, 2.0, 2.0, 2 / 255, 2 / 255, 2 / 255])
BIASES = np.array([0.0, 0.0, 0.0, -1.0, -1.0, -1.0])


def to_point_e_frame(points: Array, colours: Array) -> Array:
    """Clouds (..., 6) as Point-E's training data has them.

    points: (..., 3) in our frame: centred, z up, front +x, longest side 1. colours: (..., 3) in
    [0, 1], which become 0 to 255.
    """
    return jnp.concatenate([facing_minus_y(points), 255.0 * colours], axis=-1)


def from_point_e_frame(clouds: Array) -> tuple[Array, Array]:
    """Inverse of `to_point_e_frame`; colours are clipped to [0, 1]."""
    x, y, z = jnp.split(clouds[..., :3], 3, axis=-1)
    return jnp.concatenate([-y, x, z], axis=-1), jnp.clip(clouds[..., 3:] / 255.0, 0.0, 1.0)


def facing_minus_y(points: Array) -> Array:
    """Points (..., 3) that face +x, turned about z until they face -y."""
    x, y, z = jnp.split(points, 3, axis=-1)
    return jnp.concatenate([y, -x, z], axis=-1)


@dataclass(frozen=True)
class PointEPriorConfig:
    """What the networks predict, the points that the base judges or draws at a time, and those that
    the upsampler adds at a time."""

    kind: Kind = "noise"
    points: int = 1024
    added: int = 3072


class PointE(nnx.Module):
    """Denoiser of (B, 1024, 6) points, Point-E's clouds scaled to [-1, 1]; and the upsampler, which
    only `sample_point_e` asks."""

    def __init__(
        self,
        base: PointEBase,
        upsampler: PointEUpsampler | None = None,
        config: PointEPriorConfig = PointEPriorConfig(),
    ):
        self.base, self.upsampler, self.config = base, upsampler, config
        self.schedule = BASE_SCHEDULE

    def __call__(self, noisy: Array, time: Array, text: Array) -> Array:
        """The noise in `noisy` at `time` (B,) in [0, 1], told unit CLIP text embeddings (B, 768) or
        zeros."""
        dtype = self.base.output_proj.kernel[...].dtype
        step = self.schedule.index(time)
        prediction = self.base(noisy.astype(dtype), step, text)
        return prediction[..., :CHANNELS].astype(noisy.dtype)


def load_point_e(
    base_file: str | Path,
    upsampler_file: str | Path | None = None,
    *,
    dtype: jnp.dtype | str = jnp.float32,
    base_config: PointEConfig | None = None,
    upsampler_config: PointEConfig | None = None,
    config: PointEPriorConfig = PointEPriorConfig(),
) -> PointE:
    """The published networks "base40M-textvec" and "upsample", from `.pt` or `.safetensors`.

    Args:
        base_file, upsampler_file: without the second, clouds have 1,024 points at most.
        dtype: of the weights and the computation.
        base_config, upsampler_config: of the networks; by default what the arrays' shapes say.

    Raises:
        InputError: a file is missing, damaged, or of another network.
    """
    source = str(base_file)
    arrays = _arrays(source)
    sizes = base_config or PointEConfig.of_arrays(arrays, source)
    base = fill(lambda: PointEBase(sizes), arrays, source=source, dtype=dtype)
    if upsampler_file is None:
        return PointE(base, None, config)
    source = str(upsampler_file)
    arrays = _arrays(source)
    wide = upsampler_config or PointEConfig.of_arrays(arrays, source, SLICE)
    upsampler = fill(lambda: PointEUpsampler(wide), arrays, source=source, dtype=dtype)
    for name, wanted in (("channel_scales", SCALES), ("channel_biases", BIASES)):
        if not np.allclose(arrays[name], wanted, rtol=1e-2, atol=0):
            raise InputError(
                f"{source}: array {name!r} is not {wanted.tolist()}, so it is not Point-E's"
                " upsampler as published; get upsample_40m.pt"
            )
        # Whatever `dtype`: in bfloat16, 2 / 255 would be wrong by 0.4 %.
        getattr(upsampler, name).set_value(jnp.asarray(arrays[name], jnp.float32))
    return PointE(base, upsampler, config)


def _arrays(path: str) -> Mapping[str, np.ndarray]:
    return open_arrays(path) if path.endswith(".safetensors") else read_torch_zip(path)


@dataclass(frozen=True)
class PointESampling:
    """How clouds are drawn; the defaults are as published.

    Attributes:
        steps: Heun's, two evaluations each, for each of the two networks.
        guidance: of the base, see `diffusion.guided`; the upsampler is told no text.
        largest, upsampler_largest, smallest: sigmas of the first step and of the last.
        rho: spaces the steps between.
        churn: of the base, see `sample_karras`.
    """

    steps: int = 64
    guidance: float = 3.0
    largest: float = 120.0
    upsampler_largest: float = 160.0
    smallest: float = 1e-3
    rho: float = 7.0
    churn: float = 3.0


def sample_point_e(
    prior: PointE,
    text: Array,
    key: Array,
    *,
    count: int = 4096,
    config: PointESampling = PointESampling(),
) -> tuple[Array, Array]:
    """Draws coloured clouds of at least `count` points, the same ones for the same key.

    The base draws the first 1,024. The upsampler adds 3,072 at a time until there are enough, each
    time for the same coarse cloud, so that all are points of one object. None are taken away.

    Args:
        text: (B, 768) unit CLIP text embeddings.

    Returns:
        points (B, M, 3) in our frame: centred, z up, front +x, longest side about 1; and colours
        (B, M, 3) in [0, 1]. M is 1,024 plus a multiple of 3,072.

    Raises:
        InputError: more points are asked for than the base draws, and there is no upsampler.
    """
    points, added = prior.config.points, prior.config.added
    rounds = max(0, math.ceil((count - points) / added))
    if rounds and prior.upsampler is None:
        raise InputError(
            f"Point-E's base draws {points} points, {count} are wanted: give the file of its"
            " upsampler too, upsample_40m.pt"
        )
    base_key, key = jax.random.split(key)
    coarse = _draw(prior, text, base_key, config)
    keys = jax.random.split(key, rounds) if rounds else ()
    clouds = [coarse, *(_add(prior, coarse, key, config) for key in keys)]
    return from_point_e_frame(jnp.concatenate(clouds, axis=1))


@nnx.jit(static_argnames="config")
def _draw(prior: PointE, text: Array, key: Array, config: PointESampling) -> Array:
    """Clouds (B, points, 6) of the base in Point-E's frame."""
    noise_key, churn_key = jax.random.split(key)
    shape = (text.shape[0], prior.config.points, CHANNELS)
    noise = jax.random.normal(noise_key, shape, text.dtype)
    sigmas = karras_ratios(config.steps, config.largest, config.smallest, config.rho)
    denoise = base_denoiser(prior, text, config.guidance)
    return unscaled(sample_karras(denoise, noise, sigmas, key=churn_key, churn=config.churn))


@nnx.jit(static_argnames="config")
def _add(prior: PointE, coarse: Array, key: Array, config: PointESampling) -> Array:
    """Points (B, added, 6) for coarse clouds, all in Point-E's frame."""
    noise = jax.random.normal(key, (coarse.shape[0], prior.config.added, CHANNELS), coarse.dtype)
    sigmas = karras_ratios(config.steps, config.upsampler_largest, config.smallest, config.rho)
    return unscaled(sample_karras(upsampler_denoiser(prior, coarse), noise, sigmas))


def base_denoiser(prior: PointE, text: Array, guidance: float) -> DenoiseAtSigma:
    """The guided base, for `sample_karras`; clean estimates are clipped before they are guided."""
    both = jnp.concatenate([text, jnp.zeros_like(text)])
    denoise = discrete_denoiser(prior.schedule, lambda noisy, time: prior(noisy, time, both))

    def denoise_guided(noisy: Array, sigma: Array) -> Array:
        told, untold = jnp.split(denoise(jnp.concatenate([noisy, noisy]), sigma), 2)
        return guided(told, untold, guidance)

    return denoise_guided


def upsampler_denoiser(prior: PointE, coarse: Array) -> DenoiseAtSigma:
    """The upsampler told coarse clouds (B, M, 6) in Point-E's frame, for `sample_karras`."""
    upsampler = prior.upsampler
    assert upsampler is not None  # `sample_point_e` asks for its file
    dtype = upsampler.output_proj.kernel[...].dtype

    def predict(noisy: Array, time: Array) -> Array:
        step = UPSAMPLER_SCHEDULE.index(time)
        prediction = upsampler(noisy.astype(dtype), step, coarse)
        return prediction[..., :CHANNELS].astype(noisy.dtype)

    return discrete_denoiser(UPSAMPLER_SCHEDULE, predict)


def scaled(clouds: Array) -> Array:
    """Point-E's clouds (..., 6) as the samples in [-1, 1] that the networks diffuse."""
    return clouds * SCALES.astype(clouds.dtype) + BIASES.astype(clouds.dtype)


def unscaled(samples: Array) -> Array:
    """Inverse of `scaled`."""
    return (samples - BIASES.astype(samples.dtype)) / SCALES.astype(samples.dtype)


def point_e_distillation(
    prior: PointE,
    points: Array,
    colours: Array,
    text: Array,
    key: Array,
    config: DistillationConfig,
    progress: Array | float = 0.0,
) -> Distillation:
    """Score distillation of a random subset of 1,024 points by Point-E, in its frame and range.

    points, colours: (N, 3) in our frame and in [0, 1], to which the loss's gradient belongs; what
    else is returned is in Point-E's. text: (768,) unit CLIP text embedding.

    Raises InputError for fewer points than the base was trained for.
    """
    count = prior.config.points
    if points.shape[0] < count:
        raise InputError(
            f"Point-E judges {count} points at a time, there are {points.shape[0]}: ask for"
            f" {count} Gaussians or more"
        )
    subset_key, key = jax.random.split(key)
    chosen = jax.random.permutation(subset_key, points.shape[0])[:count]
    samples = scaled(to_point_e_frame(points[chosen], colours[chosen]))[None]
    text = text[None]
    return score_distillation(prior, samples, text, jnp.zeros_like(text), key, config, progress)


class PointEGuide(NamedTuple):
    """The prior and the prompt's unit CLIP text embedding (768,); a `ShapeGuide`."""

    prior: PointE
    text: Array

    def sample(self, key: Array, count: int) -> tuple[Array, Array]:
        """Points (M, 3) and colours (M, 3) of one object, M >= count, see `sample_point_e`."""
        points, colours = sample_point_e(self.prior, self.text[None], key, count=count)
        return points[0], colours[0]

    def distil(self, points, colours, key, config, progress) -> Distillation:
        """See `point_e_distillation`."""
        return point_e_distillation(self.prior, points, colours, self.text, key, config, progress)

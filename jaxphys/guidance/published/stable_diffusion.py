"""Stable Diffusion (Rombach et al. 2022) as a 2D prior, from a folder in diffusers' layout.

Each part is read when it is needed and no other: distillation takes the text encoder (and drops it
once the prompt is encoded), the denoiser and the encoder of pictures; painting takes the decoder.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.core.files import read_json
from jaxphys.guidance.diffusion.perp_neg import Negatives
from jaxphys.guidance.diffusion.schedule import Kind
from jaxphys.guidance.diffusion.score_distillation import (
    Distillation,
    DistillationConfig,
    score_distillation,
)
from jaxphys.guidance.published.scheduler_config import SchedulerConfig
from jaxphys.guidance.view_prompts import OVERHEAD, away_from_front, unwanted_views, view_mixture
from jaxphys.networks import autoencoder, clip_text, unet
from jaxphys.networks.clip_tokenizer import ClipTokenizer
from jaxphys.networks.parameters import fill
from jaxphys.weights.safetensors_files import open_arrays

PARTS = ("tokenizer", "text_encoder", "unet", "vae", "scheduler")
VIEWS = ("front view", "side view", "back view", "overhead view")


class TextStates(NamedTuple):
    """states: (B, T, D), the text encoder's answer to a prompt."""

    states: Array


@dataclass(frozen=True)
class LatentPriorConfig:
    """How it is sampled, the side of the latents it was trained on, and how many pixels of a
    picture a latent stands for, each way."""

    scheduler: SchedulerConfig
    side: int
    reduction: int

    @property
    def kind(self) -> Kind:
        """What the network predicts."""
        return self.scheduler.kind


class LatentPrior(nnx.Module):
    """Denoiser of (B, H, W, 4) latents: the network, and the schedule it was trained with."""

    def __init__(self, network: unet.UNet, config: LatentPriorConfig):
        self.network, self.config = network, config
        self.schedule = config.scheduler.schedule()

    def __call__(self, noisy: Array, time: Array, condition: TextStates) -> Array:
        """Predicts what `config.kind` says of `noisy` at `time` (B,) in [0, 1]."""
        dtype = self.network.conv_in.kernel[...].dtype
        step = self.schedule.index(time)
        prediction = self.network(noisy.astype(dtype), step, condition.states.astype(dtype))
        return prediction.astype(noisy.dtype)


class StableDiffusionGuide(NamedTuple):
    """The prior, the encoder of pictures and the prompt: states (5, T, D) are those of its four
    `VIEWS` and of the negative prompt."""

    prior: LatentPrior
    encoder: autoencoder.Encoder
    states: Array

    @property
    def resolution(self) -> int:
        return self.prior.config.side * self.prior.config.reduction

    def distil(
        self,
        images: Array,
        azimuth: Array,
        elevation: Array,
        key: Array,
        config: DistillationConfig,
        progress: Array | float,
    ) -> Distillation:
        """See `ImageGuide`. The gradient passes through the encoder, never through the denoiser."""
        encode_key, key = jax.random.split(key)
        keys = jax.random.split(encode_key, images.shape[0])
        # One picture at a time: what the encoder computes at 512 x 512 is the largest of all.
        latents = jax.lax.map(lambda pair: encode_picture(self.encoder, *pair), (images, keys))
        states, negatives = self.states[view_index(azimuth, elevation)], None
        if config.perp_neg:
            mixture = view_mixture(azimuth, elevation).astype(states.dtype)
            states = jnp.einsum("vb,vtd->btd", mixture, self.states[: len(VIEWS)])
            front, side = (TextStates(jnp.broadcast_to(s, states.shape)) for s in self.states[:2])
            negatives = Negatives((front, side), unwanted_views(azimuth, elevation))
        told = TextStates(states)
        untold = TextStates(jnp.broadcast_to(self.states[-1], states.shape))
        return score_distillation(
            self.prior, latents, told, untold, key, config, progress, negatives
        )


def encode_picture(encoder: autoencoder.Encoder, image: Array, key: Array) -> Array:
    """A sample (h, w, 4) of the latents of a picture (H, W, 3) in [0, 1], scaled to unit spread."""
    dtype = encoder.encoder.conv_in.kernel[...].dtype
    mean, log_variance = encoder((2.0 * image - 1.0)[None].astype(dtype))
    mean, log_variance = mean[0].astype(image.dtype), log_variance[0].astype(image.dtype)
    noise = jax.random.normal(key, mean.shape, image.dtype)
    return (mean + jnp.exp(0.5 * log_variance) * noise) * encoder.config.scaling_factor


def view_index(azimuth: Array, elevation: Array) -> Array:
    """Which of `VIEWS` a camera sees: the front up to 45 degrees from +x, the back beyond 135."""
    away = away_from_front(azimuth)
    around = jnp.where(away < jnp.pi / 4, 0, jnp.where(away > 3 * jnp.pi / 4, 2, 1))
    return jnp.where(elevation > OVERHEAD, 3, around)


def load_prior(
    folder: Path, *, dtype: jnp.dtype | str = jnp.bfloat16, attention_slice: int | None = None
) -> LatentPrior:
    """The denoiser of a checkpoint folder with its schedule.

    Args:
        folder: in diffusers' layout, with `unet/` and `scheduler/`.
        dtype: of the weights and the computation.
        attention_slice: queries at a time, see `attend`; less memory, some more time.

    Raises:
        InputError: a file is missing, damaged, or of another network.
    """
    scheduler = load_scheduler(folder)
    source = Path(folder) / "unet"
    config = unet.UNetConfig.from_json(
        read_json(source / "config.json") | {"attention_slice": attention_slice},
        str(source / "config.json"),
    )
    network = fill(
        lambda: unet.UNet(config),
        open_arrays(source, "diffusion_pytorch_model"),
        source=str(source),
        renames=unet.RENAMES,
        dtype=dtype,
    )
    vae = _autoencoder_config(folder)
    reduction = 2 ** (len(vae.block_out_channels) - 1)
    return LatentPrior(network, LatentPriorConfig(scheduler, config.sample_size, reduction))


def load_scheduler(folder: Path) -> SchedulerConfig:
    """What `scheduler/scheduler_config.json` says. Raises InputError as `SchedulerConfig`."""
    source = Path(folder) / "scheduler" / "scheduler_config.json"
    return SchedulerConfig.from_json(read_json(source), str(source))


def _autoencoder_config(
    folder: Path, attention_slice: int | None = None
) -> autoencoder.AutoencoderConfig:
    source = Path(folder) / "vae" / "config.json"
    return autoencoder.AutoencoderConfig.from_json(
        read_json(source) | {"attention_slice": attention_slice}, str(source)
    )


def _load_autoencoder(part, ignores, folder: Path, dtype, attention_slice: int | None):
    config = _autoencoder_config(folder, attention_slice)
    source = Path(folder) / "vae"
    return fill(
        lambda: part(config),
        open_arrays(source, "diffusion_pytorch_model"),
        source=str(source),
        renames=autoencoder.RENAMES,
        ignore=ignores,
        dtype=dtype,
    )


def load_encoder(
    folder: Path, *, dtype: jnp.dtype | str = jnp.bfloat16, attention_slice: int | None = None
) -> autoencoder.Encoder:
    """Pictures to latents, from `vae/`; arguments and errors as for `load_prior`."""
    ignores = autoencoder.ENCODER_IGNORES
    return _load_autoencoder(autoencoder.Encoder, ignores, folder, dtype, attention_slice)


def load_decoder(
    folder: Path, *, dtype: jnp.dtype | str = jnp.bfloat16, attention_slice: int | None = None
) -> autoencoder.Decoder:
    """Latents to pictures, from `vae/`; arguments and errors as for `load_prior`."""
    ignores = autoencoder.DECODER_IGNORES
    return _load_autoencoder(autoencoder.Decoder, ignores, folder, dtype, attention_slice)


def encode_texts(folder: Path, texts: Sequence[str]) -> Array:
    """(B, T, D) float32 states of texts, by `tokenizer/` and `text_encoder/`, which are read, used
    once and dropped. Errors as for `load_prior`."""
    source = Path(folder) / "text_encoder"
    config = clip_text.TextConfig.from_json(
        read_json(source / "config.json"), str(source / "config.json")
    )
    tower = clip_text.load_text_tower(open_arrays(source), config, str(source), jnp.float32)
    ids = ClipTokenizer(Path(folder) / "tokenizer")(texts)
    return _hidden(tower, jnp.asarray(ids))


@nnx.jit
def _hidden(tower: clip_text.TextTower, ids: Array) -> Array:
    return tower(ids).hidden


def stable_diffusion_guide(
    prompt: str,
    folder: Path,
    *,
    negative: str = "",
    dtype: jnp.dtype | str = jnp.bfloat16,
    attention_slice: int | None = None,
) -> StableDiffusionGuide:
    """The guide of a prompt, which is completed by the view of each picture.

    Args:
        prompt: what to make.
        folder: in diffusers' layout.
        negative: what to move away from.
        dtype, attention_slice: see `load_prior`.

    Raises:
        InputError: as `load_prior`.
    """
    states = encode_texts(folder, [*(f"{prompt}, {view}" for view in VIEWS), negative])
    options: dict[str, Any] = {"dtype": dtype, "attention_slice": attention_slice}
    return StableDiffusionGuide(
        load_prior(folder, **options), load_encoder(folder, **options), states
    )

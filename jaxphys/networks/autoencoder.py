"""Pictures to latents and back: the two halves of Stable Diffusion's variational autoencoder
(Rombach et al. 2022; Kingma & Welling 2014). Each can be filled without the other."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.networks import transformer
from jaxphys.networks.diffusers_config import LAYERS, NUMBER, SIZE, DiffusersConfig
from jaxphys.networks.layers import Conv2d, GroupNorm, Linear
from jaxphys.networks.resnet import COSTLY, Downsample, ResnetBlock, Upsample
from jaxphys.networks.transformer import Attention

# The files of Stable Diffusion 1 and 2 have the first four names, later ones those of the UNet.
RENAMES = (
    (r"\.attentions\.0\.query\.", ".attentions.0.to_q."),
    (r"\.attentions\.0\.key\.", ".attentions.0.to_k."),
    (r"\.attentions\.0\.value\.", ".attentions.0.to_v."),
    (r"\.attentions\.0\.proj_attn\.", ".attentions.0.to_out."),
    *transformer.RENAMES,
)
ENCODER_IGNORES = (r"decoder\..*", r"post_quant_conv\..*")
DECODER_IGNORES = (r"encoder\..*", r"quant_conv\..*")

EPSILON = 1e-6  # of all norms
LOG_VARIANCE = (-30.0, 20.0)  # what the encoder may say


@dataclass(frozen=True)
class AutoencoderConfig(DiffusersConfig):
    """`vae/config.json`. The denoiser's latents are `scaling_factor` times the encoder's."""

    CLASS_NAME = "AutoencoderKL"
    DOWN_BLOCKS = ("DownEncoderBlock2D",)
    UP_BLOCKS = ("UpDecoderBlock2D",)
    PLAIN = {  # noqa: RUF012
        "act_fn": ("silu", "swish"),
        "mid_block_add_attention": (True,),
        "use_quant_conv": (True,),
        "use_post_quant_conv": (True,),
    }
    IDLE = ("dropout", "force_upcast", "sample_size")

    in_channels: int = field(default=3, metadata=SIZE)
    out_channels: int = field(default=3, metadata=SIZE)
    latent_channels: int = field(default=4, metadata=SIZE)
    block_out_channels: tuple[int, ...] = field(default=(64,), metadata=SIZE)
    layers_per_block: int = field(default=1, metadata=LAYERS)
    down_block_types: tuple[str, ...] = DOWN_BLOCKS
    up_block_types: tuple[str, ...] = UP_BLOCKS
    norm_num_groups: int = field(default=32, metadata=SIZE)
    scaling_factor: float = field(default=0.18215, metadata=NUMBER)
    attention_slice: int | None = field(default=None, metadata=SIZE)


def _resnets(inputs: int, outputs: int, count: int, config: AutoencoderConfig) -> nnx.List:
    widths = [inputs] + [outputs] * (count - 1)
    groups = config.norm_num_groups
    return nnx.List(
        [ResnetBlock(width, outputs, groups=groups, epsilon=EPSILON) for width in widths]
    )


def _through(blocks: Sequence[nnx.Module], x: Array) -> Array:
    """One block after the other. A gradient computes the inside of each again, but for the
    convolutions: at full size, the insides of all would take gigabytes."""
    policy = jax.checkpoint_policies.save_only_these_names(COSTLY)
    for block in blocks:
        x = jax.checkpoint(block, policy=policy)(x)
    return x


class PixelAttention(Attention):
    """x + attention of one head among the pixels of (B, H, W, C)."""

    def __init__(self, width: int, config: AutoencoderConfig):
        super().__init__(width, width, 1, bias=True, slice_size=config.attention_slice)
        self.group_norm = GroupNorm(config.norm_num_groups, width, epsilon=EPSILON)

    def __call__(self, x: Array) -> Array:
        tokens = self.group_norm(x).reshape(x.shape[0], -1, x.shape[-1])
        return x + self.from_to(tokens, tokens).reshape(x.shape)


class EncoderBlock(nnx.Module):
    """Resnets, then half the size."""

    def __init__(self, inputs: int, outputs: int, config: AutoencoderConfig, *, last: bool):
        self.resnets = _resnets(inputs, outputs, config.layers_per_block, config)
        padding = ((0, 1), (0, 1))
        self.downsamplers = nnx.List([] if last else [Downsample(outputs, padding=padding)])

    def __call__(self, x: Array) -> Array:
        return _through([*self.resnets, *self.downsamplers], x)


class AttentiveBlock(nnx.Module):
    """A resnet, attention, a resnet, at the smallest size."""

    def __init__(self, width: int, config: AutoencoderConfig):
        self.resnets = _resnets(width, width, 2, config)
        self.attentions = nnx.List([PixelAttention(width, config)])

    def __call__(self, x: Array) -> Array:
        return _through([self.resnets[0], self.attentions[0], self.resnets[1]], x)


class DecoderBlock(nnx.Module):
    """Resnets, one more than on the way down, then twice the size."""

    def __init__(self, inputs: int, outputs: int, config: AutoencoderConfig, *, last: bool):
        self.resnets = _resnets(inputs, outputs, config.layers_per_block + 1, config)
        self.upsamplers = nnx.List([] if last else [Upsample(outputs)])

    def __call__(self, x: Array) -> Array:
        return _through([*self.resnets, *self.upsamplers], x)


class DownStack(nnx.Module):
    """Pictures (B, H, W, 3) to what the latents' distribution is read from."""

    def __init__(self, config: AutoencoderConfig):
        widths = config.block_out_channels
        final = len(widths) - 1
        self.conv_in = Conv2d(config.in_channels, widths[0])
        inputs = (widths[0], *widths)
        self.down_blocks = nnx.List(
            [EncoderBlock(inputs[i], widths[i], config, last=i == final) for i in range(final + 1)]
        )
        self.mid_block = AttentiveBlock(widths[-1], config)
        self.conv_norm_out = GroupNorm(config.norm_num_groups, widths[-1], epsilon=EPSILON)
        self.conv_out = Conv2d(widths[-1], 2 * config.latent_channels)

    def __call__(self, x: Array) -> Array:
        x = self.conv_in(x)
        for block in self.down_blocks:
            x = block(x)
        return self.conv_out(jax.nn.silu(self.conv_norm_out(self.mid_block(x))))


class UpStack(nnx.Module):
    """Latents to pictures (B, H, W, 3)."""

    def __init__(self, config: AutoencoderConfig):
        widths = config.block_out_channels[::-1]
        final = len(widths) - 1
        self.conv_in = Conv2d(config.latent_channels, widths[0])
        self.mid_block = AttentiveBlock(widths[0], config)
        inputs = (widths[0], *widths)
        self.up_blocks = nnx.List(
            [DecoderBlock(inputs[i], widths[i], config, last=i == final) for i in range(final + 1)]
        )
        self.conv_norm_out = GroupNorm(config.norm_num_groups, widths[-1], epsilon=EPSILON)
        self.conv_out = Conv2d(widths[-1], config.out_channels)

    def __call__(self, x: Array) -> Array:
        x = self.mid_block(self.conv_in(x))
        for block in self.up_blocks:
            x = block(x)
        return self.conv_out(jax.nn.silu(self.conv_norm_out(x)))


class Encoder(nnx.Module):
    """Fill with `ignore=ENCODER_IGNORES`."""

    def __init__(self, config: AutoencoderConfig):
        self.config = config
        self.encoder = DownStack(config)
        self.quant_conv = Linear(2 * config.latent_channels, 2 * config.latent_channels)

    def __call__(self, images: Array) -> tuple[Array, Array]:
        """Mean and log-variance (B, H/8, W/8, 4) of the latents of pictures (B, H, W, 3) in [-1,
        1]; 8 stands for two to the number of blocks less one. Not scaled by `scaling_factor`."""
        mean, log_variance = jnp.split(self.quant_conv(self.encoder(images)), 2, axis=-1)
        return mean, jnp.clip(log_variance, *LOG_VARIANCE)


class Decoder(nnx.Module):
    """Fill with `ignore=DECODER_IGNORES`."""

    def __init__(self, config: AutoencoderConfig):
        self.config = config
        self.post_quant_conv = Linear(config.latent_channels, config.latent_channels)
        self.decoder = UpStack(config)

    def __call__(self, latents: Array) -> Array:
        """Pictures (B, 8 H, 8 W, 3), about in [-1, 1], of latents (B, H, W, 4) as the encoder has
        them, not scaled."""
        return self.decoder(self.post_quant_conv(latents))

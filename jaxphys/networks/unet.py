"""The denoiser of Stable Diffusion 1 and 2: a U-Net (Ronneberger et al. 2015) over latents that
reads a text between its convolutions (Rombach et al. 2022)."""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.networks import transformer
from jaxphys.networks.diffusers_config import LAYERS, NUMBER, SIZE, DiffusersConfig
from jaxphys.networks.layers import Conv2d, GroupNorm
from jaxphys.networks.resnet import Downsample, ResnetBlock, Upsample
from jaxphys.networks.timestep import TimestepEmbedding, waves
from jaxphys.networks.transformer import SpatialTransformer

RENAMES = transformer.RENAMES
DOWN_READING, UP_READING = "CrossAttnDownBlock2D", "CrossAttnUpBlock2D"  # those that read the text


@dataclass(frozen=True)
class UNetConfig(DiffusersConfig):
    """`unet/config.json`. The file's `attention_head_dim` is not a width: it is the number of heads
    of each block, one for all or one a block."""

    CLASS_NAME = "UNet2DConditionModel"
    DOWN_BLOCKS = (DOWN_READING, "DownBlock2D")
    UP_BLOCKS = (UP_READING, "UpBlock2D")
    PLAIN = {  # noqa: RUF012
        "act_fn": ("silu", "swish"),
        "attention_type": ("default",),
        "conv_in_kernel": (3,),
        "conv_out_kernel": (3,),
        "downsample_padding": (1,),
        "mid_block_scale_factor": (1,),
        "mid_block_type": ("UNetMidBlock2DCrossAttn",),
        "resnet_out_scale_factor": (1,),
        "resnet_time_scale_shift": ("default",),
        "time_embedding_type": ("positional",),
        "transformer_layers_per_block": (1,),
    }
    # The projections' layout shows in the arrays; scores are computed wide in any case; the last
    # belongs to an option that is refused.
    IDLE = (
        "dropout",
        "use_linear_projection",
        "upcast_attention",
        "addition_embed_type_num_heads",
    )

    sample_size: int = field(default=64, metadata=SIZE)
    in_channels: int = field(default=4, metadata=SIZE)
    out_channels: int = field(default=4, metadata=SIZE)
    block_out_channels: tuple[int, ...] = field(default=(320, 640, 1280, 1280), metadata=SIZE)
    layers_per_block: int = field(default=2, metadata=LAYERS)
    down_block_types: tuple[str, ...] = (DOWN_READING,) * 3 + ("DownBlock2D",)
    up_block_types: tuple[str, ...] = ("UpBlock2D",) + (UP_READING,) * 3
    attention_head_dim: int | tuple[int, ...] = field(default=8, metadata=SIZE)
    cross_attention_dim: int = field(default=1280, metadata=SIZE)
    norm_num_groups: int = field(default=32, metadata=SIZE)
    norm_eps: float = field(default=1e-5, metadata=NUMBER)
    flip_sin_to_cos: bool = True
    freq_shift: float = field(default=0, metadata=NUMBER)
    attention_slice: int | None = field(default=None, metadata=SIZE)

    def __post_init__(self):
        super().__post_init__()
        if len(self.heads) != len(self.block_out_channels):
            raise InputError(
                f"attention_head_dim: {len(self.heads)} blocks, but block_out_channels has"
                f" {len(self.block_out_channels)}"
            )
        for heads, width in zip(self.heads, self.block_out_channels, strict=True):
            if width % heads:
                raise InputError(f"attention_head_dim: {heads} heads do not divide {width}")

    @property
    def heads(self) -> tuple[int, ...]:
        """Of each block."""
        if isinstance(self.attention_head_dim, tuple):
            return self.attention_head_dim
        return (self.attention_head_dim,) * len(self.block_out_channels)

    @property
    def time(self) -> int:
        """Width of what the blocks are told of the step."""
        return 4 * self.block_out_channels[0]


def _resnet(inputs: int, outputs: int, config: UNetConfig) -> ResnetBlock:
    return ResnetBlock(
        inputs, outputs, groups=config.norm_num_groups, epsilon=config.norm_eps, time=config.time
    )


def _transformer(width: int, heads: int, config: UNetConfig) -> SpatialTransformer:
    return SpatialTransformer(
        width,
        config.cross_attention_dim,
        heads,
        groups=config.norm_num_groups,
        slice_size=config.attention_slice,
    )


class DownBlock(nnx.Module):
    """Resnets, each followed by a transformer in blocks that read, then half the size."""

    def __init__(
        self, inputs: int, outputs: int, config: UNetConfig, *, heads: int, reads: bool, last: bool
    ):
        widths = [inputs] + [outputs] * (config.layers_per_block - 1)
        self.resnets = nnx.List([_resnet(width, outputs, config) for width in widths])
        self.attentions = nnx.List([_transformer(outputs, heads, config) for _ in widths if reads])
        self.downsamplers = nnx.List([] if last else [Downsample(outputs)])

    def __call__(self, x: Array, time: Array, states: Array) -> list[Array]:
        """The results of all steps, which the way up reads; the last is what comes out."""
        passed = []
        for number, resnet in enumerate(self.resnets):
            x = resnet(x, time)
            if self.attentions:
                x = self.attentions[number](x, states)
            passed.append(x)
        for downsample in self.downsamplers:
            passed.append(downsample(passed[-1]))
        return passed


class MiddleBlock(nnx.Module):
    """A resnet, a transformer, a resnet, at the smallest size."""

    def __init__(self, width: int, config: UNetConfig, *, heads: int):
        self.resnets = nnx.List([_resnet(width, width, config) for _ in range(2)])
        self.attentions = nnx.List([_transformer(width, heads, config)])

    def __call__(self, x: Array, time: Array, states: Array) -> Array:
        x = self.attentions[0](self.resnets[0](x, time), states)
        return self.resnets[1](x, time)


class UpBlock(nnx.Module):
    """One resnet more than on the way down; each reads a result from there, the last one first.

    skips: the widths of what is read, in the order of reading.
    """

    def __init__(
        self,
        inputs: int,
        skips: list[int],
        outputs: int,
        config: UNetConfig,
        *,
        heads: int,
        reads: bool,
        last: bool,
    ):
        widths = [inputs] + [outputs] * (len(skips) - 1)
        self.resnets = nnx.List(
            [_resnet(w + skip, outputs, config) for w, skip in zip(widths, skips, strict=True)]
        )
        self.attentions = nnx.List([_transformer(outputs, heads, config) for _ in skips if reads])
        self.upsamplers = nnx.List([] if last else [Upsample(outputs)])

    def __call__(self, x: Array, passed: list[Array], time: Array, states: Array) -> Array:
        """Takes what it reads off the end of `passed`."""
        for number, resnet in enumerate(self.resnets):
            x = resnet(jnp.concatenate([x, passed.pop()], -1), time)
            if self.attentions:
                x = self.attentions[number](x, states)
        for upsample in self.upsamplers:
            height, width = passed[-1].shape[1:3]
            x = upsample(x, (height, width))
        return x


class UNet(nnx.Module):
    """Predicts noise (or velocity: the checkpoint's scheduler says) in latents."""

    def __init__(self, config: UNetConfig):
        self.config = config
        widths, heads = config.block_out_channels, config.heads
        final = len(widths) - 1
        self.conv_in = Conv2d(config.in_channels, widths[0])
        self.time_embedding = TimestepEmbedding(widths[0], config.time)
        x, skips, down, up = widths[0], [widths[0]], [], []
        for i, kind in enumerate(config.down_block_types):
            reads = kind == DOWN_READING
            down.append(
                DownBlock(x, widths[i], config, heads=heads[i], reads=reads, last=i == final)
            )
            x = widths[i]
            skips += [x] * (config.layers_per_block + (i < final))
        self.mid_block = MiddleBlock(x, config, heads=heads[-1])
        for i, kind in zip(range(final, -1, -1), config.up_block_types, strict=True):
            read = [skips.pop() for _ in range(config.layers_per_block + 1)]
            reads = kind == UP_READING
            up.append(UpBlock(x, read, widths[i], config, heads=heads[i], reads=reads, last=i == 0))
            x = widths[i]
        self.down_blocks, self.up_blocks = nnx.List(down), nnx.List(up)
        self.conv_norm_out = GroupNorm(config.norm_num_groups, x, epsilon=config.norm_eps)
        self.conv_out = Conv2d(x, config.out_channels)

    def __call__(self, latents: Array, step: Array, states: Array) -> Array:
        """
        Args:
            latents: noisy, (B, H, W, in_channels); sizes that cannot be halved are rounded up.
            step: (B,) of the noise table, 0 to 999; need not be whole.
            states: (B, T, cross_attention_dim), the text encoder's answer.

        Returns:
            (B, H, W, out_channels), in the dtype of `latents`.
        """
        features = waves(
            step,
            self.config.block_out_channels[0],
            flip_sin_to_cos=self.config.flip_sin_to_cos,
            freq_shift=self.config.freq_shift,
        )
        time = self.time_embedding(features.astype(latents.dtype))
        passed = [self.conv_in(latents)]
        for going_down in self.down_blocks:
            passed += going_down(passed[-1], time, states)
        x = self.mid_block(passed[-1], time, states)
        for going_up in self.up_blocks:
            x = going_up(x, passed, time, states)
        return self.conv_out(jax.nn.silu(self.conv_norm_out(x)))

"""Time and memory of one whole step of distillation with Stable Diffusion 1.5 at its full size, on
random weights in bfloat16: splats are drawn at 512 x 512, encoded, judged, and moved.

    python -m experiments.parity.full_step [--views 1] [--slice 1024] [--repeats 2]
"""

import argparse
import resource
import time
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx

from experiments.parity.full_size import random_weights
from jaxphys.gaussians.gaussians import from_points
from jaxphys.guidance.bundled.point_guide import bundled_shape_guide
from jaxphys.guidance.choice import LATENT
from jaxphys.guidance.guides import Guides
from jaxphys.guidance.optimise import advance, start
from jaxphys.guidance.pictures import neighbour_sizes, room_for_pairs
from jaxphys.guidance.published.scheduler_config import SchedulerConfig
from jaxphys.guidance.published.stable_diffusion import (
    LatentPrior,
    LatentPriorConfig,
    StableDiffusionGuide,
)
from jaxphys.networks.autoencoder import AutoencoderConfig, Encoder
from jaxphys.networks.unet import UNet, UNetConfig

GIB = 2**30
STABLE_DIFFUSION = SchedulerConfig(
    beta_schedule="scaled_linear", beta_start=0.00085, beta_end=0.012, clip_sample=False
)


def peak() -> float:
    """The most memory that the process has held so far [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIB


def full_guide(attention_slice: int | None) -> StableDiffusionGuide:
    """The published sizes, random weights and random text states."""
    options = {"attention_slice": attention_slice}
    unet = nnx.merge(
        *random_weights(lambda: UNet(UNetConfig(cross_attention_dim=768, **options)), 0)
    )
    vae = AutoencoderConfig(
        block_out_channels=(128, 256, 512, 512),
        layers_per_block=2,
        down_block_types=AutoencoderConfig.DOWN_BLOCKS * 4,
        up_block_types=AutoencoderConfig.UP_BLOCKS * 4,
        **options,
    )
    encoder = nnx.merge(*random_weights(lambda: Encoder(vae), 1))
    prior = LatentPrior(unet, LatentPriorConfig(STABLE_DIFFUSION, 64, 8))
    return StableDiffusionGuide(prior, encoder, jax.random.normal(jax.random.key(2), (5, 77, 768)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--views", type=int, default=1, help="pictures a step")
    parser.add_argument("--slice", type=int, default=1024, help="queries at a time")
    parser.add_argument("--repeats", type=int, default=2)
    asked = parser.parse_args()
    config = replace(LATENT, views=asked.views)
    guides = Guides(full_guide(asked.slice), bundled_shape_guide("a ball"))
    points = np.random.default_rng(0).normal(size=(config.count, 3))
    points = 0.4 * points / np.linalg.norm(points, axis=1, keepdims=True)
    colours = np.full((config.count, 3), 0.5)
    cloud = from_points(
        points.astype(np.float32), colours, neighbour_sizes(points, config.size, config.largest)
    )
    state, key = start(cloud, config), jax.random.key(0)
    room = room_for_pairs(cloud, guides.image.resolution)
    print(f"{config.count} Gaussians, {asked.views} view(s); weights are held at {peak():.2f} GiB")
    for number in range(asked.repeats + 1):
        begin = time.perf_counter()
        following, overflow = advance(guides, state, key, config, room)
        jax.block_until_ready(following)
        what = "first step, with compilation" if number == 0 else "step"
        print(f"{what}: {time.perf_counter() - begin:.1f} s, peak {peak():.2f} GiB", flush=True)
        moved = jnp.abs(following.gaussians.means - state.gaussians.means).max()
        if overflow or not bool(jnp.isfinite(moved)) or moved == 0:
            raise SystemExit(f"the step failed: overflow {bool(overflow)}, moved by {moved}")
        state = following


if __name__ == "__main__":
    main()

"""Encodes objects for the latent prior to learn from: parametric ones new, others as stored.

    python -m experiments.priors.encode --data PREPARED --autoencoder RUN LATENTS.npz
        [--count 60000] [--kinds KIND ...]

LATENTS.npz holds `latents` (count, M, C) float16 and `captions` (count,), drawn as `records.py`
weighs them, and the same of held-out objects under `held_out_latents`, `held_out_captions`.
"""

import argparse
from pathlib import Path

import numpy as np
from flax import nnx
from tqdm import tqdm

from experiments.priors import records
from experiments.priors.clouds import Cloud, cloud_source, held_out_clouds
from experiments.priors.training import trained
from jaxphys.core.files import atomic_path
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, ShapeAutoencoder

POINTS = 4096
BATCH = 32


def encoder_of(network: ShapeAutoencoder):
    """A function: clouds of `POINTS` points -> latents (B, M, C) float16."""
    run = nnx.jit(ShapeAutoencoder.encode)

    def encode(clouds: list[Cloud]) -> np.ndarray:
        read = (
            np.stack([getattr(cloud, name) for cloud in clouds]).astype(np.float32)
            for name in ("points", "normals", "colours")
        )
        return np.asarray(run(network, *read)).astype(np.float16)

    return encode


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--autoencoder", type=Path, required=True, help="folder of its run")
    parser.add_argument("--count", type=int, default=60_000)
    parser.add_argument("--kinds", nargs="*", help="of these parametric kinds alone")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    data = records.load(options.data) if options.data else None
    encode = encoder_of(trained(options.autoencoder, ShapeAutoencoder, AutoencoderConfig))
    source = cloud_source(data, options.kinds, POINTS)
    rng = np.random.default_rng(options.seed)
    latents, captions = [], []
    for _ in tqdm(range(-(-options.count // BATCH)), desc="encode"):
        clouds = source(rng, BATCH)
        latents.append(encode(clouds))
        captions += [cloud.caption for cloud in clouds]
    held_out = held_out_clouds(data, options.kinds, POINTS)
    with atomic_path(options.out) as aside, aside.open("wb") as file:
        np.savez(
            file,
            latents=np.concatenate(latents),
            captions=np.array(captions),
            held_out_latents=encode(held_out),
            held_out_captions=np.array([cloud.caption for cloud in held_out]),
        )


if __name__ == "__main__":
    main()

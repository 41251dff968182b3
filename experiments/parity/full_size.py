"""Time and memory of a step of distillation with Stable Diffusion 1.5 at its full size, on random
weights in bfloat16.

    python -m experiments.parity.full_size [--slice 512] [--repeats 2]
"""

import argparse
import resource
import time

import jax
import jax.numpy as jnp
from flax import nnx

from jaxphys.networks.autoencoder import AutoencoderConfig, Encoder
from jaxphys.networks.unet import UNet, UNetConfig

DTYPE = jnp.bfloat16
GIB = 2**30


def random_weights(build, seed: int):
    """A network's structure, and weights of a size that keeps activations near 1."""
    graph, shapes = nnx.split(nnx.eval_shape(build))
    leaves, structure = jax.tree_util.tree_flatten(shapes)
    keys = jax.random.split(jax.random.key(seed), len(leaves))

    def draw(key, leaf):
        if leaf.ndim == 1:  # scales and biases alike
            return jnp.ones(leaf.shape, DTYPE)
        scale = (leaf.size / leaf.shape[-1]) ** -0.5
        return scale * jax.random.normal(key, leaf.shape, DTYPE)

    return graph, structure.unflatten([draw(*pair) for pair in zip(keys, leaves, strict=True)])


def measure(name: str, function, arguments: tuple, repeats: int) -> None:
    """Prints the time to compile, of the best run, the processor's time over its cores, and the
    most memory that the process has held so far."""
    start = time.perf_counter()
    compiled = jax.jit(function).lower(*arguments).compile()
    compiling = time.perf_counter() - start
    runs = []
    for _ in range(repeats):
        start, used = time.perf_counter(), time.process_time()
        jax.block_until_ready(compiled(*arguments))
        runs.append((time.perf_counter() - start, time.process_time() - used))
    wall, processor = (min(column) for column in zip(*runs, strict=True))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIB
    inside = compiled.memory_analysis().temp_size_in_bytes / GIB
    print(
        f"{name}: compiled in {compiling:.0f} s, runs in {wall:.1f} s ({processor:.1f} s of"
        f" processor), temporaries {inside:.2f} GiB, peak of the process {peak:.2f} GiB",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--slice", type=int, help="queries at a time; all by default")
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--only", choices=("unet", "encoder"))
    asked = parser.parse_args()
    config = UNetConfig(cross_attention_dim=768, attention_slice=asked.slice)
    vae = AutoencoderConfig(
        block_out_channels=(128, 256, 512, 512),
        layers_per_block=2,
        down_block_types=("DownEncoderBlock2D",) * 4,
        up_block_types=("UpDecoderBlock2D",) * 4,
        attention_slice=asked.slice,
    )
    unet_graph, unet_weights = random_weights(lambda: UNet(config), 0)
    encoder_graph, encoder_weights = random_weights(lambda: Encoder(vae), 1)
    key = jax.random.key(2)

    def denoise(weights, latents, step, states):
        return nnx.merge(unet_graph, weights)(latents, step, states)

    def encode(weights, images, cotangents):
        latents, pull = jax.vjp(nnx.merge(encoder_graph, weights), images)
        return latents, pull(cotangents)[0]

    latents = jax.random.normal(key, (2, 64, 64, 4), DTYPE)
    states = jax.random.normal(key, (2, 77, 768), DTYPE)
    step = jnp.array([500, 500])
    images = jax.random.uniform(key, (1, 512, 512, 3), DTYPE, -1.0, 1.0)
    if asked.only != "encoder":
        arguments = (unet_weights, latents, step, states)
        measure("UNet, 2 x 64 x 64", denoise, arguments, asked.repeats)
    if asked.only != "unet":
        arguments = (encoder_weights, images, (latents[:1], latents[:1]))
        measure("encoder and its gradient, 1 x 512 x 512", encode, arguments, asked.repeats)


if __name__ == "__main__":
    main()

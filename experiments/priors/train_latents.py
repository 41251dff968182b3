"""Trains the latent prior.

    python -m experiments.priors.train_latents --latents LATENTS.npz --autoencoder RUN --run RUN

Stop it at any time; the same command goes on from the newest checkpoint.
"""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from experiments.priors import prompts
from experiments.priors.denoising import denoising_evaluator, denoising_loss
from experiments.priors.dots import dot_rows
from experiments.priors.phrases import PHRASES, PhraseEncoder, drop_phrases
from experiments.priors.training import Task, arguments, train, trained
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.latent_prior import (
    LatentCondition,
    LatentPrior,
    LatentPriorConfig,
    sample_latents,
)
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, ShapeAutoencoder
from jaxphys.guidance.bundled.surface import surface_points
from jaxphys.guidance.bundled.text_encoder import load_text_encoder

SHOWN_POINTS = 3000


def prepare(batch: dict[str, Array], key: Array) -> tuple[Array, LatentCondition]:
    del key
    return batch["latents"].astype(jnp.float32), LatentCondition(batch["text"])


def sheet(network: ShapeAutoencoder, text: np.ndarray, seed: int):
    """A function that draws the surface of a sample of each prompt from the front and the back."""

    def picture(prior: LatentPrior) -> np.ndarray:
        clouds = []
        for latents in sample_latents(prior, jnp.asarray(text), jax.random.key(seed)):
            try:
                points, _, colours = surface_points(network, latents, SHOWN_POINTS)
            except InputError:  # early in training there may be none
                points, colours = np.zeros((1, 3)), np.zeros((1, 3))
            clouds.append((points, colours))
        return dot_rows(clouds)

    return picture


def main() -> None:
    parser = arguments(__doc__, batch=64, steps=12_000)
    parser.add_argument("--latents", type=Path, required=True, help="what encode.py made")
    parser.add_argument("--autoencoder", type=Path, required=True, help="folder of its run")
    options = parser.parse_args()
    encode = PhraseEncoder(load_text_encoder())
    with np.load(options.latents) as file:
        latents, captions = file["latents"], file["captions"]
        held_out, held_out_captions = file["held_out_latents"], file["held_out_captions"]
    mean = latents.mean(0, dtype=np.float32)
    deviation = latents.std(0, dtype=np.float32) + 1e-3

    def framed(chosen: np.ndarray) -> np.ndarray:
        return ((chosen.astype(np.float32) - mean) / deviation).astype(np.float32)

    def draw(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
        chosen = rng.integers(0, len(latents), count)
        text = encode([str(caption) for caption in captions[chosen]])
        return {"latents": framed(latents[chosen]), "text": drop_phrases(text, rng)}

    network = trained(options.autoencoder, ShapeAutoencoder, AutoencoderConfig)
    config = LatentPriorConfig(
        latents=latents.shape[1],
        channels=latents.shape[2],
        phrases=PHRASES,
        dtype=options.dtype,
    )
    module = LatentPrior(config, rngs=nnx.Rngs(options.seed))
    module.mean[...], module.deviation[...] = jnp.asarray(mean), jnp.asarray(deviation)
    kept_out = {"latents": framed(held_out), "text": encode([str(c) for c in held_out_captions])}
    task = Task(
        module=module,
        draw=draw,
        loss=denoising_loss(prepare),
        evaluate=denoising_evaluator(module, prepare, kept_out),
        picture=sheet(network, encode((*prompts.PROMPTS, *prompts.ATTRIBUTES)), options.seed),
    )
    train(task, options)


if __name__ == "__main__":
    main()

"""Trains the scorer: pictures and captions towards each other on the sphere.

    python -m experiments.scorer.train DATA --out WEIGHTS.safetensors [--steps 800] [--batch 64]

DATA is what `experiments.scorer.renders` wrote. The averaged weights are written every 50 steps,
with all that the next step depends on beside them (WEIGHTS.checkpoints): the same command goes on.
"""

import argparse
import json
import time
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from flax import nnx
from jax import Array

from experiments.scorer.augment import augment
from experiments.scorer.evaluate import held_out_report
from experiments.scorer.model import Scorer, ScorerConfig, save
from jaxphys.core.checkpoints import Checkpoints, by_name, fingerprint, from_names
from jaxphys.guidance.bundled.text_encoder import load_text_encoder
from jaxphys.networks.parameters import named_parameters, with_parameters

DECAY = 0.98  # of the averaged weights
SHARPEST = 4.0  # largest logarithm of the factor on the cosines
SAVE_EVERY = 50  # steps


class Captions(NamedTuple):
    """All captions: unit vectors (C, D), and of each item its numbers and its subject's number."""

    vectors: np.ndarray
    of_item: list[np.ndarray]
    subject: np.ndarray


def read_captions(items: list[dict]) -> Captions:
    """Items with the same first, most general caption have the same subject."""
    distinct = sorted({caption for item in items for caption in item["captions"]})
    number = {caption: k for k, caption in enumerate(distinct)}
    return Captions(
        load_text_encoder()(distinct),
        [np.array([number[caption] for caption in item["captions"]]) for item in items],
        np.array([number[item["captions"][0]] for item in items]),
    )


def contrastive_loss(
    pictures: Array, texts: Array, belongs: Array, sharpness: Array | float
) -> Array:
    """Mean cross-entropy, pictures to texts and texts to pictures, of the softmax over the batch.

    As CLIP (Radford et al. 2021), but a batch holds several items of one subject: all pairs of
    `belongs` (B, B) are right, and the log-probability is averaged over a row's right ones (Khosla
    et al. 2020, eq. 2). pictures, texts: unit vectors (B, D).
    """
    logits = sharpness * pictures @ texts.T
    right = belongs.astype(logits.dtype)

    def one_way(logits: Array, right: Array) -> Array:
        chance = jax.nn.log_softmax(logits, axis=1)
        return -(right * chance).sum(1) / right.sum(1)

    return 0.5 * (one_way(logits, right).mean() + one_way(logits.T, right.T).mean())


class State(NamedTuple):
    """All that the next step depends on besides the data and the options."""

    parameters: dict[str, Array]
    average: dict[str, Array]
    optimiser: optax.OptState
    step: Array


def make_step(module: Scorer, transform: optax.GradientTransformation, options):
    """A jitted step: state, RGBA pictures (B, 64, 64, 4), their captions' vectors and subjects."""

    def loss(parameters, images, texts, subject, key):
        scorer = with_parameters(module, parameters)
        vectors = scorer(augment(images, key).astype(options.dtype))
        belongs = subject[:, None] == subject[None]
        sharpness = jnp.exp(jnp.minimum(scorer.log_sharpness[...], SHARPEST))
        return contrastive_loss(vectors, texts, belongs, sharpness)

    @jax.jit
    def step(state: State, images, texts, subject) -> tuple[State, Array]:
        key = jax.random.fold_in(jax.random.key(options.seed), state.step)
        value, gradient = jax.value_and_grad(loss)(state.parameters, images, texts, subject, key)
        updates, optimiser = transform.update(gradient, state.optimiser, state.parameters)
        parameters = optax.apply_updates(state.parameters, updates)
        mix = jnp.minimum(DECAY, (1.0 + state.step) / (10.0 + state.step))
        average = jax.tree.map(lambda a, p: mix * a + (1 - mix) * p, state.average, parameters)
        return State(parameters, average, optimiser, state.step + 1), value

    return step


def draw_batch(
    images: np.ndarray, captions: Captions, batch: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One picture of each of `batch` objects, with its most general caption or any other."""
    item = rng.choice(len(images), batch, replace=False)
    other = [rng.choice(captions.of_item[k]) for k in item]
    text = np.where(rng.random(batch) < 0.5, captions.subject[item], other)
    view = rng.integers(images.shape[1], size=batch)
    return images[item, view], captions.vectors[text], captions.subject[item]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=800)
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dtype", default="bfloat16")
    options = parser.parse_args()
    items = json.loads((options.data / "train.json").read_text())
    images = np.load(options.data / "train.npz")["images"]
    captions = read_captions(items)

    config = ScorerConfig()
    module = Scorer(config, rngs=nnx.Rngs(options.seed))
    parameters = named_parameters(module)
    size = sum(value.size for value in parameters.values())
    print(f"{len(items)} objects, {size} parameters", flush=True)
    rate = optax.warmup_cosine_decay_schedule(0.0, options.rate, 50, options.steps)
    transform = optax.chain(optax.clip_by_global_norm(1.0), optax.adamw(rate, weight_decay=0.05))
    state = State(parameters, parameters, transform.init(parameters), jnp.zeros((), jnp.int32))
    asked = (items, options.steps, options.batch, options.rate, options.seed, options.dtype)
    checkpoints = Checkpoints(
        options.out.with_suffix(".checkpoints"), fingerprint(json.dumps(asked).encode(), parameters)
    )
    if newest := checkpoints.newest():
        state = from_names(state, newest[1])
    step = make_step(module, transform, options)
    losses, before = [], time.process_time()
    while (count := int(state.step)) < options.steps:
        batch = draw_batch(
            images, captions, options.batch, np.random.default_rng([options.seed, count])
        )
        state, value = step(state, *batch)
        losses.append(float(value))
        if (count + 1) % SAVE_EVERY == 0 or count + 1 == options.steps:
            save(options.out, state.average, config)
            checkpoints.save(count + 1, by_name(state))
            spent = round(time.process_time() - before)
            print(f"step {count + 1}: loss {np.mean(losses):.4f}, {spent} CPU s", flush=True)
            losses = []
    print(held_out_report(options.out, options.data).text)


if __name__ == "__main__":
    main()

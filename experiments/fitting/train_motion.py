"""Trains a prior of motion: what a ball does that falls, made of what a sentence says.

    python -m experiments.fitting.train_motion --data FOLDER --run FOLDER --minutes 60
    python -m experiments.fitting.train_motion --data FOLDER --run FOLDER --export

A clip of nine frames is one picture (`clips.py`), so that the network of the bundled pixel prior
learns it. Clips are simulated once, of stiffnesses all over the range; each time that one is drawn
it gets other colours before another grey. Stop it at any time; the same command goes on.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

from experiments.fitting.clips import (
    ACROSS,
    AZIMUTH,
    ELEVATION,
    PIXELS,
    SENTENCES,
    drawn,
    falling,
    names,
)
from experiments.fitting.scenes import moved
from experiments.priors.denoising import denoising_evaluator, denoising_loss
from experiments.priors.training import Task, arguments, averaged, train
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.pixel_prior import PixelCondition, PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.samplers import karras_times, sample_heun
from jaxphys.guidance.diffusion.schedule import guided
from jaxphys.guidance.views import view_features
from jaxphys.networks.parameters import named_parameters, with_parameters

WEIGHTS = Path(__file__).with_name("motion_prior.safetensors")
CONFIG = PixelPriorConfig(
    resolution=ACROSS * PIXELS, width=128, layers=4, head_width=32, hidden=384, rank=16
)
CLIPS, HELD_OUT = 900, 64
VELOCITY, SPREAD = (0.0, 0.0, -1.5), (0.2, 0.2, 0.5)


def make_clips(path: Path, count: int = CLIPS, seed: int = 0) -> None:
    """Simulates clips: opacity (N, R, R) uint8 and Young's moduli (N,) [Pa], log-uniform."""
    random = np.random.default_rng(seed)
    low, high = min(SENTENCES.values())[0], max(SENTENCES.values())[1]
    stiffness = np.exp(random.uniform(np.log(low), np.log(high), count))
    velocity = VELOCITY + np.array(SPREAD) * random.uniform(-1, 1, (count, 3))
    problem, look = falling(VELOCITY, also_free=True)
    alpha = np.zeros((count, CONFIG.resolution, CONFIG.resolution), np.uint8)
    for i in range(count):
        motion = moved(problem, {"youngs_modulus": stiffness[i], "velocity": velocity[i]})
        alpha[i] = np.round(255 * np.asarray(drawn(look, motion)[1]))
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, alpha=alpha, stiffness=stiffness)


def texts() -> np.ndarray:
    """What the prior is told for each sentence, (S, 1, 384)."""
    return np.stack([np.asarray(prompt_embeddings(sentence, 0)) for sentence in SENTENCES])


def prepare(batch: dict[str, Array], key: Array) -> tuple[Array, PixelCondition]:
    """Clips (B, R, R, 3) in [-1, 1]: a ball of any colour before any grey."""
    front, back = jax.random.split(key)
    alpha = batch["alpha"].astype(jnp.float32)[..., None] / 255
    colour = jax.random.uniform(front, (len(alpha), 1, 1, 3))
    grey = jax.random.uniform(back, (len(alpha), 1, 1, 1))
    return 2 * (alpha * colour + (1 - alpha) * grey) - 1, PixelCondition(
        batch["text"], batch["view"]
    )


def samples(seed: int):
    """A function that draws three samples of each sentence, a column a sentence."""
    told = PixelCondition(np.tile(texts(), (3, 1, 1)), views(3 * len(SENTENCES)))
    untold = told._replace(text=np.zeros_like(told.text))

    @nnx.jit
    def draw(module: PixelPrior) -> Array:
        size = module.config.resolution
        noise = jax.random.normal(jax.random.key(seed), (len(told.text), size, size, 3))

        def denoise(noisy: Array, time: Array) -> Array:
            both = jax.tree.map(lambda *c: jnp.concatenate(c), told, untold)
            clean = module(jnp.tile(noisy, (2, 1, 1, 1)), jnp.tile(time, 2), both)
            return jnp.clip(guided(*jnp.split(clean, 2), 2.0), -1, 1)

        return sample_heun(
            denoise, module.schedule, noise, karras_times(module.schedule, 18, 60.0, 0.03, 7.0)
        )

    def picture(module: PixelPrior) -> np.ndarray:
        size, columns = module.config.resolution, len(SENTENCES)
        found = np.asarray(draw(module)).reshape(3, columns, size, size, 3)
        rows = found.transpose(0, 2, 1, 3, 4).reshape(3 * size, columns * size, 3)
        return (np.clip(0.5 * rows + 0.5, 0, 1) * 255).astype(np.uint8)

    return picture


def views(count: int) -> np.ndarray:
    """Where the camera stands, as the prior is told of it, (B, 4)."""
    view = view_features(np.full(count, AZIMUTH), np.full(count, ELEVATION))
    return view.astype(np.float32)


def export(run: Path) -> None:
    """Writes the averaged weights of a run beside this file, as float16."""
    module = nnx.eval_shape(lambda: PixelPrior(CONFIG, rngs=nnx.Rngs(0)))
    arrays, step = averaged(run, named_parameters(module))
    facts = {"config": json.dumps(dataclasses.asdict(CONFIG)), "steps": str(step)}
    save_file({n: np.asarray(a, np.float16) for n, a in arrays.items()}, WEIGHTS, facts)


def load_motion_prior() -> PixelPrior:
    """The prior of motion that lies beside this file, in float32.

    Raises:
        InputError: it has not been trained.
    """
    if not WEIGHTS.exists():
        raise InputError(f"{WEIGHTS}: no such file; train it (experiments/fitting/train_motion.py)")
    with safe_open(WEIGHTS, "numpy") as file:
        config = PixelPriorConfig(**json.loads(file.metadata()["config"]))
    arrays = {name: jnp.asarray(a, jnp.float32) for name, a in load_file(WEIGHTS).items()}
    module = nnx.eval_shape(lambda: PixelPrior(config, rngs=nnx.Rngs(0)))
    return with_parameters(module, arrays)


def main(given: list[str] | None = None) -> None:
    """Makes the clips, trains, or exports."""
    parser = arguments(__doc__, batch=48, steps=3_000)
    parser.add_argument("--export", action="store_true", help="write the weights beside the script")
    parser.add_argument("--clips", type=int, default=CLIPS, help="how many are simulated")
    options = parser.parse_args(given)
    if options.export:
        export(options.run)
        return
    if options.data is None:
        parser.error("give --data, the folder of the clips")
    path = options.data / "clips.npz"
    if not path.exists():
        make_clips(path, options.clips)
    with np.load(path) as data:
        alpha, which = data["alpha"], names(data["stiffness"])
    told, kept = texts(), len(alpha) - min(HELD_OUT, len(alpha) // 4)

    def gather(index: np.ndarray) -> dict[str, np.ndarray]:
        return {"alpha": alpha[index], "text": told[which[index]], "view": views(len(index))}

    def draw(random: np.random.Generator, count: int) -> dict[str, np.ndarray]:
        return gather(random.integers(kept, size=count))

    module = PixelPrior(CONFIG, rngs=nnx.Rngs(options.seed))
    evaluate: Any = denoising_evaluator(module, prepare, gather(np.arange(kept, len(alpha))))
    train(Task(module, draw, denoising_loss(prepare), evaluate, samples(options.seed)), options)


if __name__ == "__main__":
    main()

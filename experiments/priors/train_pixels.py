"""Trains the pixel prior.

    python -m experiments.priors.train_pixels --data PREPARED --run RUN --minutes 60

Stop it at any time; the same command goes on from the newest checkpoint.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from experiments.priors import prompts, records
from experiments.priors.denoising import denoising_evaluator, denoising_loss
from experiments.priors.phrases import PHRASES, PhraseEncoder, drop_phrases
from experiments.priors.training import Task, arguments, train
from jaxphys.guidance.bundled.pixel_prior import PixelCondition, PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.text_encoder import load_text_encoder
from jaxphys.guidance.diffusion.samplers import karras_times, sample_heun
from jaxphys.guidance.diffusion.schedule import guided
from jaxphys.guidance.views import view_features


def backgrounds(key: Array, count: int, resolution: int) -> Array:
    """(B, R, R, 3) in [0, 1]: solid, sloping between two colours, or coarse noise."""
    kind, corners, tone = jax.random.split(key, 3)
    grid = jax.random.uniform(corners, (count, 4, 4, 3))
    solid = jnp.broadcast_to(grid[:, :1, :1], grid.shape)
    ramp = jnp.linspace(0.0, 1.0, 4)[None, :, None, None]
    slope = grid[:, :1, :1] * (1 - ramp) + grid[:, 1:2, :1] * ramp
    slope = jnp.broadcast_to(slope, grid.shape)
    grey = jnp.broadcast_to(jax.random.uniform(tone, (count, 1, 1, 1)), grid.shape)
    pick = jax.random.uniform(kind, (count, 1, 1, 1))
    small = jnp.where(
        pick < 0.5, solid, jnp.where(pick < 0.7, grey, jnp.where(pick < 0.9, slope, grid))
    )
    return jax.image.resize(small, (count, resolution, resolution, 3), "linear")


def prepare(batch: dict[str, Array], key: Array) -> tuple[Array, PixelCondition]:
    """Pictures on random backgrounds in [-1, 1]; a tenth of the views goes untold."""
    ground, hide = jax.random.split(key)
    images = batch["images"].astype(jnp.float32) / 255
    alpha = images[..., 3:]
    shown = images[..., :3] * alpha + backgrounds(ground, *images.shape[:2]) * (1 - alpha)
    keep = jax.random.uniform(hide, images.shape[:1]) > 0.1
    return 2 * shown - 1, PixelCondition(batch["text"], batch["view"] * keep[:, None])


def sheet(text: np.ndarray, seed: int):
    """A function that draws samples of each prompt: rows from the front, the back, anywhere."""
    count = len(text)
    views = [view_features(np.full(count, a), np.full(count, 0.3)) for a in (0.3, 2.8)]
    views = np.concatenate([*views, np.zeros_like(views[0])]).astype(np.float32)
    told = PixelCondition(np.tile(text, (3, 1, 1)), views)
    untold = told._replace(text=np.zeros_like(told.text))

    @nnx.jit
    def draw(module: PixelPrior) -> Array:
        size = module.config.resolution
        noise = jax.random.normal(jax.random.key(seed), (3 * count, size, size, 3))

        def denoise(noisy: Array, time: Array) -> Array:
            both = jax.tree.map(lambda *c: jnp.concatenate(c), told, untold)
            clean = module(jnp.tile(noisy, (2, 1, 1, 1)), jnp.tile(time, 2), both)
            return jnp.clip(guided(*jnp.split(clean, 2), 3.0), -1, 1)

        times = karras_times(module.schedule, 18, 60.0, 0.03, 7.0)
        return sample_heun(denoise, module.schedule, noise, times)

    def picture(module: PixelPrior) -> np.ndarray:
        images = np.asarray(draw(module)).reshape(3, count, 64, 64, 3)
        rows = images.transpose(0, 2, 1, 3, 4).reshape(3 * 64, count * 64, 3)
        return (np.clip(0.5 * rows + 0.5, 0, 1) * 255).astype(np.uint8)

    return picture


def main() -> None:
    parser = arguments(__doc__, batch=64, steps=12_000)
    options = parser.parse_args()
    data = records.load(options.data)
    weight = data.weights()
    per_view = weight[data.item] / np.bincount(data.item, minlength=len(weight))[data.item]
    choose = records.sampler(per_view)

    def gather(views: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        view = view_features(data.azimuth[views], data.elevation[views], data.known[views])
        return {
            "images": data.images[views],
            "text": data.text(data.item[views], rng),
            "view": view.astype(np.float32),
        }

    def draw(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
        batch = gather(choose(rng, count), rng)
        return batch | {"text": drop_phrases(batch["text"], rng)}

    rng = np.random.default_rng(options.seed)
    kept_out = np.flatnonzero(data.held_out[data.item])
    kept_out = rng.choice(kept_out, min(256, len(kept_out)), replace=False)
    config = PixelPriorConfig(phrases=PHRASES, dtype=options.dtype)
    module = PixelPrior(config, rngs=nnx.Rngs(options.seed))
    shown = (*prompts.PROMPTS, *prompts.ATTRIBUTES)
    task = Task(
        module=module,
        draw=draw,
        loss=denoising_loss(prepare),
        evaluate=denoising_evaluator(module, prepare, gather(np.sort(kept_out), rng)),
        picture=sheet(PhraseEncoder(load_text_encoder())(shown), options.seed),
    )
    train(task, options)


if __name__ == "__main__":
    main()

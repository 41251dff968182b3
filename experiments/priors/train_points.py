"""Trains the point prior.

    python -m experiments.priors.train_points --data PREPARED --run RUN --minutes 60

Stop it at any time; the same command goes on from the newest checkpoint, with other --points too.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from experiments.priors import prompts, records
from experiments.priors.fresh import fresh_clouds, kind_of
from experiments.priors.training import Task, arguments, train
from jaxphys.guidance.bundled.point_prior import (
    PointCondition,
    PointPrior,
    PointPriorConfig,
    from_frame,
    to_frame,
)
from jaxphys.guidance.bundled.text_encoder import load_text_encoder
from jaxphys.guidance.diffusion.samplers import karras_times, sample_heun
from jaxphys.guidance.diffusion.schedule import guided


def prepare(batch: dict[str, Array], key: Array) -> tuple[Array, PointCondition]:
    """Points and colours in the prior's frame."""
    del key
    points = batch["points"].astype(jnp.float32)
    return to_frame(points, batch["colours"].astype(jnp.float32) / 255), PointCondition(
        batch["text"]
    )


def drop(condition: PointCondition, keep: Array) -> PointCondition:
    return PointCondition(condition.text * keep[:, None])


def dots(points: np.ndarray, colours: np.ndarray, azimuth: float, size: int = 96) -> np.ndarray:
    """(size, size, 3) picture of a cloud as 2x2 dots, far ones first, seen 0.3 rad from above."""
    c, s, e = np.cos(azimuth), np.sin(azimuth), 0.3
    right = points @ np.array([-s, c, 0.0])
    up = points @ np.array([-np.sin(e) * c, -np.sin(e) * s, np.cos(e)])
    near = points @ np.array([np.cos(e) * c, np.cos(e) * s, np.sin(e)])
    order = np.argsort(near)
    column = np.clip((0.5 + right[order] * 0.8) * size, 0, size - 2).astype(int)
    row = np.clip((0.5 - up[order] * 0.8) * size, 0, size - 2).astype(int)
    image = np.full((size, size, 3), 235, np.uint8)
    for i in (0, 1):
        for j in (0, 1):
            image[row + i, column + j] = (255 * colours[order]).astype(np.uint8)
    return image


def sheet(text: np.ndarray, seed: int, count: int = 2048):
    """A function that draws a sampled cloud of each prompt from the front and from the back."""
    told = PointCondition(text)
    untold = PointCondition(np.zeros_like(text))

    @nnx.jit
    def draw(module: PointPrior) -> Array:
        noise = jax.random.normal(jax.random.key(seed), (len(text), count, 6))

        def denoise(noisy: Array, time: Array) -> Array:
            schedule = module.schedule
            alpha, sigma = (s[:, None, None] for s in schedule.alpha_sigma(time))
            velocity = [module(noisy, time, condition) for condition in (told, untold)]
            return jnp.clip(alpha * noisy - sigma * guided(*velocity, 3.0), -1.1, 1.1)

        times = karras_times(module.schedule, 18, 60.0, 0.02, 7.0)
        return sample_heun(denoise, module.schedule, noise, times)

    def picture(module: PointPrior) -> np.ndarray:
        points, colours = (np.asarray(a) for a in from_frame(draw(module)))
        rows = [
            np.concatenate([dots(p, c, azimuth) for p, c in zip(points, colours, strict=True)], 1)
            for azimuth in (0.4, 2.8)
        ]
        return np.concatenate(rows)

    return picture


def main() -> None:
    parser = arguments(__doc__, batch=12)
    parser.add_argument("--points", type=int, default=1024, help="points a sample")
    parser.add_argument(
        "--fresh", action="store_true", help="new variants of parametric kinds at every step"
    )
    options = parser.parse_args()
    data = records.load(options.data)
    clouds = len(data.points)
    choose = records.sampler(data.weights()[:clouds])

    def gather(items: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        # The 4096 points lie along a space-filling curve: every k-th of them is an even subset.
        stride = data.points.shape[1] // options.points
        at = np.arange(options.points) * stride
        at = at + rng.integers(0, stride, (len(items), options.points))
        return {
            "points": np.take_along_axis(data.points[items], at[..., None], 1),
            "colours": np.take_along_axis(data.colours[items], at[..., None], 1),
            "text": data.text(items, rng),
        }

    kinds = [kind_of(name) for name in data.name[:clouds]]
    encode = load_text_encoder() if options.fresh else None

    def draw(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
        items = choose(rng, count)
        batch = gather(items, rng)
        if encode is not None:
            new = [row for row, item in enumerate(items) if kinds[item] is not None]
            names = [kinds[items[row]] for row in new]
            batch["points"][new], batch["colours"][new], captions = fresh_clouds(
                names, options.points, rng
            )
            batch["text"][new] = encode(captions)
        return batch

    rng = np.random.default_rng(options.seed)
    kept_out = np.flatnonzero(data.held_out[:clouds])
    kept_out = rng.choice(kept_out, min(128, len(kept_out)), replace=False)
    task = Task(
        module=PointPrior(PointPriorConfig(dtype=options.dtype), rngs=nnx.Rngs(options.seed)),
        draw=draw,
        prepare=prepare,
        drop=drop,
        held_out=gather(np.sort(kept_out), rng),
        picture=sheet(prompts.embeddings(options.data), options.seed),
    )
    train(task, options)


if __name__ == "__main__":
    main()

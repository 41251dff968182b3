"""Trains the point prior.

    python -m experiments.priors.train_points --data PREPARED --run RUN

Stop it at any time; the same command goes on from the newest checkpoint, with other --points too.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from experiments.priors import prompts, records
from experiments.priors.clouds import Cloud, cloud_source, held_out_clouds
from experiments.priors.denoising import denoising_evaluator, denoising_loss
from experiments.priors.dots import dot_rows
from experiments.priors.phrases import PHRASES, PhraseEncoder, drop_phrases
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
    return to_frame(batch["points"], batch["colours"]), PointCondition(batch["text"])


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
        return dot_rows(zip(points, colours, strict=True))

    return picture


def main() -> None:
    parser = arguments(__doc__, batch=12, steps=30_000)
    parser.add_argument("--points", type=int, default=1024, help="points a sample")
    parser.add_argument("--kinds", nargs="*", help="of these parametric kinds alone")
    parser.add_argument("--latest", type=float, default=1.0, help="highest noise level")
    options = parser.parse_args()
    encode = PhraseEncoder(load_text_encoder())

    def batch_of(clouds: list[Cloud]) -> dict[str, np.ndarray]:
        return {
            "points": np.stack([cloud.points for cloud in clouds]).astype(np.float32),
            "colours": np.stack([cloud.colours for cloud in clouds]).astype(np.float32),
            "text": encode([cloud.caption for cloud in clouds]),
        }

    data = records.load(options.data) if options.data else None
    source = cloud_source(data, options.kinds, options.points)

    def draw(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
        batch = batch_of(source(rng, count))
        return batch | {"text": drop_phrases(batch["text"], rng)}

    config = PointPriorConfig(
        latent_width=320,
        blocks=4,
        latent_hidden=640,
        phrases=PHRASES,
        dtype=options.dtype,
    )
    module = PointPrior(config, rngs=nnx.Rngs(options.seed))
    held_out = batch_of(held_out_clouds(data, options.kinds, options.points))
    task = Task(
        module=module,
        draw=draw,
        loss=denoising_loss(prepare, options.latest),
        evaluate=denoising_evaluator(module, prepare, held_out),
        picture=sheet(encode((*prompts.PROMPTS, *prompts.ATTRIBUTES)), options.seed),
    )
    train(task, options)


if __name__ == "__main__":
    main()

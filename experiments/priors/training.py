"""The loop that trains either prior: resumable, logged, with an averaged copy of the weights.

Everything a run draws is a function of (seed, step), so that a run that was stopped and resumed is
the run that was not. It trains in bfloat16 with float32 master weights, on any backend.
"""

import argparse
import hashlib
import json
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from flax import nnx
from jax import Array
from PIL import Image

from experiments.priors.muon import muon
from jaxphys.core.checkpoints import Checkpoints, by_name, from_names
from jaxphys.guidance.diffusion.schedule import add_noise, interpret
from jaxphys.networks.parameters import named_parameters, with_parameters

Batch = dict[str, np.ndarray]
EVALUATION_TIMES = (0.1, 0.3, 0.5, 0.7, 0.9)


@dataclass(frozen=True)
class Task:
    """What differs between the priors.

    draw: (generator, batch size) -> host arrays of a training batch.
    prepare: (batch, key) -> (clean samples, condition); random parts that are cheap on the device.
    drop: (condition, keep (B,) bool) -> condition without its text where not kept.
    held_out: fixed arrays of the held-out objects, for `prepare`.
    picture: (module with averaged weights) -> (H, W, 3) uint8 of samples.
    """

    module: nnx.Module
    draw: Callable[[np.random.Generator, int], Batch]
    prepare: Callable[[Batch, Array], tuple[Array, Any]]
    drop: Callable[[Any, Array], Any]
    held_out: Batch
    picture: Callable[[nnx.Module], np.ndarray]


class TrainState(NamedTuple):
    parameters: dict[str, Array]
    average: dict[str, Array]
    optimiser: Any
    step: Array


def arguments(description: str, *, batch: int) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--data", type=Path, required=True, help="folder of prepared data")
    parser.add_argument("--run", type=Path, required=True, help="folder of checkpoints and logs")
    parser.add_argument("--minutes", type=float, default=60.0, help="stop after so long")
    parser.add_argument("--batch", type=int, default=batch)
    parser.add_argument("--learning-rate", type=float, default=1.5e-3)
    parser.add_argument("--warmup", type=int, default=200)
    parser.add_argument("--average", type=float, default=0.998, help="decay of averaged weights")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dtype", default="bfloat16")
    parser.add_argument("--report-minutes", type=float, default=10.0)
    parser.add_argument("--save-minutes", type=float, default=5.0)
    return parser


def optimiser(options: argparse.Namespace) -> optax.GradientTransformation:
    """Muon for the matrices of the hidden layers, AdamW for the rest, with one learning rate."""
    rate = optax.linear_schedule(0.0, options.learning_rate, options.warmup)
    return optax.chain(optax.clip_by_global_norm(1.0), muon(rate, weight_decay=0.02))


def denoising_error(
    module: nnx.Module, clean: Array, condition: Any, noise: Array, times: Array
) -> tuple[Array, Array]:
    """Mean squared error per sample of the velocity and of the clean sample, (B,) each.

    The velocity's is the clean one's divided by sigma^2 (Salimans & Ho 2022), for which sigma is
    kept from 0.05 up.
    """
    schedule = module.schedule
    noisy = add_noise(schedule, clean, noise, times)
    prediction = module(noisy, times, condition)
    estimate = interpret(schedule, module.config.kind, prediction, noisy, times)
    axes = tuple(range(1, clean.ndim))
    error = jnp.mean((estimate.clean - clean) ** 2, axes)
    sigma = schedule.alpha_sigma(times)[1]
    return error / jnp.maximum(sigma, 0.05) ** 2, error


def spread_times(key: Array, count: int) -> Array:
    """One time in each of `count` equal parts of [0, 1] (Kingma et al. 2021), in random order."""
    shuffle, offset = jax.random.split(key)
    times = (jnp.arange(count) + jax.random.uniform(offset, (count,))) / count
    return jax.random.permutation(shuffle, times)


def make_step(task: Task, transform: optax.GradientTransformation, options: argparse.Namespace):
    def loss(parameters: dict[str, Array], batch: Batch, key: Array) -> Array:
        module = with_parameters(task.module, parameters)
        prepare, drop, noise, times = jax.random.split(key, 4)
        clean, condition = task.prepare(batch, prepare)
        condition = task.drop(condition, jax.random.uniform(drop, clean.shape[:1]) > 0.1)
        drawn = jax.random.normal(noise, clean.shape)
        velocity, _ = denoising_error(
            module, clean, condition, drawn, spread_times(times, clean.shape[0])
        )
        return velocity.mean()

    @jax.jit
    def step(state: TrainState, batch: Batch) -> tuple[TrainState, Array]:
        key = jax.random.fold_in(jax.random.key(options.seed), state.step)
        value, gradient = jax.value_and_grad(loss)(state.parameters, batch, key)
        updates, inner = transform.update(gradient, state.optimiser, state.parameters)
        parameters = optax.apply_updates(state.parameters, updates)
        decay = jnp.minimum(options.average, (1.0 + state.step) / (10.0 + state.step))
        average = jax.tree.map(lambda a, p: decay * a + (1 - decay) * p, state.average, parameters)
        return TrainState(parameters, average, inner, state.step + 1), value

    return step


def evaluator(task: Task):
    """Held-out error of the clean sample by noise level, with the text and without."""

    @jax.jit
    def errors(parameters: dict[str, Array], batch: Batch, time: Array) -> tuple[Array, Array]:
        module = with_parameters(task.module, parameters)
        prepare, noise = jax.random.split(jax.random.key(17))
        clean, condition = task.prepare(batch, prepare)
        count = clean.shape[0]
        drawn, times = jax.random.normal(noise, clean.shape), jnp.full((count,), time)
        nothing = task.drop(condition, jnp.zeros((count,), bool))
        _, told = denoising_error(module, clean, condition, drawn, times)
        _, untold = denoising_error(module, clean, nothing, drawn, times)
        return told.mean(), untold.mean()

    def evaluate(parameters: dict[str, Array]) -> dict[str, dict[str, float]]:
        rows = {t: errors(parameters, task.held_out, jnp.float32(t)) for t in EVALUATION_TIMES}
        return {
            "held_out": {str(t): round(float(told), 6) for t, (told, _) in rows.items()},
            "held_out_no_text": {
                str(t): round(float(untold), 6) for t, (_, untold) in rows.items()
            },
        }

    return evaluate


@contextmanager
def stop_on_signal() -> Iterator[Callable[[], bool]]:
    """Yields a function that says whether SIGTERM or SIGINT asked the loop to end."""
    asked = []
    before = {
        s: signal.signal(s, lambda *_: asked.append(1)) for s in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        yield lambda: bool(asked)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def checkpoints_of(run: Path, parameters: dict[str, Any]) -> Checkpoints:
    """The checkpoints of a training run. Options and versions may change from piece to piece, the
    network may not."""
    network = {name: [*array.shape] for name, array in parameters.items()}
    identity = hashlib.sha256(json.dumps(network, sort_keys=True).encode()).hexdigest()
    return Checkpoints(run / "checkpoints", identity)


def train(task: Task, options: argparse.Namespace) -> None:
    """Trains for `options.minutes` from the newest checkpoint in `options.run`, or from scratch."""
    run = options.run.resolve()
    run.mkdir(parents=True, exist_ok=True)
    transform = optimiser(options)
    parameters = named_parameters(task.module)
    state = TrainState(parameters, parameters, transform.init(parameters), jnp.zeros((), jnp.int32))
    checkpoints = checkpoints_of(run, parameters)
    if newest := checkpoints.newest():
        state = from_names(state, newest[1])
    step, evaluate = make_step(task, transform, options), evaluator(task)
    log = (run / "log.jsonl").open("a", buffering=1)
    settings = {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items()}
    log.write(json.dumps({"start": int(state.step), "options": settings}) + "\n")

    def report(losses: list[Array], seconds: float) -> None:
        row = {"step": int(state.step), "loss": round(float(np.mean(jax.device_get(losses))), 6)}
        row |= {
            "seconds_per_step": round(seconds / max(len(losses), 1), 3),
            **evaluate(state.average),
        }
        log.write(json.dumps(row) + "\n")
        picture = task.picture(with_parameters(task.module, state.average))
        Image.fromarray(picture).save(run / f"samples-{int(state.step):06d}.png")

    def batch_of(number: int) -> Batch:
        return task.draw(np.random.default_rng((options.seed, number)), options.batch)

    started = last_report = last_save = time.monotonic()
    losses: list[Array] = []
    # The host draws the next batch while the device works on this one.
    with stop_on_signal() as stopping, ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(batch_of, int(state.step))
        while not stopping() and time.monotonic() - started < 60 * options.minutes:
            batch, coming = coming.result(), ahead.submit(batch_of, int(state.step) + 1)
            state, value = step(state, batch)
            losses.append(jax.block_until_ready(value))
            now = time.monotonic()
            if now - last_report > 60 * options.report_minutes:
                report(losses, now - last_report)
                losses, last_report = [], time.monotonic()
            if now - last_save > 60 * options.save_minutes:
                checkpoints.save(int(state.step), by_name(state))
                last_save = now
        if int(state.step) not in checkpoints.steps():
            checkpoints.save(int(state.step), by_name(state))
        if losses and not stopping():
            report(losses, time.monotonic() - last_report)
    log.close()

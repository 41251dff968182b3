"""The loop that trains every network: resumable, logged, with an averaged copy of the weights.

Everything a run draws is a function of (seed, step), so that a run that was stopped and resumed is
the run that was not. Master weights are float32, on any backend.
"""

import argparse
import hashlib
import json
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
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
from jaxphys.networks.parameters import named_parameters, with_parameters

Batch = dict[str, np.ndarray]


@dataclass(frozen=True)
class Task:
    """What differs between the networks.

    draw: (generator, batch size) -> host arrays of a training batch.
    loss: (module, batch, key) -> scalar.
    evaluate: parameters -> held-out figures, for the log.
    picture: (module with averaged weights) -> (H, W, 3) uint8 of samples.
    """

    module: nnx.Module
    draw: Callable[[np.random.Generator, int], Batch]
    loss: Callable[[nnx.Module, Batch, Array], Array]
    evaluate: Callable[[dict[str, Array]], dict[str, Any]]
    picture: Callable[[nnx.Module], np.ndarray]


class TrainState(NamedTuple):
    parameters: dict[str, Array]
    average: dict[str, Array]
    optimiser: Any
    step: Array


def arguments(description: str, *, batch: int, steps: int) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--data", type=Path, help="folder of prepared data")
    parser.add_argument("--run", type=Path, required=True, help="folder of checkpoints and logs")
    parser.add_argument("--steps", type=int, default=steps, help="the step at which it is trained")
    parser.add_argument("--minutes", type=float, default=1e6, help="stop after so long")
    parser.add_argument("--batch", type=int, default=batch)
    parser.add_argument("--learning-rate", type=float, default=1.5e-3)
    parser.add_argument("--warmup", type=int, default=200)
    parser.add_argument("--cooldown", type=float, default=0.3, help="last share, falling to 0")
    parser.add_argument("--average", type=float, default=0.998, help="decay of averaged weights")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dtype", default="float32")
    parser.add_argument("--report-minutes", type=float, default=10.0)
    parser.add_argument("--save-minutes", type=float, default=5.0)
    return parser


def optimiser(options: argparse.Namespace) -> optax.GradientTransformation:
    """Muon for the matrices of the hidden layers, AdamW for the rest, with one learning rate: up,
    level, and down to zero at the last step (Haegele et al. 2024).
    """
    cooldown = max(1, int(options.cooldown * options.steps))
    rate = optax.join_schedules(
        [
            optax.linear_schedule(0.0, options.learning_rate, options.warmup),
            optax.linear_schedule(options.learning_rate, 0.0, cooldown),
        ],
        [options.steps - cooldown],
    )
    return optax.chain(optax.clip_by_global_norm(1.0), muon(rate, weight_decay=0.02))


def make_step(task: Task, transform: optax.GradientTransformation, options: argparse.Namespace):
    def loss(parameters: dict[str, Array], batch: Batch, key: Array) -> Array:
        return task.loss(with_parameters(task.module, parameters), batch, key)

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


def averaged(run: Path, parameters: dict[str, Any]) -> tuple[dict[str, np.ndarray], int]:
    """The averaged weights of the newest checkpoint, and its step."""
    newest = checkpoints_of(run.resolve(), parameters).newest()
    if newest is None:
        raise SystemExit(f"{run}: holds no checkpoint of this network; train first")
    step, arrays = newest
    return {name: arrays[f"average/{name}"] for name in parameters}, step


def lines_of(run: Path) -> list[dict]:
    """The log of a run."""
    return [json.loads(line) for line in (run / "log.jsonl").read_text().splitlines()]


def trained(run: Path, kind: Callable[..., nnx.Module], config_type: type) -> nnx.Module:
    """The network of a run with its averaged weights, in float32."""
    config = config_of(run, config_type)
    module = nnx.eval_shape(lambda: kind(config, rngs=nnx.Rngs(0)))
    arrays, _ = averaged(run, named_parameters(module))
    return with_parameters(module, {name: jnp.asarray(array) for name, array in arrays.items()})


def config_of(run: Path, config_type: type) -> Any:
    """The sizes of a run's network, to compute in float32."""
    config = [line["config"] for line in lines_of(run) if "config" in line][-1]
    return config_type(**{**config, "dtype": "float32"})


def train(task: Task, options: argparse.Namespace) -> None:
    """Trains to step `options.steps`, or for `options.minutes`, from the newest checkpoint in
    `options.run`, or from scratch."""
    run = options.run.resolve()
    run.mkdir(parents=True, exist_ok=True)
    transform = optimiser(options)
    parameters = named_parameters(task.module)
    state = TrainState(parameters, parameters, transform.init(parameters), jnp.zeros((), jnp.int32))
    checkpoints = checkpoints_of(run, parameters)
    if newest := checkpoints.newest():
        if by_name(state).keys() - newest[1].keys():
            raise SystemExit(f"{run}: was trained by another optimiser; take a new folder")
        state = from_names(state, newest[1])
    step = make_step(task, transform, options)
    log = (run / "log.jsonl").open("a", buffering=1)
    settings = {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items()}
    start = {"start": int(state.step), "options": settings, "config": asdict(task.module.config)}
    log.write(json.dumps(start) + "\n")

    def report(losses: list[Array], seconds: float, busy: float) -> None:
        count = max(len(losses), 1)
        row = {"step": int(state.step), "loss": round(float(np.mean(jax.device_get(losses))), 6)}
        row |= {
            "seconds_per_step": round(seconds / count, 3),
            "cpu_seconds_per_step": round(busy / count, 3),
            **task.evaluate(state.average),
        }
        log.write(json.dumps(row) + "\n")
        picture = task.picture(with_parameters(task.module, state.average))
        Image.fromarray(picture).save(run / f"samples-{int(state.step):06d}.png")

    def batch_of(number: int) -> Batch:
        return task.draw(np.random.default_rng((options.seed, number)), options.batch)

    started = last_report = last_save = time.monotonic()
    busy = time.process_time()
    losses: list[Array] = []
    # The host draws the next batch while the device works on this one.
    with stop_on_signal() as stopping, ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(batch_of, int(state.step))
        while int(state.step) < options.steps and not stopping():
            if time.monotonic() - started > 60 * options.minutes:
                break
            batch, coming = coming.result(), ahead.submit(batch_of, int(state.step) + 1)
            state, value = step(state, batch)
            losses.append(jax.block_until_ready(value))
            now = time.monotonic()
            if now - last_report > 60 * options.report_minutes:
                report(losses, now - last_report, time.process_time() - busy)
                losses, last_report, busy = [], time.monotonic(), time.process_time()
            if now - last_save > 60 * options.save_minutes:
                checkpoints.save(int(state.step), by_name(state))
                last_save = now
        if int(state.step) not in checkpoints.steps():
            checkpoints.save(int(state.step), by_name(state))
        if losses and not stopping():
            report(losses, time.monotonic() - last_report, time.process_time() - busy)
        if stopping():
            raise SystemExit(f"{run}: stopped at step {int(state.step)}; the same command goes on")
    log.close()

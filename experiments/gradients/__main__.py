"""The table of gradients: material, boundary, transfer, stepping and adjoint, in both directions.

    python -m experiments.gradients --out docs/gradients.jsonl     # measures what is not there yet
    python -m experiments.gradients --table docs/gradients.jsonl   # prints the lines as tables

For each case a smooth loss of a motion of three frames, by every number that its scene has (the
material's, density, gravity, start, boundary), along one random direction: the derivative of
`jax.grad` and of `jax.jvp` against central differences, whose step is taken where two of them agree
best, and the order of what a Taylor polynomial of first degree leaves. float64.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from experiments.gradients.cases import Case, cases
from jaxphys.mpm.loop.frames import rollout_frames

STEPS = 10.0 ** -np.arange(2.5, 7.6, 0.5)  # of the differences
BOUNDARY_NUMBERS = ("point", "normal", "velocity", "centre", "radius", "half_size", "half_height",
                    "orientation", "force", "rate", "friction")  # fmt: skip


def numbers_of(case: Case) -> dict[str, Any]:
    """Every number that a change may reach, by the names of `Simulation.with_`."""
    simulation = case.simulation
    material = {
        name: float(np.mean(simulation.model.parameters[name]))
        for law, _, _ in simulation.config.segments
        for name in law.parameters
    }
    listed = case.scene["boundaries"][0]
    boundary = {name: listed[name] for name in BOUNDARY_NUMBERS if name in listed}
    start = simulation.state
    inverse = np.asarray(simulation.order)
    return material | {
        "density": np.asarray(simulation.model.mass / simulation.model.volume)[inverse],
        "gravity": np.array([0.1, -0.2, -9.8]),
        "velocity": np.moveaxis(np.asarray(start.velocity), -1, 0)[inverse],
        "deformation": np.moveaxis(np.asarray(start.deformation), -1, 0)[inverse],
        "boundaries": {0: boundary},
    }


def loss_of(case: Case, numbers: dict[str, Any]) -> Callable:
    """t -> loss at numbers * (1 + t direction), for a random direction."""
    simulation, random = case.simulation, np.random.default_rng(1)
    numbers = jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), numbers)
    direction = jax.tree.map(lambda x: jnp.asarray(random.normal(size=x.shape)), numbers)
    if case.scene["objects"][0]["material"] == "water":
        # A fluid's start is a multiple of the identity and stays one.
        same = random.normal()
        direction["deformation"] = jnp.full_like(direction["deformation"], same)
    weights = jnp.asarray(random.normal(size=(2, *simulation.state.position.T.shape)))

    def loss(t):
        moved = jax.tree.map(lambda x, d: x * (1 + t * d), numbers, direction)
        motion = rollout_frames(simulation.with_(**moved), 3, adjoint=case.adjoint)
        shape = motion.deformation[-1] - jnp.eye(3)
        return jnp.sum(weights * motion.position[1:]) + 0.01 * jnp.sum(shape**2)

    return loss


def plateau(value: Callable, steps: np.ndarray = STEPS) -> tuple[float, float]:
    """(derivative, how far two differences of neighbouring steps are apart where they agree best).

    Differences of fourth order.
    """
    found = []
    for h in steps:
        near, far = ((value(s * h) - value(-s * h)) / (2 * s * h) for s in (1, 2))
        found.append((4 * near - far) / 3)
    apart = np.abs(np.diff(found))
    best = int(np.argmin(apart))
    return float(found[best + 1]), float(apart[best])


def taylor_order(value: Callable, slope: float, steps=(4e-4, 2e-4, 1e-4)) -> float:
    """The order of |f(h) - f(0) - h f'|: 2 where the slope is right."""
    start = value(0.0)
    left = np.array([abs(value(h) - start - h * slope) for h in steps])
    return float(np.log2(left[0] / left[-1]) / np.log2(steps[0] / steps[-1]))


def measure(case: Case) -> dict[str, Any]:
    """One line."""
    loss = loss_of(case, numbers_of(case))
    compiled = jax.jit(loss)

    def value(t: float) -> float:
        return float(compiled(jnp.float64(t)))

    reverse = float(jax.jit(jax.grad(loss))(jnp.float64(0.0)))
    line: dict[str, Any] = {"axis": case.axis, "case": case.name, "start": case.start}
    line["value"], line["reverse"] = value(0.0), reverse
    if case.scene.get("stepping", {}).get("type") != "implicit":
        forward = jax.jit(lambda t: jax.jvp(loss, (t,), (jnp.ones_like(t),))[1])
        line["forward"] = float(forward(jnp.float64(0.0)))
    difference, apart = plateau(value)
    line |= {"difference": difference, "plateau": apart}
    line["taylor"] = taylor_order(value, reverse)
    return line


def table(lines: list[dict[str, Any]]) -> str:
    """The lines for people."""
    text = []
    for axis in dict.fromkeys(line["axis"] for line in lines):
        text += [f"### {axis}", "", "| case | start | reverse | forward | plateau | Taylor |"]
        text.append("|---|---|---|---|---|---|")
        for line in (one for one in lines if one["axis"] == axis):
            exact = line["difference"]
            errors = [
                f"{abs(line[way] - exact) / abs(exact):.1e}" if way in line else "-"
                for way in ("reverse", "forward")
            ]
            text.append(
                f"| {line['case']} | {line['start']} | {errors[0]} | {errors[1]} | "
                f"{line['plateau'] / abs(exact):.1e} | {line['taylor']:.2f} |"
            )
        text.append("")
    return "\n".join(text)


def read(path: Path) -> list[dict[str, Any]]:
    """The lines of a file, none if it is not there."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def main() -> None:
    """Measures, or prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="lines are added to this file")
    parser.add_argument("--table", type=Path, help="print the lines of this file")
    parser.add_argument("--axis", help="this axis alone")
    options = parser.parse_args()
    if options.table is not None:
        print(table(read(options.table)))
        return
    if options.out is None:
        parser.error("give --out or --table")
    jax.config.update("jax_enable_x64", True)
    done = {(line["axis"], line["case"], line["start"]) for line in read(options.out)}
    for case in cases():
        key = (case.axis, case.name, case.start)
        if key in done or options.axis not in (None, case.axis):
            continue
        line = measure(case)
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        print(line, flush=True)
        jax.clear_caches()


if __name__ == "__main__":
    main()

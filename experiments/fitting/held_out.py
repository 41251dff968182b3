"""Fifteen scenes drawn by seed: material, shape, boundary, motion. How many fits succeed?

A fit succeeds that has every number which it calls determined within a tenth of a decade (within
0.05 of Poisson's ratio, 3 degrees of friction) of the truth, the velocity within 0.05 m/s, and is
off by no more than one and a half times the noise.
"""

from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

import jaxphys
from experiments.fitting.published import error_of, kind_of
from experiments.fitting.scenes import (
    SHAPES,
    asked_of,
    fitted,
    moved,
    scene_of,
    solid,
    told,
    tracks,
)
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import Free

TIMES = np.arange(8) / 24
CELLS, DRAWS, SEED = 10, 15, 20
FLOORS = ("sticky", "separate", "slip")
# Law: material, its law, ranges that numbers are drawn from (by their logarithms), and starts.
MATERIALS: dict[str, tuple[str, str | None, dict[str, tuple[float, float]], dict[str, float]]] = {
    "elastic": ("elastic", "neo-Hookean",
                {"youngs_modulus": (3e4, 1e6), "poisson_ratio": (0.2, 0.4)},
                {"youngs_modulus": 1e5, "poisson_ratio": 0.25}),
    "jelly": ("jelly", None, {"youngs_modulus": (2e4, 1e5)}, {"youngs_modulus": 5e4}),
    "plastic": ("metal", None, {"youngs_modulus": (2e5, 1e6), "yield_stress": (3e3, 2e4)},
                {"youngs_modulus": 3e5, "yield_stress": 1e4}),
    "sand": ("sand", None, {"friction_angle": (20.0, 45.0)}, {"friction_angle": 30.0}),
    "fluid": ("water", None, {"viscosity": (20.0, 300.0), "bulk_modulus": (5e4, 3e5)},
              {"viscosity": 50.0, "bulk_modulus": 1e5}),
}  # fmt: skip
NEAR = {"poisson_ratio": 0.05, "friction_angle": 3.0}


@dataclass(frozen=True)
class Drawn:
    """What was drawn."""

    law: str
    shape: str
    floor: str
    true: dict[str, float]
    velocity: tuple[float, float, float]


def drawn(count: int = DRAWS, seed: int = SEED) -> list[Drawn]:
    """All draws; each law as often."""
    random = np.random.default_rng(seed)
    found = []
    for number in range(count):
        law = list(MATERIALS)[number % len(MATERIALS)]
        true = {
            name: float(np.exp(random.uniform(*np.log(ends))))
            for name, ends in MATERIALS[law][2].items()
        }
        velocity = (*random.uniform(-0.5, 0.5, 2), random.uniform(-2.5, -1.0))
        found.append(
            Drawn(law, str(random.choice(list(SHAPES))), str(random.choice(FLOORS)), true,
                  tuple(float(v) for v in velocity))
        )  # fmt: skip
    return found


def succeeded(line: Line) -> bool:
    """Whether a fit is as near as the docstring above says."""
    near = all(
        abs(error) <= NEAR.get(name, 0.1)
        for name, error in line["errors"].items()
        if line["intervals"][name]["determined"]
    )
    return near and line["velocity_error"] <= 0.05 and line["misfit"] <= 1.5 * line["noise"]


def case(what: Drawn, cells: int, times: np.ndarray) -> Line:
    """One fit."""
    material, law, _, starts = MATERIALS[what.law]
    scene = scene_of(material, {"density": 1000.0}, law=law, floor=what.floor)
    simulation, _ = jaxphys.build(scene, solid(what.shape, cells))
    free: dict[str, Free] = {name: kind_of(name, value) for name, value in starts.items()}
    free["velocity"] = Free((0.0, 0.0, -1.0), size=1.0)
    asked = asked_of(simulation, free, times)
    motion = moved(asked, {**what.true, "velocity": what.velocity})
    fit, evaluations = fitted(asked, tracks(motion, asked.times, SEED))
    line = {
        **asdict(what),
        **told(fit),
        "errors": {n: error_of(n, float(fit.values[n]), v) for n, v in what.true.items()},
        "velocity_error": float(np.linalg.norm(fit.values["velocity"] - what.velocity)),
        "evaluations": evaluations,
    }
    return line | {"success": succeeded(line)}


def cases(quick: bool) -> Cases:
    """Fifteen; quick: two, coarse and short."""
    size = (5, TIMES[:5]) if quick else (CELLS, TIMES)
    draws = drawn()[: 2 if quick else DRAWS]
    return {f"draw {i}": partial(case, what, *size) for i, what in enumerate(draws)}


def table(lines: list[Line]) -> str:
    """A row for each draw, and how many succeed."""
    rows = []
    for line in lines:
        if line["status"] != "ok":
            rows.append((line["case"], "", "", "", "", "", line["reason"]))
            continue
        errors = ", ".join(
            f"`{name}` {error:+.3f}"
            + ("" if line["intervals"][name]["determined"] else " (not determined)")
            for name, error in line["errors"].items()
        )
        rows.append((f"{line['law']}, {line['shape']}, {line['floor']}", errors,
                     f"{line['velocity_error']:.4f}", f"{line['misfit'] / line['noise']:.2f}",
                     line["evaluations"], f"{line['cpu_seconds']:.0f}",
                     "yes" if line["success"] else f"**no** ({line['reason']})"))  # fmt: skip
    good = sum(line.get("success", False) for line in lines)
    head = ("law, shape, floor", "errors", "velocity [m/s]", "misfit over noise", "evaluations",
            "CPU seconds", "succeeds")  # fmt: skip
    return markdown(head, rows) + f"\n\n{good} of {len(lines)} succeed."

"""PAC-NeRF's nine scenes on shapes of our own: its materials, true values and starts (Li et al.
2023, table 1 and its code's configs), fitted from tracks, from three cameras and from one.

Its stresses are converted: its yield stress is that of a bar, `shear_yield_stress` is that of it
over sqrt(3), and its plastic viscosity multiplies a Frobenius norm, `consistency` is half of it.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

import jaxphys
from experiments.fitting.scenes import (
    asked_of,
    fitted,
    images,
    moved,
    scene_of,
    solid,
    told,
    tracks,
)
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import Bounded, Free, Log

TIMES = np.arange(8) / 24
CELLS = 12  # particles along the longest side
OBSERVED = ("tracks", "cameras 3", "cameras 1", "cameras 11")
YIELD, RATE = 3**-0.5, 0.5  # of PAC-NeRF's numbers


@dataclass(frozen=True)
class Hero:
    """One of its scenes.

    Attributes:
        shape, material, law: of ours.
        true, start: values.
        velocity: at the start [m/s], ours, free and started from 0.
        theirs: what PAC-NeRF's paper reports, on its own data.
        fixed: parameters that are known.
    """

    shape: str
    material: str
    true: Mapping[str, float]
    start: Mapping[str, float]
    velocity: tuple[float, float, float]
    theirs: Mapping[str, float]
    law: str | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)


def _fluid(mu, kappa):
    return {"viscosity": mu, "bulk_modulus": kappa}


def _paste(mu, kappa, tau, eta):
    return {
        "shear_modulus": mu,
        "bulk_modulus": kappa,
        "shear_yield_stress": YIELD * tau,
        "consistency": RATE * eta,
    }


def _solid(E, nu, tau=None):
    return {"youngs_modulus": E, "poisson_ratio": nu} | (
        {} if tau is None else {"yield_stress": tau}
    )


BINGHAM = {"flow_index": 1.0}
HEROES = {
    "droplet": Hero("ball", "water", _fluid(200.0, 1e5), _fluid(1.0, 1e3), (0.2, 0.1, -1.5),
                    _fluid(209.0, 1.08e5)),
    "letter": Hero("letter", "water", _fluid(100.0, 1e5), _fluid(1.0, 1e6), (0.0, 0.3, -1.5),
                   _fluid(83.8, 1.35e5)),
    "cream": Hero("heap", "cream", _paste(1e4, 1e6, 3e3, 10.0), _paste(100.0, 1e4, 10.0, 1.0),
                  (0.3, 0.0, -1.5), _paste(1.21e5, 1.57e6, 3.16e3, 5.6), fixed=BINGHAM),
    "toothpaste": Hero("rod", "cream", _paste(5e3, 1e5, 200.0, 10.0),
                       _paste(100.0, 1e4, 10.0, 0.1), (0.1, 0.1, -1.0),
                       _paste(6.51e3, 2.22e5, 228.0, 9.77), fixed=BINGHAM),
    "torus": Hero("torus", "elastic", _solid(1e6, 0.3), _solid(1e5, 0.1), (0.3, -0.2, -2.0),
                  _solid(1.04e6, 0.322), "neo-Hookean"),
    "bird": Hero("bird", "elastic", _solid(3e5, 0.3), _solid(1e3, 0.1), (0.5, 0.0, -1.5),
                 _solid(2.78e5, 0.273), "neo-Hookean"),
    "playdoh": Hero("block", "metal", _solid(2e6, 0.3, 1.54e4), _solid(1e5, 0.4, 1e3),
                    (0.2, 0.3, -3.0), _solid(3.84e6, 0.272, 1.69e4)),
    "cat": Hero("cat", "metal", _solid(1e6, 0.3, 3.85e3), _solid(1e3, 0.2, 100.0),
                (0.3, 0.0, -1.5), _solid(1.61e5, 0.293, 3.57e3)),
    "trophy": Hero("cup", "sand", {"friction_angle": 40.0}, {"friction_angle": 10.0},
                   (0.0, 0.2, -1.0), {"friction_angle": 36.1},
                   fixed={"youngs_modulus": 1e6, "poisson_ratio": 0.3}),
}  # fmt: skip
LINEAR = {"poisson_ratio": Bounded(0.25, 0.0, 0.49), "friction_angle": Bounded(10.0, 0.0, 80.0)}


def kind_of(name: str, start: float) -> Free:
    """The kind of a parameter."""
    if name in LINEAR:
        return Bounded(start, LINEAR[name].low, LINEAR[name].high)
    return Log(start)


def error_of(name: str, found: float, true: float) -> float:
    """Decades of what is positive, else the difference."""
    return found - true if name in LINEAR else float(np.log10(found / true))


def built(hero: Hero, cells: int = CELLS):
    """(simulation, look), as long as nobody says what it is made of."""
    scene = scene_of(hero.material, {**hero.fixed, "density": 1000.0}, law=hero.law)
    return jaxphys.build(scene, solid(hero.shape, cells))


def truth_of(hero: Hero) -> dict[str, Any]:
    """The true numbers of what is free."""
    return {**hero.true, "velocity": hero.velocity}


def free_of(hero: Hero) -> dict[str, Free]:
    """What is free of a scene, where PAC-NeRF started."""
    free = {name: kind_of(name, value) for name, value in hero.start.items()}
    return free | {"velocity": Free((0.0, 0.0, 0.0), size=1.0)}


def case(name: str, observed: str, cells: int, times: np.ndarray) -> Line:
    """One fit."""
    hero = HEROES[name]
    simulation, look = built(hero, cells)
    views = 0 if observed == "tracks" else int(observed.split()[1])
    asked = asked_of(simulation, free_of(hero), times, look=look, views=views)
    motion = moved(asked, truth_of(hero))
    seed = zlib.crc32(f"{name}, {observed}".encode())
    seen = (
        images(motion, asked.times, look, views, seed)
        if views
        else tracks(motion, asked.times, seed)
    )
    fit, evaluations = fitted(asked, seen)
    values = {name: float(fit.values[name]) for name in hero.true}
    return {
        "scene": name,
        "observed": observed,
        "true": truth_of(hero),
        **told(fit),
        "errors": {name: error_of(name, values[name], hero.true[name]) for name in hero.true},
        "velocity_error": float(np.linalg.norm(fit.values["velocity"] - hero.velocity)),
        "evaluations": evaluations,
    }


def cases(quick: bool) -> Cases:
    """The nine scenes from each kind of observation; quick: two from tracks, coarse and short."""
    names, kinds = (("torus", "trophy"), OBSERVED[:1]) if quick else (tuple(HEROES), OBSERVED)
    size = (6, TIMES[:5]) if quick else (CELLS, TIMES)
    return {f"{n}, {kind}": partial(case, n, kind, *size) for kind in kinds for n in names}


def _number(value: float | None) -> str:
    return "?" if value is None else f"{value:.4g}"


def table(lines: list[Line]) -> str:
    """A row for each number that was found."""
    rows = []
    for line in lines:
        head = (line.get("scene", line["case"]), line.get("observed", ""))
        if line["status"] != "ok":
            rows.append((*head, *[""] * 6, line["reason"]))
            continue
        hero = HEROES[line["scene"]]
        for name, error in line["errors"].items():
            sure = line["intervals"][name]
            interval = f"{_number(sure['low'])} to {_number(sure['high'])}"
            if not sure["determined"]:
                interval = "not determined"
            covered = (sure["low"] or 0) <= hero.true[name] <= (sure["high"] or np.inf)
            interval += "" if covered else " **(not in)**"
            theirs = error_of(name, hero.theirs[name], hero.true[name])
            rows.append((*head, f"`{name}`", _number(hero.true[name]), _number(hero.start[name]),
                         _number(line["found"][name]), interval,
                         f"{error:+.4f}", f"{theirs:+.3f}"))  # fmt: skip
    head = ("scene", "seen", "number", "true", "start", "found", "90% interval", "error",
            "PAC-NeRF's error, its data")  # fmt: skip
    return markdown(head, rows) + "\n\n" + _costs(lines)


def _costs(lines: list[Line]) -> str:
    """A row for each fit: how near, and what it took."""
    rows = [
        (line["scene"], line["observed"], line["particles"], f"{line['velocity_error']:.4f}",
         f"{line['misfit']:.2e}", f"{line['misfit_still']:.2e}", f"{line['noise']:.0e}",
         line["evaluations"], f"{line['cpu_seconds']:.0f}", line["reason"])
        for line in lines
        if line["status"] == "ok"
    ]  # fmt: skip
    head = ("scene", "seen", "particles", "error of velocity [m/s]", "misfit", "if nothing moved",
            "noise", "evaluations", "CPU seconds", "ended")  # fmt: skip
    return markdown(head, rows)

"""How often the 90% intervals hold the truth: seeds of noise on the tracks of three scenes.

A scene's programs are compiled once; seeds start a third of a decade from the truth.
"""

from functools import partial

import numpy as np

from experiments.fitting.published import HEROES, TIMES, built, free_of, kind_of, truth_of
from experiments.fitting.scenes import asked_of, fitted, moved, tracks
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import Free, Uncertainty

SCENES, CELLS, SEEDS = ("torus", "droplet", "trophy"), 10, 20
OFF = 2.0  # times the true value, or a tenth less of what is bounded


def held(sure: Uncertainty, true: dict[str, float]) -> dict[str, bool]:
    """Which intervals hold the true numbers, by label."""
    return {label: bool(sure[label][0] <= value <= sure[label][1]) for label, value in true.items()}


def case(name: str, seeds: int, cells: int, times: np.ndarray) -> Line:
    """All seeds of a scene."""
    hero = HEROES[name]
    simulation, _ = built(hero, cells)
    starts = {
        key: 0.9 * value if "ratio" in key or "angle" in key else value / OFF
        for key, value in hero.true.items()
    }
    free: dict[str, Free] = {key: kind_of(key, value) for key, value in starts.items()}
    free |= {"velocity": free_of(hero)["velocity"]}
    asked = asked_of(simulation, free, times)
    motion = moved(asked, truth_of(hero))
    wanted = {key: value for key, value in hero.true.items()}
    wanted |= {f"velocity.{a}": v for a, v in zip("xyz", hero.velocity, strict=True)}
    rows = []
    for seed in range(seeds):
        fit, _ = fitted(asked, tracks(motion, asked.times, seed))
        sure = fit.uncertainty
        rows.append(
            {
                "held": held(sure, wanted),
                # Distance from the truth in widths of the interval, on each number's own line.
                "value": dict(zip(sure.labels, np.round(sure.value, 9).tolist(), strict=True)),
                "width": dict(zip(sure.labels, np.round(sure.width, 9).tolist(), strict=True)),
                "independent": sure.independent,
                "reason": fit.reason,
            }
        )
    residuals = int(np.size(motion.position))
    return {"scene": name, "true": wanted, "residuals": residuals, "seeds": rows}


def cases(quick: bool) -> Cases:
    """Three scenes; quick: one, coarse and short, three seeds."""
    if quick:
        return {"trophy": partial(case, "trophy", 3, 6, TIMES[:5])}
    return {name: partial(case, name, SEEDS, CELLS, TIMES) for name in SCENES}


def share(rows: list[dict], label: str | None = None) -> tuple[int, int]:
    """(how many intervals hold the truth, of how many), of one number or of all."""
    found = [h for row in rows for key, h in row["held"].items() if label in (None, key)]
    return sum(found), len(found)


def table(lines: list[Line]) -> str:
    """A row for each number of each scene, and one for all."""
    rows = []
    for line in lines:
        if line["status"] != "ok":
            rows.append((line["case"], "", line["reason"], "", ""))
            continue
        seeds = line["seeds"]
        for label, true in line["true"].items():
            values = np.array([seed["value"][label] for seed in seeds])
            kept, of = share(seeds, label)
            rows.append((line["scene"], f"`{label}`", f"{true:.4g}",
                         f"{values.mean():.5g} ± {values.std(ddof=1):.2g}",
                         f"{kept} of {of}"))  # fmt: skip
        kept, of = share(seeds)
        counted = np.mean([seed["independent"] for seed in seeds])
        rows.append((f"**{line['scene']}**", "all", "",
                     f"{counted:.0f} of {line['residuals']} residuals independent",
                     f"**{kept / of:.0%}** of {of}"))  # fmt: skip
    return markdown(
        ("scene", "number", "true", "found, mean and spread", "interval holds it"), rows
    )

"""The paper's ablations: refinement, the 3D prior, colour regularisation, each left out alone.

Of objects at rest, in eight views: what a film adds is the same with and without.
"""

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from experiments.lines import Cases, Line, markdown
from experiments.paper import measures
from experiments.paper.objects import MAKINGS, OURS
from experiments.paper.run import Run
from jaxphys.study.statistics import clustered_means

WITHOUT_COLOURS = "without colour regularisation"
# What the paper's CLIP score falls by without each part, 0.278 of the whole less that without.
PAPER = {
    "without refinement": 0.278 - 0.256,
    "without refinement, wordy sentence": 0.278 - 0.256,
    "without 3D guidance": 0.278 - 0.263,
    "without the 3D prior": 0.278 - 0.263,
    WITHOUT_COLOURS: 0.278 - 0.266,
}
# Measures, and whether more of one is better.
MEASURES = {"cosine": 1, "first": 1, "distance": -1}

Cell = tuple[str, int]  # an object and a seed


class Difference(NamedTuple):
    """The mean of what a part brings and the ends of its 95 % interval; objects and pairs."""

    mean: float
    low: float
    high: float
    objects: int
    pairs: int


def object_case(name: str, seed: int, how: str) -> str:
    """The name of the case of an object."""
    return f"object: {name}, seed {seed}, {how}"


def cases(run: Run) -> Cases:
    """Every object in every way."""
    return {
        object_case(name, seed, how): partial(measured, run, name, seed, how)
        for name in run.size.ablated
        for seed in run.size.seeds
        for how in MAKINGS
    }


def measured(run: Run, name: str, seed: int, how: str) -> Line:
    """An object made in one way and measured, with its colours regularised and as they are."""
    thing = run.thing(name, seed, how)
    return {
        "object": name,
        "seed": seed,
        "how": how,
        "size": run.size.name,
        "gaussians": thing.count,
        "regular": measures.of_object(measures.regular(thing), name),
        "raw": measures.of_object(thing, name),
    }


def values(lines: list[Line], how: str, measure: str) -> dict[Cell, float]:
    """A measure of every object that was made in one way."""
    colours, made = ("raw", OURS) if how == WITHOUT_COLOURS else ("regular", how)
    return {
        (line["object"], line["seed"]): line[colours][measure]
        for line in lines
        if line["case"].startswith("object: ") and line["status"] == "ok" and line["how"] == made
    }


def difference(ours: Mapping[Cell, float], without: Mapping[Cell, float]) -> Difference:
    """Ours minus without, over the cells that both have.

    Seeds of one object hang together: the interval is Student's t with objects as clusters, NaN for
    fewer than two of them.
    """
    cells = sorted(set(ours) & set(without))
    differences = np.array([ours[cell] - without[cell] for cell in cells])
    names = np.array([name for name, _ in cells])
    estimates = clustered_means(differences, np.zeros(len(cells), int), names, 1)
    return Difference(*estimates.interval(np.ones(1)), estimates.raters, len(cells))


def order(found: Difference, better: int) -> str:
    """How that stands to the paper, in which every part helps."""
    if found.objects < 2:
        return "one object: no interval"
    low, high = sorted((better * found.low, better * found.high))
    if found.low == found.high == 0:
        return "**no difference at all**"
    if low > 0:
        return "the paper's"
    return "**the reverse**" if high < 0 else "**not shown**"


def table(lines: list[Line]) -> str:
    """What each part brings by each measure."""
    rows = []
    for how, fall in PAPER.items():
        for measure, better in MEASURES.items():
            ours, without = (values(lines, one, measure) for one in (OURS, how))
            if not set(ours) & set(without):
                continue
            found = difference(ours, without)
            level = np.mean([ours[cell] for cell in ours if cell in without])
            ends = f"[{found.low:+.3f}, {found.high:+.3f}]" if found.objects > 1 else ""
            rows.append(
                (
                    how,
                    measure + (" (less is better)" if better < 0 else ""),
                    f"{level:.3f}",
                    f"{level - found.mean:.3f}",
                    f"{found.mean:+.3f} {ends}".strip(),
                    f"{found.objects}, {found.pairs}",
                    f"{fall:+.3f}" if measure == "cosine" else "",
                    order(found, better),
                )
            )
    head = (
        *("part left out", "measure", "ours", "without", "difference [95 %]"),
        *("objects, pairs", "paper's, CLIP", "order"),
    )
    return markdown(head, rows)

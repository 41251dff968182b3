"""What the answers to a study say: exclusions, mean opinion scores, strengths, with intervals."""

import math
import os
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from jaxphys.core.errors import InputError, one_line
from jaxphys.study.answers import Answers, Key, read_answers, read_key
from jaxphys.study.bradley_terry import Comparisons, NoFiniteStrength, strengths
from jaxphys.study.config import LEFT, RIGHT, SAME
from jaxphys.study.statistics import LEVEL, Estimates, clustered_means

SIMULATED = "SIMULATED: no person gave these answers; they say nothing about the methods"
SHARE = {LEFT: 1.0, SAME: 0.5, RIGHT: 0.0}


def analyse(
    folder: str | os.PathLike, files: Sequence[str | os.PathLike], *, failures: int = 0
) -> dict[str, Any]:
    """Analyses the answers to a study.

    Args:
        folder: made by `make_study`.
        files: that raters handed in.
        failures: traps that a rater may fail and still count.

    Returns:
        For JSON: `raters` with `files`, `kept` and `excluded` (seat: reason); `simulated`; `level`
        of the intervals; `questions` by name: `means` or `strengths` by method, each a value with
        `low` and `high` (null where there are none), `differences` of means, `wins`, and where
        strengths are not finite `unavailable`, why.

    Raises:
        InputError: a file cannot be used, nobody is left, or comparisons fall apart.
    """
    key = read_key(folder)
    given = read_answers(files, key)
    if not given:
        raise InputError("ANSWERS: name at least one file that a rater handed in")
    excluded = {one.seat: why for one in given if (why := _why_excluded(one, key, failures))}
    kept = [one for one in given if one.seat not in excluded]
    if not kept:
        reasons = "; ".join(f"seat {seat + 1} {why}" for seat, why in excluded.items())
        raise InputError(f"nobody is left to analyse: {reasons}")
    questions = {}
    for number, (name, kind) in enumerate(key.questions):
        asked = [
            (one.seat, page, value)
            for one in kept
            for page, value in zip(key.seats[one.seat], one.values, strict=True)
            if page.question == number and page.wanted is None and value is not None
        ]
        if not asked:
            questions[name] = {"kind": kind, "answers": 0, "unavailable": "nobody answered it"}
            continue
        found = _rated(asked, key) if kind == "rating" else _compared(asked, key)
        questions[name] = {"kind": kind, "answers": len(asked), **found}
    return {
        "study": key.study,
        "simulated": any(one.simulated for one in given),
        "level": LEVEL,
        "raters": {
            "files": len(given),
            "kept": len(kept),
            "excluded": {str(seat + 1): why for seat, why in excluded.items()},
        },
        "questions": questions,
    }


def _why_excluded(one: Answers, key: Key, failures: int) -> str | None:
    if not one.finished:
        return "did not finish"
    pages = zip(key.seats[one.seat], one.values, strict=True)
    failed = sum(page.wanted is not None and value != page.wanted for page, value in pages)
    return f"failed {failed} traps" if failed > failures else None


def _rated(asked: list, key: Key) -> dict[str, Any]:
    values = np.array([value for _, _, value in asked], float)
    raters = np.array([seat for seat, _, _ in asked])
    methods = np.array([page.clips[0][1] for _, page, _ in asked])
    there = [m for m in range(len(key.methods)) if np.any(methods == m)]
    groups = np.searchsorted(there, methods)
    estimates = clustered_means(values, groups, raters, len(there))
    names = [key.methods[m] for m in there]
    counts = np.bincount(groups, minlength=len(there))
    means = _by_method(estimates, names)
    for name, count in zip(names, counts, strict=True):
        means[name]["answers"] = int(count)
    unit = np.eye(len(there))
    differences = [
        {"methods": [names[a], names[b]], **_interval(estimates, unit[a] - unit[b])}
        for a, b in combinations(range(len(there)), 2)
    ]
    return {"means": means, "differences": differences}


def _compared(asked: list, key: Key) -> dict[str, Any]:
    sides = np.array([[clip[1] for clip in page.clips] for _, page, _ in asked])
    there = np.unique(sides)
    names = [key.methods[m] for m in there]
    left, right = np.searchsorted(there, sides).T
    share = np.array([SHARE[value] for _, _, value in asked])
    given = Comparisons(left, right, share, np.array([seat for seat, _, _ in asked]))
    wins = [
        {
            "methods": [names[a], names[b]],
            "wins": [int(np.sum(_won(given, a, b))), int(np.sum(_won(given, b, a)))],
            "ties": int(np.sum(_met(given, a, b) & (share == 0.5))),
        }
        for a, b in combinations(range(len(names)), 2)
    ]
    decided = share[share != 0.5]
    found: dict[str, Any] = {
        "wins": wins,
        "left_chosen": float(decided.mean()) if decided.size else None,
    }
    if len(names) < len(key.methods):
        missing = sorted(set(key.methods) - set(names))
        raise InputError(f"no comparison is left of {', '.join(missing)}; collect more answers")
    try:
        found["strengths"] = _by_method(strengths(given, names), names)
    except NoFiniteStrength as error:
        found["unavailable"] = str(error)
    return found


def _met(given: Comparisons, a: int, b: int) -> np.ndarray:
    one, other = given.first, given.second
    return ((one == a) & (other == b)) | ((one == b) & (other == a))


def _won(given: Comparisons, a: int, b: int) -> np.ndarray:
    """Whether a was chosen over b."""
    return _met(given, a, b) & (given.share == np.where(given.first == a, 1.0, 0.0))


def _by_method(estimates: Estimates, names: list[str]) -> dict[str, dict[str, Any]]:
    unit = np.eye(len(names))
    return {name: _interval(estimates, unit[i]) for i, name in enumerate(names)}


def _interval(estimates: Estimates, weights: np.ndarray) -> dict[str, Any]:
    value, low, high = (
        None if math.isnan(number) else round(number, 6) for number in estimates.interval(weights)
    )
    return {"value": value, "low": low, "high": high}


def as_text(result: dict[str, Any]) -> str:
    """What `analyse` found, for people."""
    raters = result["raters"]
    lines = [SIMULATED] if result["simulated"] else []
    lines.append(f"{raters['files']} files, {raters['kept']} raters kept")
    lines += [f"  seat {seat} {why}" for seat, why in raters["excluded"].items()]
    for name, found in result["questions"].items():
        lines.append(f"{one_line(name)} ({found['kind']}, {found['answers']} answers)")
        for what in ("means", "strengths"):
            for method, value in found.get(what, {}).items():
                lines.append(f"  {one_line(method, 40):24} {_told(value)}")
        for value in found.get("differences", ()):
            lines.append(f"  {one_line(' - '.join(value['methods']), 60):24} {_told(value)}")
        for value in found.get("wins", ()):
            names, (one, other) = one_line(" : ".join(value["methods"]), 60), value["wins"]
            lines.append(f"  {names:24} {one} : {other}, {value['ties']} ties")
        if "unavailable" in found:
            lines.append(f"  {one_line(found['unavailable'])}")
    lines.append(
        f"intervals of {result['level']:.0%}, raters as clusters; ties are half a win of each"
    )
    return "\n".join(lines)


def _told(value: dict[str, Any]) -> str:
    if value["low"] is None:
        return f"{value['value']:7.3f}  (an interval takes two raters)"
    return f"{value['value']:7.3f}  [{value['low']:.3f}, {value['high']:.3f}]"

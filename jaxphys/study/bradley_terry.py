"""Strengths out of pair comparisons (Bradley and Terry 1952).

A method a is chosen over b with probability 1 / (1 + exp(s_b - s_a)). "No difference" counts as
half a win of each: the strengths then explain the expected share of a's wins, ties shared. They sum
to zero. The likelihood is concave, so that Newton's method finds its one maximum.
"""

from dataclasses import dataclass

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.study.statistics import Estimates, sandwich

STEPS, TOLERANCE = 100, 1e-10


@dataclass(frozen=True)
class Comparisons:
    """Answers to pairs, A of them.

    Attributes:
        first, second: numbers of the methods, (A,).
        share: of the first, (A,): 1 chosen, 0 not chosen, 1/2 neither.
        raters: who answered, (A,).
    """

    first: np.ndarray
    second: np.ndarray
    share: np.ndarray
    raters: np.ndarray


class NoFiniteStrength(ValueError):
    """Some methods never lost to the others, so that their strength has no finite estimate."""


def strengths(given: Comparisons, methods: list[str]) -> Estimates:
    """The strengths of all methods, with a covariance by raters as clusters (sandwich).

    Raises:
        InputError: there are methods between which no chain of comparisons leads.
        NoFiniteStrength: see there.
    """
    count = len(methods)
    _require_connected(given, methods)
    _require_finite(given, methods)
    apart = np.zeros((len(given.share), count))
    rows = np.arange(len(given.share))
    apart[rows, given.first] += 1
    apart[rows, given.second] -= 1
    values = np.zeros(count)

    def likelihood(values: np.ndarray) -> float:
        return float(np.sum(given.share * (apart @ values) - np.logaddexp(0, apart @ values)))

    for _ in range(STEPS):
        expected = 1 / (1 + np.exp(-(apart @ values)))
        slope = apart.T @ (given.share - expected)
        curvature = (apart * (expected * (1 - expected))[:, None]).T @ apart
        change = np.linalg.pinv(curvature, hermitian=True) @ slope
        while likelihood(values + change) < likelihood(values) - 1e-12 and np.any(change):
            change = change / 2
        values = values + change
        if np.abs(change).max() < TOLERANCE:
            break
    expected = 1 / (1 + np.exp(-(apart @ values)))
    curvature = (apart * (expected * (1 - expected))[:, None]).T @ apart
    who, number = np.unique(given.raters, return_inverse=True)
    scores = np.zeros((len(who), count))
    np.add.at(scores, number, apart * (given.share - expected)[:, None])
    influence = scores @ np.linalg.pinv(curvature, hermitian=True)
    return Estimates(values - values.mean(), sandwich(influence), len(who))


def _reached(edges: np.ndarray) -> np.ndarray:
    """Which methods can be reached from which, (K, K), along edges (K, K)."""
    reached = edges | np.eye(len(edges), dtype=bool)
    for middle in range(len(edges)):
        reached |= reached[:, middle, None] & reached[None, middle]
    return reached


def _require_connected(given: Comparisons, methods: list[str]) -> None:
    edges = np.zeros((len(methods),) * 2, bool)
    edges[given.first, given.second] = edges[given.second, given.first] = True
    near = _reached(edges)[0]
    if not near.all():
        one, other = ([methods[i] for i in np.flatnonzero(side)] for side in (near, ~near))
        raise InputError(
            f"no comparison leads from {', '.join(one)} to {', '.join(other)}, so that no scale"
            " holds both; compare some of one with some of the other, or leave some out"
        )


def _require_finite(given: Comparisons, methods: list[str]) -> None:
    """(Ford 1957): however methods are parted in two, some of each part must have won."""
    edges = np.zeros((len(methods),) * 2, bool)
    edges[given.first[given.share > 0], given.second[given.share > 0]] = True
    edges[given.second[given.share < 1], given.first[given.share < 1]] = True
    reached = _reached(edges)
    if reached.all():
        return
    start = int(np.argmin(reached.all(axis=0)))
    above = [methods[i] for i in np.flatnonzero(reached[:, start] & ~reached[start])]
    above = above or [methods[start]]
    raise NoFiniteStrength(
        f"{', '.join(above)} never lost or drew against the others below, so that no finite"
        " strength explains it; the counts of wins say all there is"
    )

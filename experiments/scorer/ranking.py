"""Which of several sentences a picture fits best, and the table of a whole test."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

BAR = 0.75  # share of views that must rank the right sentence first


class Row(NamedTuple):
    """Of one prompt: the share of its views ranked first and what the others were taken for."""

    prompt: str
    first: float
    mistaken: dict[str, int]


def similarities(pictures: np.ndarray, sentences: np.ndarray) -> np.ndarray:
    """(P, V, S) cosines: of P objects with V pictures each (P, V, D) and sentences (S, D)."""
    return np.einsum("pvd,sd->pvs", pictures, sentences)


def ranked_first(scores: np.ndarray) -> np.ndarray:
    """(P, V) bool: whether object p's own sentence, number p, is above all others in each view.

    A tie is no first place, nor is a score that is not a number. scores: (P, V, S), S >= P.
    """
    own = np.arange(len(scores))
    right = scores[own, :, own]
    others = scores.copy()
    others[own, :, own] = -np.inf
    # `all` over a strict comparison: NaN on either side fails it.
    return (right[..., None] > others).all(-1)


def table(scores: np.ndarray, prompts: Sequence[str]) -> list[Row]:
    """One row for each object, see `ranked_first`; the mistakes most frequent first."""
    first = ranked_first(scores)
    rows = []
    for index, prompt in enumerate(prompts):
        others = scores[index].copy()
        others[:, index] = -np.inf
        taken = Counter(prompts[k] for k in others[~first[index]].argmax(-1))
        rows.append(Row(prompt, float(first[index].mean()), dict(taken.most_common())))
    return rows


def report(rows: Sequence[Row]) -> str:
    """The table to print, with the total and the line that says whether it reaches the bar."""
    lines = [
        f"{row.prompt:<20}{row.first:>6.0%}  "
        + ", ".join(f"{name} ({count})" for name, count in row.mistaken.items())
        for row in rows
    ]
    total = float(np.mean([row.first for row in rows]))
    below = [row.prompt for row in rows if row.first < BAR]
    lines.append(f"{'total':<20}{total:>6.1%}")
    lines.append(
        f"{len(rows) - len(below)} of {len(rows)} prompts reach {BAR:.0%} of their views; "
        f"all views together: {'at or above' if total >= BAR else 'below'} {BAR:.0%}"
        + (f"; below: {', '.join(below)}" if below else "")
    )
    return "\n".join(line.rstrip() for line in lines)

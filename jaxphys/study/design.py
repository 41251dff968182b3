"""Who sees what, where and when: balanced, blinded, and decided by the seed alone.

Every trial is shown equally often but for one, and each of a pair stands on each side equally often
but for one. The trials of a question stand in a ring in which methods take turns; each seat takes
the next ones, so that within a seat too no method comes up more than two times more than another.
The order in which a seat sees its pages is random.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from jaxphys.study.config import SAME, SCALE, Study

Clip = tuple[int, int]  # number of an item and of a method


@dataclass(frozen=True)
class Page:
    """A question about one clip, or about two: left, right.

    Attributes:
        question: its number.
        clips: one or two.
        wanted: the one right answer of a trap; None where any is right.
    """

    question: int
    clips: tuple[Clip, ...]
    wanted: str | int | None = None


def assigned(study: Study) -> list[list[Page]]:
    """The pages of each seat, in order."""
    random = np.random.default_rng([study.seed, 1])
    seats: list[list[Page]] = [[] for _ in range(study.seats)]
    for number, question in enumerate(study.questions):
        if question.kind == "rating":
            ring, share = _rated(study, random), study.ratings
        else:
            ring, share = _compared(study, random), study.pairs
        share = len(ring) if share is None else min(share, len(ring))
        shown = np.zeros(len(ring), int)
        for seat, pages in enumerate(seats):
            for place in range(seat * share, (seat + 1) * share):
                index = place % len(ring)
                clips = ring[index]
                if (shown[index] + index) % 2:
                    clips = clips[::-1]
                shown[index] += 1
                pages.append(Page(number, clips))
    return [
        _with_traps(study, pages, np.random.default_rng([study.seed, 2, seat]))
        for seat, pages in enumerate(seats)
    ]


def _rated(study: Study, random: np.random.Generator) -> list[tuple[Clip, ...]]:
    """Every clip once; of neighbours each is by another method."""
    items = random.permutation(len(study.items)).tolist()
    methods = random.permutation(len(study.methods)).tolist()
    count = len(methods)
    return [
        ((item, methods[(place + turn) % count]),)
        for turn in range(count)
        for place, item in enumerate(items)
    ]


def _compared(study: Study, random: np.random.Generator) -> list[tuple[Clip, ...]]:
    """Every pair of methods of every item once."""
    items = random.permutation(len(study.items)).tolist()
    pairs = list(combinations(random.permutation(len(study.methods)).tolist(), 2))
    return [
        tuple((item, method) for method in pairs[(place + turn) % len(pairs)])
        for turn in range(len(pairs))
        for place, item in enumerate(items)
    ]


def _with_traps(study: Study, pages: list[Page], random: np.random.Generator) -> list[Page]:
    """The pages in random order, and traps among them, none of which comes first."""
    ordered = [pages[i] for i in random.permutation(len(pages))]
    kinds = {question.kind: i for i, question in reversed(list(enumerate(study.questions)))}
    for kind, number in sorted(kinds.items()):
        for _ in range(study.traps):
            clip = int(random.integers(len(study.items))), int(random.integers(len(study.methods)))
            if kind == "rating":
                trap = Page(number, (clip,), int(random.choice(SCALE)))
            else:
                trap = Page(number, (clip, clip), SAME)
            ordered.insert(int(random.integers(1, len(ordered) + 1)), trap)
    return ordered

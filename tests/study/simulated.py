"""Raters that are simulated from a known truth. No person gave any of these answers; every file
that is written of them says so."""

import json

import numpy as np

from jaxphys.study.config import LEFT, RIGHT, SAME, Item, Question, Study
from jaxphys.study.design import assigned
from jaxphys.study.make import key_of
from jaxphys.study.study_page import FORMAT, VERSION

METHODS = ("ours", "rival", "baseline")


def study(items=4, methods=METHODS, kinds=("rating", "pair"), **changes):
    """A study of made-up clips."""
    things = tuple(
        Item(f"thing {i}", {name: f"{name}/{i}.mp4" for name in methods}, f"a thing, number {i}")
        for i in range(items)
    )
    texts = {"rating": "It moves as it should.", "pair": "Which moves more as it should?"}
    questions = tuple(Question(f"{kind} of motion", texts[kind], kind) for kind in kinds)
    return Study(things, questions, **changes)


def files_of(folder, given, answer, careless=(), unfinished=()):
    """Writes key.json, and answers of every seat by answer(seat, page); returns the latters' paths.

    Careless seats answer traps wrongly.
    """
    folder.mkdir(parents=True, exist_ok=True)
    seats = assigned(given)
    (folder / "key.json").write_text(json.dumps(key_of(given, seats, "simulated")))
    paths = []
    for seat, pages in enumerate(seats):
        values = []
        for page in pages:
            if page.wanted is None:
                values.append(answer(seat, page))
            elif seat in careless:
                values.append(page.wanted % 5 + 1 if isinstance(page.wanted, int) else LEFT)
            else:
                values.append(page.wanted)
        if seat in unfinished:
            values = values[:-1]
        path = folder / f"simulated-{seat + 1}.json"
        path.write_text(
            json.dumps(
                {
                    "format": FORMAT,
                    "version": VERSION,
                    "study": "simulated",
                    "seat": seat,
                    "simulated": True,
                    "finished": seat not in unfinished,
                    "answers": [
                        {"page": i, "answer": value, "plays": [1], "seconds": 1.0}
                        for i, value in enumerate(values)
                    ],
                }
            )
        )
        paths.append(path)
    return paths


class Raters:
    """They rate round(quality + own leaning + noise) within 1 to 5, and choose by strength.

    Args:
        seed: of every draw.
        quality: of each method, on the scale of ratings.
        strengths: of each method, of Bradley and Terry's kind.
        leaning: standard deviation of what a rater adds to all own ratings.
        stubborn: share of a rater's comparisons of two methods that follow one draw for all items:
            the chances of each answer stay what they are, answers of one rater hang together.
        ties: share of comparisons without a difference.
        most: raters.
    """

    def __init__(
        self, seed, quality, strengths, leaning=0.5, noise=0.7, stubborn=0.5, ties=0.0, most=100
    ):
        self._random = np.random.default_rng(seed)
        self._quality, self._strengths = np.asarray(quality), np.asarray(strengths)
        self._noise, self._stubborn, self._ties = noise, stubborn, ties
        self._own = leaning * self._random.normal(size=most)
        self._drawn = self._random.random((most, len(strengths), len(strengths)))

    def ratings(self, seats, methods):
        """From 1 to 5, for arrays of who rates and what."""
        values = self._quality[methods] + self._own[seats]
        values = values + self._noise * self._random.normal(size=np.shape(values))
        return np.clip(np.round(values), 1, 5).astype(int)

    def wins(self, seats, one, other):
        """Whether the first is chosen, for arrays of who chooses, and of which."""
        low, high = np.minimum(one, other), np.maximum(one, other)
        fresh, again = self._random.random((2, *np.shape(low)))
        draw = np.where(again < self._stubborn, self._drawn[seats, low, high], fresh)
        chance = 1 / (1 + np.exp(self._strengths[high] - self._strengths[low]))
        return (draw < chance) == (np.asarray(one) == low)

    def __call__(self, seat, page):
        if len(page.clips) == 1:
            return int(self.ratings(seat, page.clips[0][1]))
        (_, left), (_, right) = page.clips
        if self._random.random() < self._ties:
            return SAME
        return LEFT if self.wins(seat, left, right) else RIGHT

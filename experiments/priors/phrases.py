"""Captions as the priors are told them: embeddings of the object and of its other phrases."""

from collections.abc import Callable, Sequence

import numpy as np

from jaxphys.guidance.guides import phrases_of

PHRASES = 7  # beside the object; most captions have fewer
DROPPED = 0.1  # share of phrases that a training batch does without, one by one
REMEMBERED = 100_000  # phrases, 150 MB


class PhraseEncoder:
    """Captions to (B, 1 + PHRASES, D), with a memory: phrases recur, captions do not.

    `encode` is the text encoder; `texts` and `vectors` are what is known of it at the start.
    """

    def __init__(
        self,
        encode: Callable[[Sequence[str]], np.ndarray],
        texts: Sequence[str] = (),
        vectors: np.ndarray | None = None,
    ):
        self._encode = encode
        self._known = dict(zip(texts, vectors, strict=True)) if vectors is not None else {}

    def __call__(self, captions: Sequence[str]) -> np.ndarray:
        phrases = [phrases_of(caption, PHRASES) for caption in captions]
        new = sorted({p for row in phrases for p in row if p not in self._known})
        if len(self._known) + len(new) > REMEMBERED:
            self._known.clear()
            return self(captions)
        if new:
            self._known.update(zip(new, self._encode(new), strict=True))
        width = len(self._known[phrases[0][0]])
        embedded = np.zeros((len(captions), 1 + PHRASES, width), np.float32)
        for row, spoken in zip(embedded, phrases, strict=True):
            row[: len(spoken)] = [self._known[p] for p in spoken]
        return embedded


def drop_phrases(text: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(B, R, D) with some phrases silenced; the object is always named."""
    kept = rng.random(text.shape[:2]) >= DROPPED
    kept[:, 0] = True
    return text * kept[..., None]

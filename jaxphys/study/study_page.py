"""The page that raters open: one question at a time, and no name of a method anywhere."""

from typing import Any

import numpy as np

from jaxphys.page.html import as_data, bundled, data_element, document, escaped
from jaxphys.study.config import SIDES, Study
from jaxphys.study.design import Clip, Page

FORMAT, VERSION = "jaxphys-study-answers", 1
BESIDE = "'self' file:"
ATTENTION = "This page checks attention: answer {}, whatever you see."


def blinded(study: Study) -> dict[Clip, str]:
    """A file's name for each clip that tells nothing."""
    clips = [(i, m) for i in range(len(study.items)) for m in range(len(study.methods))]
    order = np.random.default_rng([study.seed, 3]).permutation(len(clips))
    return {clips[k]: f"clip{place:04d}.mp4" for place, k in enumerate(order)}


def study_page(study: Study, seats: list[list[Page]], identity: str) -> str:
    """The page of all seats; a rater types in the number of one.

    Args:
        study: what is asked.
        seats: from `design.assigned`.
        identity: of the study, which answers repeat.
    """
    names = blinded(study)

    def told(page: Page) -> dict[str, Any]:
        found: dict[str, Any] = {
            "question": page.question,
            "clips": [names[clip] for clip in page.clips],
            "prompt": study.items[page.clips[0][0]].prompt,
        }
        if isinstance(page.wanted, int):
            found["note"] = ATTENTION.format(page.wanted)
        return found

    data = {
        "format": FORMAT,
        "version": VERSION,
        "study": identity,
        "questions": [
            {"kind": one.kind, "text": one.text, "low": one.low, "high": one.high}
            for one in study.questions
        ],
        "sides": SIDES,
        "seats": [[told(page) for page in pages] for pages in seats],
    }
    body = (
        f"<h1>{escaped(study.title)}</h1>\n<p>{escaped(study.consent)}</p>\n"
        '<main id="place"></main>\n<noscript><p>This page needs JavaScript.</p></noscript>\n'
    )
    return document(
        study.title,
        body + data_element("study", "application/json", as_data(data)),
        style=bundled("page.css") + bundled("study.css", "jaxphys.study"),
        script=bundled("study.js", "jaxphys.study"),
        allowed={"media-src": BESIDE},
    )

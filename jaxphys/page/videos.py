"""videos.html: the films of some runs, what was asked for, scores, and each object in 3D."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from string import Template
from typing import Any

from jaxphys.core.errors import InputError
from jaxphys.page.html import as_data, bundled, data_element, document, escaped
from jaxphys.page.motion_data import Packed

LARGEST_PAGE = 500_000_000  # bytes; browsers refuse elements of some 512 MiB of text
TITLE = "Objects in motion"
HELP = (
    "Drag to turn an object, Shift and drag (or the right button) to move it, the wheel to come"
    " nearer; arrow keys, plus, minus and the space bar do the same. In 3D, colours are those that"
    " do not depend on the view (harmonics of degree 0) and the floor has no shadow; the films have"
    " both. Nothing on this page is loaded from elsewhere or sent."
)
# What this page may load: what it made itself out of its own text.
ALLOWED = {"media-src": "blob:", "worker-src": "blob:"}


@dataclass(frozen=True)
class Entry:
    """A run on the page.

    Attributes:
        title: plain text, as all that follows.
        facts: names and values that are told.
        film: an .mp4 file.
        motion: of its Gaussians.
        view: for JSON: target, distance, azimuth, elevation and horizontal field [rad], axes (3,
            3) of azimuth 0, of azimuth 90 and upwards, aspect.
        surroundings: for JSON: background, colour of the floor, place (middle x and y, height,
            extent).
        fps: frames of the film a second.
    """

    title: str
    facts: Mapping[str, str]
    film: bytes
    motion: Packed
    view: Mapping[str, Any]
    surroundings: Mapping[str, Any]
    fps: float
    notes: tuple[str, ...] = field(default=())


def videos_page(entries: Sequence[Entry], title: str = TITLE) -> str:
    """The page of some runs, in their order; equal runs give equal pages.

    Raises:
        InputError: it would be larger than browsers take.
    """
    cards, data = [], []
    card = Template(bundled("card.html"))
    for number, entry in enumerate(entries):
        cards.append(
            card.substitute(
                number=number,
                title=escaped(entry.title),
                facts=table(entry.facts),
                notes=escaped(" ".join((_told(entry), *entry.motion.notes, *entry.notes))),
            )
        )
        header = {
            **entry.motion.header,
            "stride": entry.motion.stride,
            "fps": entry.fps,
            "view": entry.view,
            "surroundings": entry.surroundings,
        }
        film, kind = base64.b64encode(entry.film).decode(), "application/octet-stream"
        data.append(data_element(f"motion-{number}", "application/json", as_data(header)))
        data.append(data_element(f"data-{number}", kind, entry.motion.payload))
        data.append(data_element(f"film-{number}", kind, film))
    size = sum(map(len, data))
    if size > LARGEST_PAGE:
        raise InputError(
            f"the page would have {size / 1e6:.0f} MB, more than {LARGEST_PAGE / 1e6:.0f}; name"
            " fewer runs, or give a smaller --megabytes"
        )
    head = f"<h1>{escaped(title)}</h1>\n<p>{escaped(HELP)}</p>\n"
    return document(
        title,
        head + "".join(cards) + "".join(data),
        style=bundled("page.css"),
        script=bundled("player.js"),
        allowed=ALLOWED,
    )


def table(facts: Mapping[str, str]) -> str:
    """Names and values as a table."""
    rows = [
        f"<tr><th>{escaped(name)}</th><td>{escaped(value)}</td></tr>\n"
        for name, value in facts.items()
    ]
    return f"<table>\n{''.join(rows)}</table>\n" if rows else ""


def _told(entry: Entry) -> str:
    header = entry.motion.header
    size = len(entry.motion.payload) / 1e6
    return f"In 3D: {header['count']} Gaussians, {header['frames']} frames, {size:.1f} MB."

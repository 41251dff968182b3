"""report.html: what a run's folder holds, told in the folder itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxphys.page.curves import curves
from jaxphys.page.html import bundled, document, escaped
from jaxphys.page.videos import table

NAME = "report.html"
# Files beside the page, also where the folder is served.
BESIDE = "'self' file:"
ALLOWED = {"img-src": BESIDE, "media-src": BESIDE, "frame-src": BESIDE}


@dataclass(frozen=True)
class Told:
    """What a report tells; plain text throughout.

    Attributes:
        title: the sentence, or what the objects are made of.
        facts: names and values.
        metrics: the rows of metrics.jsonl.
        gravity: (3,) [m/s^2].
        plan: as `jaxphys plan` prints it.
        commands: how to run it again, a line each.
    """

    title: str
    facts: Mapping[str, str]
    metrics: Sequence[dict[str, Any]]
    gravity: Sequence[float]
    plan: str
    commands: Sequence[str]


def report_page(told: Told) -> str:
    """The page. It shows the picture, the film and the timing of the files beside it, so that what
    differs from one repetition to the next, seconds, is not in it: equal runs give equal pages.
    """
    sections = [
        f"<h1>{escaped(told.title)}</h1>\n{table(told.facts)}",
        '<div class="pair">\n<video src="motion.mp4" controls loop muted playsinline'
        ' preload="metadata" aria-label="The film"></video>\n'
        '<img src="contact_sheet.png" alt="Pictures of the film, evenly spaced in time"></div>\n',
        _section("Curves", _curves(told)),
        _section("Run it again", f"<pre>{escaped(chr(10).join(told.commands))}</pre>\n"),
        _section(
            "Time taken",
            '<p class="small">Seconds by stage, from timing.json; what was compiled apart.</p>\n'
            '<iframe src="timing.json" title="timing.json"></iframe>\n',
        ),
        _section("Plan", f"<pre>{escaped(told.plan)}</pre>\n"),
    ]
    return document(told.title, "".join(sections), style=bundled("page.css"), allowed=ALLOWED)


def _section(title: str, body: str) -> str:
    return f"<section>\n<h2>{escaped(title)}</h2>\n{body}</section>\n"


def _curves(told: Told) -> str:
    rows = told.metrics
    times = [row["time"] for row in rows]
    mass = np.array([row["mass"] for row in rows], float)
    places = np.array([row["centre_of_mass"] for row in rows], float).reshape(-1, 3)
    kinetic = np.array([row["kinetic_energy"] for row in rows], float)
    height = -mass * (places @ np.asarray(told.gravity, float))
    height = height - height[:1]
    momentum = np.array([row["momentum"] for row in rows], float).reshape(-1, 3)
    charts = [
        curves(
            times,
            {
                "kinetic": kinetic.tolist(),
                "in gravity, from the start": height.tolist(),
                "sum of both": (kinetic + height).tolist(),
            },
            "J",
            "Energy of motion and of height",
        ),
        curves(
            times,
            {axis: momentum[:, i].tolist() for i, axis in enumerate("xyz")},
            "kg m/s",
            "Momentum",
        ),
    ]
    pieces = [row.get("pieces") for row in rows]
    if rows and None not in pieces:
        charts.append(
            curves(times, {"pieces": [float(row["pieces"]) for row in rows]}, "1", "Pieces")
        )
    note = (
        '<p class="small">Energy that is stored in the deformation is in none of these curves: runs'
        " do not keep it.</p>\n"
    )
    inner = "".join(f"<div>{chart}</div>\n" for chart in charts)
    return f'<div class="pair">\n{inner}</div>\n{note}'

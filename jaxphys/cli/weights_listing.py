"""What is known of weights, as text and JSON."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from jaxphys.weights import FOLDER, manifest
from jaxphys.weights.catalogue import CATALOGUE
from jaxphys.weights.places import best_place
from jaxphys.weights.resolve import size_text
from jaxphys.weights.verify import Verdict

BUNDLED = {
    "pixel_prior": "the bundled 2D prior",
    "point_prior": "the bundled 3D prior over points",
    "shape_autoencoder": "surfaces from latents, for the bundled 3D prior",
    "latent_prior": "the bundled 3D prior over latents of surfaces",
    "text_encoder": "sentences to vectors, for the bundled priors",
}


def listing(environment: Mapping[str, str] = os.environ) -> list[dict]:
    """Of every network, bundled ones first: name, aliases, purpose, licence, size [bytes],
    `where` (a file or folder, None if it is nowhere) and the `missing` files."""
    found = [
        {
            "name": name,
            "aliases": [],
            "purpose": BUNDLED.get(name, entry["data"]),
            "licence": entry["licence"],
            "size": entry["bytes"],
            "where": str(FOLDER / entry["file"]),
            "missing": [] if (FOLDER / entry["file"]).is_file() else [entry["file"]],
        }
        for name, entry in manifest().items()
    ]
    for entry in CATALOGUE.values():
        folder, lacking = best_place(entry, environment)
        found.append(
            {
                "name": entry.name,
                "aliases": list(entry.aliases),
                "purpose": entry.purpose,
                "licence": entry.licence,
                "size": sum(file.size for file in entry.files),
                "where": str(folder) if folder.is_dir() else None,
                "missing": [file.path for file in lacking],
            }
        )
    return found


def as_json(found: Sequence[dict]) -> str:
    """All of it."""
    return json.dumps(found, indent=2)


def as_text(found: Sequence[dict]) -> str:
    """Two lines of each: what it is, and where."""
    lines = []
    for network in found:
        names = " = ".join([network["name"], *network["aliases"]])
        lines.append(f"{names}: {network['purpose']}")
        if not network["missing"]:
            state = f"in {network['where']}"
        elif network["where"] is None:
            state = f"not here; jaxphys weights fetch {network['name']}"
        else:
            state = f"incomplete in {network['where']}: lacks {', '.join(network['missing'])}"
        lines.append(f"    {size_text(network['size'])}, {network['licence']}; {state}")
    return "\n".join(lines)


def verdicts_text(folder: Path, verdicts: Sequence[Verdict]) -> str:
    """The folder, then a line for each file."""
    lines = [f"{folder}:"]
    for verdict in verdicts:
        size = "" if verdict.size is None else f" ({size_text(verdict.size)})"
        state = verdict.problem or f"ok, SHA-256 {verdict.sha256}"
        lines.append(f"  {verdict.path}{size}: {state}")
    return "\n".join(lines)

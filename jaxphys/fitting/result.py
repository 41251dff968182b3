"""What a fit found."""

import json
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxphys.core.checkpoints import fingerprint
from jaxphys.core.files import atomic_path, write_json
from jaxphys.core.run_folder import RunFolder, run_folder
from jaxphys.fitting.uncertainty import Uncertainty
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.pipeline.output import write_lines
from jaxphys.scene.look import Look

SHOWN = 24  # numbers that a table or a curve shows
RESULT, ARRAYS, HISTORY = "result.json", "values.npz", "history.jsonl"


@dataclass(frozen=True)
class Misfit:
    """How far a motion is from an observation: root mean squares, in the observation's units.

    Attributes:
        name: of the observation.
        unit: "m", or "" for pictures.
        noise: that was expected.
        fit: of the fit.
        start: of the numbers it started from.
        still: of nothing that moves: a fit that does not beat it has learned nothing.
    """

    name: str
    unit: str
    noise: float
    fit: float
    start: float
    still: float


@dataclass(frozen=True)
class Fit:
    """The end of a fit.

    Attributes:
        values: the numbers by name, in the user's units; those of groups and nodes as arrays.
        uncertainty: how sure each is; None where the loss is no sum of squares or there are too
            many numbers.
        misfits: of each observation.
        history: a row for each step: stage, loss, and the values where there are few.
        simulation, look: with these numbers.
        motion: at the times of the observations.
        search: which search was used, and why.
        reason: why it ended.
        loss: at the end.
        vector: the numbers on the line, (P,).
    """

    values: dict[str, np.ndarray | float]
    uncertainty: Uncertainty | None
    misfits: tuple[Misfit, ...]
    history: tuple[dict[str, Any], ...]
    simulation: Simulation
    look: Look | None
    motion: Motion
    search: str
    reason: str
    loss: float
    vector: np.ndarray

    def to_json(self) -> dict[str, Any]:
        """As plain values; arrays of more than a few numbers are left to `values.npz`."""
        values = {
            name: np.asarray(value).tolist()
            for name, value in self.values.items()
            if np.size(value) <= SHOWN
        }
        return {
            "values": _rounded(values),
            "uncertainty": self.uncertainty.to_json() if self.uncertainty else None,
            "misfits": [_rounded(vars(one)) for one in self.misfits],
            "loss": _rounded(self.loss),
            "search": self.search,
            "reason": self.reason,
            "steps": len(self.history),
        }

    def save(self, out: str | os.PathLike, *, overwrite: bool = False) -> None:
        """Writes `result.json`, `values.npz` and `history.jsonl` into a folder of its own.

        Raises:
            InputError: `out` holds what no run made, or another fit's results.
        """
        identity = fingerprint(b"fit", json.dumps(self.to_json(), sort_keys=True).encode())
        with run_folder(out, identity, (RESULT, ARRAYS, HISTORY), overwrite=overwrite) as folder:
            self.write(folder)

    def write(self, folder: RunFolder) -> None:
        """Writes the same into a run's folder, in which the names are declared."""
        write_json(folder.file(RESULT), self.to_json())
        arrays: dict[str, Any] = {n: np.asarray(value) for n, value in self.values.items()}
        with atomic_path(folder.file(ARRAYS)) as aside, open(aside, "wb") as file:
            np.savez(file, **arrays)
        write_lines(folder.file(HISTORY), list(self.history))

    def __str__(self) -> str:
        lines = []
        if (sure := self.uncertainty) is not None:
            for i, label in enumerate(sure.labels[:SHOWN]):
                said = f"{sure.value[i]:.4g}"
                if sure.determined(label):
                    said += f"  ({sure.low[i]:.4g} to {sure.high[i]:.4g}, {100 * sure.level:g}%)"
                else:
                    said += "  (not determined by what was observed)"
                lines.append(f"{label:28} {said}")
        else:
            lines += [f"{n:28} {np.asarray(v).ravel()[:6]}" for n, v in self.values.items()]
        for one in self.misfits:
            lines.append(
                f"{one.name:28} off by {one.fit:.3g} {one.unit} (at the start {one.start:.3g}, "
                f"if nothing moved {one.still:.3g})"
            )
        lines.append(f"{self.reason} after {len(self.history)} steps of {self.search}")
        return "\n".join(lines)


def _rounded(value: Any) -> Any:
    """Floats with seven digits, in dicts and lists; None for what is not finite."""
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    if isinstance(value, float):
        return float(f"{value:.7g}") if np.isfinite(value) else None
    return value

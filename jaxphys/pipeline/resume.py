"""What an interrupted simulation goes on from: its newest state, and each frame saved once."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jaxphys.core.checkpoints import Checkpoints, by_name, from_names
from jaxphys.mpm.motion import BodyFrame, Frame, Motion, join
from jaxphys.mpm.state import State, Status

FOLDER = "checkpoint/"


class MotionCheckpoint:
    """A motion in a folder, extended by each save with what is new.

    `frames/` keeps every frame, in pieces named by their last one; `state/` the two newest states.

    Args:
        folder: for both.
        identity: fingerprint of all that decides the motion.
    """

    def __init__(self, folder: Path, identity: str):
        self._frames = Checkpoints(folder / "frames", identity, keep=None)
        self._states = Checkpoints(folder / "state", identity)
        self._saved = 0

    def save(self, state: State, frames: list[Frame], metrics: list[dict]) -> None:
        """Saves the state at the last of these frames, and of the frames those that are new."""
        last = len(frames) - 1
        if self._saved <= last:
            text = json.dumps(metrics[self._saved :]).encode()
            arrays = by_name(join(frames[self._saved :]))
            arrays |= {
                "first": np.asarray(self._saved, np.int64),
                "metrics": np.frombuffer(text, np.uint8),
            }
            self._frames.save(last, arrays)
            self._saved = last + 1
        if last not in self._states.steps():
            self._states.save(last, by_name(state))

    def restore(self, like: State) -> tuple[int, State, list[Frame], list[dict]] | None:
        """The newest state of which all frames are whole, its number, the frames up to it and what
        is known of each; None if there is none.

        What is damaged is said on standard error, and so is what the motion goes on from then.
        """
        pieces, known = [], 0
        for last in self._frames.steps():
            piece = self._frames.load(last)
            if int(piece["first"]) != known:
                break
            pieces.append((last, piece))
            known = last + 1
        newest = max(self._frames.steps() + self._states.steps(), default=-1)
        self._states.drop_after(known - 1)
        found = self._states.newest()
        number = found[0] if found else -1
        if number < newest:
            where = f"goes on from frame {number}" if found else "starts anew"
            print(f"jaxphys: the simulation {where}", file=sys.stderr)
        self._frames.drop_after(number)
        self._saved = number + 1
        if not found:
            return None
        frames: list[Frame] = []
        metrics: list[dict] = []
        for piece in (piece for last, piece in pieces if last <= number):
            motion = _motion(piece)
            frames.extend(motion[index] for index in range(len(motion)))
            metrics.extend(json.loads(piece["metrics"].tobytes()))
        return number, from_names(like, found[1]), frames, metrics


def _motion(piece: dict[str, np.ndarray]) -> Motion:
    arrays: Mapping[str, Any] = piece  # of numpy, as everything in files
    status = Status(*(arrays[f"status/{name}"] for name in Status._fields))
    position, deformation, time = (arrays[name] for name in ("position", "deformation", "time"))
    names = {name: f"body/{name}" for name in BodyFrame._fields}
    there = names["centre"] in arrays
    body = BodyFrame(**{k: arrays[name] for k, name in names.items()}) if there else None
    return Motion(position, deformation, time, status, arrays["carriers"], body)

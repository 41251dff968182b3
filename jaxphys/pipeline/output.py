"""What a run says of itself: rows of numbers, and how long each stage took."""

import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

from jaxphys.core.files import atomic_path, write_json


def write_lines(path: str | os.PathLike, rows: list[dict]) -> None:
    """One JSON object a line, keys in order of appearance."""
    with atomic_path(path) as aside:
        aside.write_text("".join(json.dumps(row) + "\n" for row in rows))


class Timing:
    """Seconds by stage, compilation apart.

    Attributes:
        stages: seconds of each stage without what it spent compiling.
        compile: seconds spent compiling in each stage.
    """

    def __init__(self):
        self.stages: dict[str, float] = {}
        self.compile: dict[str, float] = {}
        self._begin = time.perf_counter()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Counts the time inside towards `name`."""
        before, begin = sum(self.compile.values()), time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - begin - (sum(self.compile.values()) - before)
            self.stages[name] = self.stages.get(name, 0.0) + spent

    @contextmanager
    def compiling(self, name: str) -> Iterator[None]:
        """Counts the time inside as compilation of `name`."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.compile[name] = self.compile.get(name, 0.0) + time.perf_counter() - begin

    def write(self, path: str | os.PathLike) -> None:
        """Writes `{"stages": ..., "compile": ..., "total": ...}`, in seconds."""
        write_json(
            path,
            {
                "stages": {name: round(spent, 3) for name, spent in self.stages.items()},
                "compile": {name: round(spent, 3) for name, spent in self.compile.items()},
                "total": round(time.perf_counter() - self._begin, 3),
            },
        )

"""Lines of results: one a case, appended when it is finished, so that a run that was stopped goes
on with the next.
"""

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from benchmarks.worker import machine
from jaxphys.core.errors import InputError

Line = dict[str, Any]
Cases = Mapping[str, Callable[[], Line]]


def read(path: Path) -> list[Line]:
    """Lines of a file, none where there is none. What a kill left half-written is not one."""
    if not path.exists():
        return []
    return [json.loads(text) for text in path.read_text().splitlines(True) if text.endswith("\n")]


def run(cases: Cases, path: Path) -> None:
    """Runs the cases that a file lacks and appends their lines."""
    lines = read(path)
    done = {line["case"] for line in lines}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    for name, case in cases.items():
        if name in done:
            continue
        begin, used = time.perf_counter(), time.process_time()
        try:
            found = {"status": "ok"} | case()
        except InputError as error:
            found = {"status": "failed", "reason": str(error)}
        spent = {
            "seconds": round(time.perf_counter() - begin, 1),
            "cpu_seconds": round(time.process_time() - used, 1),
        }
        line = {"case": name, **found, **spent, **machine()}
        with path.open("a") as out:
            out.write(json.dumps(line) + "\n")
        print(json.dumps(line), flush=True)


def markdown(head: tuple[str, ...], rows: list[tuple]) -> str:
    """A table in Markdown."""
    made = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*made, *("| " + " | ".join(map(str, row)) + " |" for row in rows)])

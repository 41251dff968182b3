"""`python -m tests.fuzz.long COUNT [NAME...]`: many spoiled files by hand, with what they raise."""

import collections
import resource
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path
from random import Random

from jaxphys.core.errors import InputError
from tests.fuzz.readers import CASES, spoil

LONGEST, SECONDS, MEGABYTES = 300, 20, 1000


def judge(case, path: Path) -> str | None:
    """What is wrong with the way in which a spoiled file was read."""
    try:
        case.read(path)
    except InputError as error:
        text = str(error)
        if not text.isprintable() or len(text) > LONGEST:
            return f"message {text!r}"
        if str(path.parent) not in text:
            return f"message without the file: {text}"
    except Exception:
        return traceback.format_exc(limit=-4)
    return None


def main(count: int, names: list[str]) -> None:
    def too_long(*_):
        raise TimeoutError("too long")

    signal.signal(signal.SIGALRM, too_long)
    total, kinds = 0, collections.Counter()
    for name in names or CASES:
        bad = 0
        for seed in range(count):
            with tempfile.TemporaryDirectory() as folder:
                path = spoil(CASES[name], Path(folder), Random(f"{name}{seed}"))
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                signal.alarm(SECONDS)
                start = time.process_time()
                found = judge(CASES[name], path)
                signal.alarm(0)
                grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1000
                if grown > MEGABYTES:
                    found = f"{grown:.0f} MB; {found}"
                if time.process_time() - start > SECONDS / 2:
                    found = f"slow; {found}"
            total += 1
            if found is not None:
                bad += 1
                key = found.strip().splitlines()[-1][:100]
                kinds[name, key] += 1
                if kinds[name, key] == 1:
                    print(f"--- {name} {seed}\n{found}", flush=True)
        print(f"{name}: {bad} of {count}", flush=True)
    print(f"{sum(kinds.values())} of {total} files")


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])

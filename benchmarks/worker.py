"""Runs one case in this process and prints its measurements as the last line of standard output."""

import importlib
import json
import os
import platform
import resource
import statistics
import subprocess
import time
from importlib import metadata

SUITES = (
    *("mpm", "mpm-grad", "scaling", "render", "drawing", "headline", "order", "implicit"),
    *("extreme", "extreme-peers", "leave-out", "work-precision", "newton-examples"),
)
MINIMUM_CALLS = 3


def suite_module(suite: str):
    """The module that bears a suite's name."""
    return importlib.import_module(f"benchmarks.{suite.replace('-', '_')}")


def suite_cases(suite: str, quick: bool) -> list:
    """The cases of a suite: `cases(quick)` of its module."""
    return suite_module(suite).cases(quick)


def versions() -> dict[str, str]:
    """Versions of what is measured and of what it stands on."""
    found = {"python": platform.python_version()}
    for name in ("jaxphys-splats", "jax", "jaxlib", "numpy", "taichi"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, object]:
    """The processor, as its maker calls it, and how many cores there are."""
    names = []
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if "model name" in line]
    return {"processor": names[0] if names else platform.processor(), "cores": os.cpu_count()}


def commit(checkout: str = ".") -> str | None:
    """A checkout's commit, with a plus where files differ from it; None: unknown."""

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", "-C", checkout, *words], capture_output=True, text=True, check=True
        ).stdout

    try:
        changed = git("status", "--porcelain", "--untracked-files=no").strip()
        return git("rev-parse", "--short", "HEAD").strip() + ("+" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return None


def timed(call) -> float:
    """Seconds that one call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def measure(suite: str, name: str, method: str, quick: bool) -> dict:
    """Prepares the case, calls it for a second or two after one warm-up call, and describes what
    was seen.
    """
    (case,) = [c for c in suite_cases(suite, quick) if (c.name, c.method) == (name, method)]
    prepared = case.prepare()
    samples = [timed(prepared.call)]
    budget = 0.5 if quick else 2.0
    if not prepared.once:
        samples.clear()
        while len(samples) < MINIMUM_CALLS or (sum(samples) < budget and len(samples) < 200):
            samples.append(timed(prepared.call))
    return {
        "suite": suite,
        "case": name,
        "method": method,
        **case.size,
        "dtype": case.dtype,
        "seconds": statistics.median(samples),
        "samples": samples,
        "work": prepared.work,
        "compile_seconds": prepared.compile_seconds,
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "error": prepared.error() if prepared.error else None,
        "status": "ok",
        "versions": versions(),
        "machine": machine(),
        "commit": commit(),
        **prepared.extra,
        **prepared.found(),
    }


def main(suite: str, name: str, method: str, quick: bool) -> None:
    """Measures one case and prints one JSON line."""
    print(json.dumps(measure(suite, name, method, quick)), flush=True)

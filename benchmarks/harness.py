"""One fresh process per case and round, methods of a case in turn; medians over the processes.

Process-level medians carry the variance that matters (memory layout, frequency, scheduling), so the
line holds the median over rounds, the spread between rounds, and every raw sample. A method that
fails is a line with a status, not a missing line.
"""

import json
import os
import statistics
import subprocess
import sys
from collections.abc import Iterator
from itertools import groupby

from benchmarks.worker import suite_cases, suite_module

TIMEOUT_SECONDS = 900


def run_process(suite: str, name: str, method: str, quick: bool) -> dict:
    """One round of one case in its own process."""
    command = [sys.executable, "-m", "benchmarks", "worker", suite, name, method]
    command += ["--quick"] if quick else []
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_SECONDS)
    except subprocess.TimeoutExpired:
        return {"status": f"timeout after {TIMEOUT_SECONDS} s"}
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no output"])[-1]
        return {"status": f"exit {done.returncode}: {last[:300]}"}
    return json.loads(done.stdout.strip().splitlines()[-1])


def merge_rounds(identity: dict, rounds: list[dict]) -> dict:
    """One line out of the rounds of one case: medians, spread, and all samples."""
    good = [r for r in rounds if r.get("status") == "ok"]
    if not good:
        return {**identity, **rounds[-1]}
    medians = [r["seconds"] for r in good]
    line = {**good[0], **identity}
    line["samples"] = [r["samples"] for r in good]
    line["seconds"] = statistics.median(medians)
    line["seconds_low"], line["seconds_high"] = min(medians), max(medians)
    line["peak_bytes"] = max(r["peak_bytes"] for r in good)
    failed = [r["status"] for r in rounds if r.get("status") != "ok"]
    if failed:
        line["status"] = f"{len(failed)} of {len(rounds)} rounds failed: {failed[0]}"
    line["load_before"] = rounds[0].get("load_before")
    return line


def peer_ratios(lines: list[dict], ours: str = "jaxphys") -> Iterator[dict]:
    """Work per second of ours over each peer's on the same case, round by round; above 1 is
    faster.
    """
    measured = {line["method"]: line for line in lines if "work" in line}
    if ours not in measured:
        return
    mine = measured[ours]
    for method, peer in measured.items():
        if method == ours or method.startswith(f"{ours}-"):
            continue
        yield _compared(mine, {"peer": method}, "ratio", rate_ratios(mine, peer))


def baseline_costs(lines: list[dict], baselines: set[str], ours: str = "jaxphys") -> Iterator[dict]:
    """Time per work of ours over that of each baseline method of the same case, round by round."""
    measured = {line["method"]: line for line in lines if "work" in line}
    if ours not in measured:
        return
    for method in sorted(baselines & measured.keys()):
        pairs = rate_ratios(measured[method], measured[ours])
        yield _compared(measured[ours], {"baseline": method}, "cost", pairs)


def rate_ratios(line: dict, other: dict) -> list[float]:
    """Work per second of one line over that of the other, one number a round."""
    return [
        line["work"] / statistics.median(a) / (other["work"] / statistics.median(b))
        for a, b in zip(line["samples"], other["samples"], strict=False)
    ]


def _compared(line: dict, other: dict, name: str, pairs: list[float]) -> dict:
    identity = {key: line[key] for key in ("suite", "case", "method")}
    spread = {f"{name}_low": min(pairs), f"{name}_high": max(pairs)}
    return {**identity, **other, name: statistics.median(pairs), **spread}


def run_suite(
    suite: str, quick: bool, times: int | None = None, done: frozenset[str] = frozenset()
) -> Iterator[dict]:
    """Lines of one suite: one per case and method, then one per peer and baseline. A suite of
    outcomes instead of times has `lines` of its own, from this process.

    times: processes for each case; None: as the suite says, one if it is to be quick.
    done: names of cases that are not to be run again.
    """
    own = getattr(suite_module(suite), "lines", None)
    if own is not None:
        yield from own(quick)
        return
    yield from getattr(suite_module(suite), "left_out_lines", list)()
    for name, group in groupby(suite_cases(suite, quick), key=lambda case: case.name):
        if name in done:
            continue
        cases = list(group)
        rounds: dict[str, list[dict]] = {case.method: [] for case in cases}
        usual = 1 if quick else max(case.rounds for case in cases)
        for turn in range(usual if times is None else times):
            order = cases if turn % 2 == 0 else cases[::-1]
            for case in order:
                load = os.getloadavg()[0]
                result = run_process(suite, case.name, case.method, quick)
                rounds[case.method].append({**result, "load_before": load})
        identity = [
            {"suite": suite, "case": c.name, "method": c.method, **c.size, "dtype": c.dtype}
            for c in cases
        ]
        lines = [merge_rounds(i, rounds[i["method"]]) for i in identity]
        yield from lines
        yield from peer_ratios(lines)
        yield from baseline_costs(lines, {case.method for case in cases if case.baseline})

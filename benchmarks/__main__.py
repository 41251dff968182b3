"""Runs benchmarks, and makes figures and tables of what they wrote.

python -m benchmarks run SUITE --out FILE.jsonl [--quick] [--rounds N] [--resume]
python -m benchmarks report
"""

import argparse
import json
import sys
from pathlib import Path

from benchmarks import worker
from benchmarks.harness import run_suite


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Command line of the harness."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="run a suite and append its lines to a file")
    run.add_argument("suite", choices=[*worker.SUITES, "all"])
    run.add_argument("--out", type=Path, required=True)
    run.add_argument("--quick", action="store_true", help="small cases, under a minute a suite")
    run.add_argument("--rounds", type=int, help="processes for each case, instead of the suite's")
    run.add_argument("--resume", action="store_true", help="skip cases that FILE has lines of")
    report = commands.add_parser("report", help="rebuild docs/benchmarks from committed lines")
    report.add_argument("--lines", type=Path, default=Path("benchmarks/lines"))
    report.add_argument("--out", type=Path, default=Path("docs/benchmarks"))
    one = commands.add_parser("worker", help="measure one case in this process")
    one.add_argument("suite", choices=worker.SUITES)
    one.add_argument("case")
    one.add_argument("method")
    one.add_argument("--quick", action="store_true")
    return parser.parse_args(arguments)


def describe(line: dict) -> str:
    """A line for a person, on standard error."""
    head = f"{line['suite']:9} {line['case']:28} {line['method']:19}"
    if "ratio" in line:
        return f"{head} {line['ratio']:.2f} x {line['peer']}"
    if "cost" in line:
        return f"{head} {line['cost']:.2f} of {line['baseline']}"
    if "seconds" not in line:
        return f"{head} {line['status']}"
    compiled = line["compile_seconds"]
    return (
        f"{head} {line['seconds'] * 1e3:10.1f} ms"
        + (f"  compile {compiled:.1f} s" if compiled is not None else "")
        + f"  peak {line['peak_bytes'] / 2**30:.2f} GiB"
        + (f"  error {line['error']:.2e}" if line["error"] is not None else "")
    )


def _done(path: Path, suite: str) -> frozenset[str]:
    """Names of a suite's cases that a file has lines of; a case's lines are written together."""
    lines = map(json.loads, path.read_text().splitlines()) if path.exists() else ()
    return frozenset(line["case"] for line in lines if line["suite"] == suite)


def main() -> None:
    """Entry point."""
    options = parse()
    if options.command == "worker":
        worker.main(options.suite, options.case, options.method, options.quick)
        return
    if options.command == "report":
        from benchmarks.report import write_report

        write_report(options.lines, options.out)
        return
    options.out.parent.mkdir(parents=True, exist_ok=True)
    suites = worker.SUITES if options.suite == "all" else (options.suite,)
    with options.out.open("a") as out:
        for suite in suites:
            done = _done(options.out, suite) if options.resume else frozenset()
            for line in run_suite(suite, options.quick, options.rounds, done):
                out.write(json.dumps(line) + "\n")
                out.flush()
                print(describe(line), file=sys.stderr)


if __name__ == "__main__":
    main()

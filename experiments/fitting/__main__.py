"""What fits find of numbers that are known.

    python -m experiments.fitting published --out benchmarks/lines/fitting-published.jsonl
    python -m experiments.fitting published --table benchmarks/lines/fitting-published.jsonl

A run goes on where it was stopped. `--only torus` runs the cases with that in their name.
"""

import argparse
import importlib
from pathlib import Path

from experiments.lines import read, run

NAMES = ("published", "coverage", "field", "laws", "held_out", "kill", "guided")


def main(arguments: list[str] | None = None) -> None:
    """Runs an experiment's cases that a file lacks, or prints its table."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.fitting", description=__doc__.splitlines()[0]
    )
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("--out", type=Path, help="lines are appended here")
    parser.add_argument("--table", type=Path, help="print the table of these lines instead")
    parser.add_argument("--quick", action="store_true", help="few cases, coarse and short")
    parser.add_argument("--only", default="", help="cases with this in their name")
    options = parser.parse_args(arguments)
    experiment = importlib.import_module(f"experiments.fitting.{options.name}")
    if options.table is not None:
        print(experiment.table(read(options.table)))
        return
    if options.out is None:
        parser.error("give --out or --table")
    cases = experiment.cases(options.quick)
    run({name: case for name, case in cases.items() if options.only in name}, options.out)


if __name__ == "__main__":
    main()

"""Figures and tables of docs/benchmarks, from committed lines and nothing else.

    python -m benchmarks report

reads work-precision.jsonl, tolerance.jsonl and leave-out.jsonl of benchmarks/lines, and writes
README.md, tolerance.md and leave_out.md of docs/benchmarks and the figures that they show. The
same lines give the same bytes.
"""

import json
import math
from collections import Counter, defaultdict
from pathlib import Path

from benchmarks.leave_out import cases as leave_out_cases
from benchmarks.report_figures import draw_profile, draw_sheet
from benchmarks.report_leave_out import leave_out_page
from benchmarks.report_peers import peers_section
from benchmarks.report_tolerance import tolerance_page

SUITE = "work-precision"
BASE = "jaxphys-float64"
FAILED = math.inf


def read_lines(path: Path) -> list[dict]:
    """The suite's lines of a file, but for those of peers that were not there; of several for one
    case and method, the last.
    """
    latest = {}
    for text in path.read_text().splitlines():
        line = json.loads(text)
        told = "ratio" not in line and "cost" not in line and line.get("case") != "peers"
        if line.get("suite") == SUITE and told:
            # A process that failed tells nothing but its case.
            line.setdefault("problem", line["case"].rsplit("-", 1)[0])
            line.setdefault("resolution", line.get("cells", 0))
            latest[line["case"], line["method"]] = line
    return list(latest.values())


def error_of(line: dict) -> float:
    """Its error; infinite where the run failed, or is not even a motion any more."""
    error = line.get("error")
    if error is None or not math.isfinite(error) or line.get("code", 0):
        return FAILED
    return error


def by_problem(lines: list[dict]) -> dict[str, dict[str, list[dict]]]:
    """Lines by problem and method, coarsest first."""
    found: dict[str, dict[str, list[dict]]] = defaultdict(lambda: defaultdict(list))
    for line in lines:
        found[line["problem"]][line["method"]].append(line)
    return {
        problem: {
            method: sorted(ladder, key=lambda line: line.get("resolution", 0))
            for method, ladder in methods.items()
        }
        for problem, methods in found.items()
    }


def observed_order(ladder: list[dict]) -> float | None:
    """Least-squares slope of log(error) over log(1 / resolution), above the reference's floor; None
    for fewer than three such points.
    """
    points = [
        (-math.log(line["resolution"]), math.log(error_of(line)))
        for line in ladder
        if 0 < error_of(line) < FAILED and error_of(line) > 2 * line.get("floor", 0.0)
    ]
    if len(points) < 3:
        return None
    x, y = (sum(values) / len(points) for values in zip(*points, strict=True))
    return sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)


def orders_table(problems: dict) -> str:
    """Observed orders of the defaults."""
    rows = [
        "| problem | grids | error, coarse to fine | reference good to | order, expected "
        "| observed | seconds, coarse to fine | compile | peak |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for problem, methods in problems.items():
        if BASE not in methods or problem in ("picture", "gradient"):
            continue
        ladder = [line for line in methods[BASE] if "seconds" in line]
        if not ladder:
            rows.append(f"| {problem} | | {methods[BASE][0]['status'][:80]} | | | | | | |")
            continue
        order, expected = observed_order(ladder), ladder[0].get("expected_order")
        floor = ladder[0].get("floor", 0.0)
        rows.append(
            f"| {problem} | {', '.join(str(line['resolution']) for line in ladder)} "
            f"| {', '.join(_error_text(line) for line in ladder)} "
            f"| {f'{floor:.1%}' if floor else 'exact'} "
            f"| {'-' if expected is None else expected} "
            f"| {'-' if order is None else f'{order:.2f}'} "
            f"| {', '.join(_seconds_text(line['seconds']) for line in ladder)} "
            f"| {max(line['compile_seconds'] or 0 for line in ladder):.1f} s "
            f"| {max(line['peak_bytes'] for line in ladder) / 2**30:.2f} GiB |"
        )
    return "\n".join(rows)


def _error_text(line: dict) -> str:
    error = error_of(line)
    return "failed" if error == FAILED else f"{error:.1e}"


def _seconds_text(seconds: float) -> str:
    return f"{seconds:.2g} s" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"


def variants_table(methods: dict[str, list[dict]]) -> str:
    """What each thing that can be turned does to one problem: error and time on each grid."""
    counts = Counter(line["resolution"] for ladder in methods.values() for line in ladder)
    common = sorted(resolution for resolution, count in counts.items() if count > 1)
    rows = [
        "| | " + " | ".join(f"{r}: error, time" for r in common) + " | order |",
        "|---|" + "---|" * (len(common) + 1),
    ]
    for method, ladder in sorted(methods.items()):
        cells = []
        for r in common:
            (line,) = [one for one in ladder if one.get("resolution") == r] or [None]
            if line is None or "seconds" not in line:
                cells.append("-" if line is None else line["status"][:40])
                continue
            cells.append(f"{_error_text(line)}, {_seconds_text(line['seconds'])}")
        order = observed_order([one for one in ladder if "seconds" in one])
        shown = "-" if order is None else f"{order:.2f}"
        rows.append(f"| {_name(method)} | {' | '.join(cells)} | {shown} |")
    return "\n".join(rows)


def _name(method: str) -> str:
    """A method as tables call it."""
    if method == "jaxphys":
        return "float32"
    return {BASE: "float64 (the defaults)"}.get(method, method.removeprefix("jaxphys-"))


def single_table(ladders: dict[str, list[dict]], what: str) -> str:
    """Methods of something that has no grids."""
    rows = [f"| {what} | error | time | compile | peak |", "|---|---|---|---|---|"]
    for method, lines in ladders.items():
        line = lines[-1]
        if "seconds" not in line:
            rows.append(f"| {_name(method)} | {line['status'][:60]} | | | |")
            continue
        rows.append(
            f"| {_name(method)} | {_error_text(line)} | {_seconds_text(line['seconds'])} "
            f"| {line['compile_seconds']:.1f} s | {line['peak_bytes'] / 2**30:.2f} GiB |"
        )
    return "\n".join(rows)


def machines(lines: list[dict]) -> str:
    """Where and with what the lines were taken."""
    found = {
        (line["machine"]["processor"], line["machine"]["cores"], line["versions"].get("jax"),
         line.get("commit"))
        for line in lines if "machine" in line
    }  # fmt: skip
    return "; ".join(
        f"{processor}, {cores} cores, jax {version}, commit {commit}"
        for processor, cores, version, commit in sorted(found, key=str)
    )


PAGE = """# Error against run time

Made by `python -m benchmarks report` from `benchmarks/lines/work-precision.jsonl`, which

    python -m benchmarks run work-precision --out benchmarks/lines/work-precision.jsonl

wrote ({machines}). Each point is a fresh process; methods of one grid run in turn. Times are those
of the compiled rollout from start to end, medians of at least three calls, without compiling, which
stands beside them. Errors are the problems' own norms ([validation](../validation.md)); a dashed
line is how good the reference itself is, and points on the rail at the top have failed.

## All problems, by default

![Error against run time of every problem](error-time.svg)

{orders}

## What can be turned, and peers

Taichi is this very step; Genesis and Newton are what they are ([peers](peers.md)).

![Error against run time of what can be turned](variants.svg)

{variants}

## Against peers

{peers}

## Which is best how often

The share of grids on which a method needs at most so many times the time of the fastest one that is
as accurate, to within a factor of 1.5 (Dolan and More 2002; failures count as never). Only methods
that ran on every problem of the section above on which steps, transfers and kernels were varied.

![Performance profile](profile.svg)

## Pictures

{splats}: root mean square error of a pixel of 1, against all splats at all pixels in float64 with
nothing left out.

{picture}

## Gradients

Of the mean square displacement of the ringing cube, 64 steps, by each particle's Young's modulus;
error relative to `Plain` in float64.

{gradient}

`Truncated` is another gradient, and the error is what it leaves out.
"""


def write_report(lines_folder: Path, out: Path) -> None:
    """Writes the pages and figures of which there are lines."""
    out.mkdir(parents=True, exist_ok=True)
    path = lines_folder / "work-precision.jsonl"
    if path.exists():
        lines = read_lines(path)
        problems = by_problem(lines)
        rollouts = {
            name: methods for name, methods in problems.items()
            if name not in ("picture", "gradient")
        }  # fmt: skip
        draw_sheet({n: {BASE: m[BASE]} for n, m in rollouts.items() if BASE in m},
                   out / "error-time.svg", _name)  # fmt: skip
        varied = {name: methods for name, methods in rollouts.items() if len(methods) > 1}
        if varied:
            draw_sheet(varied, out / "variants.svg", _name)
            # Where only peers stand beside the default, nothing was varied.
            own = {
                name: methods for name, methods in varied.items()
                if any(m.startswith("jaxphys") and m != BASE for m in methods)
            }  # fmt: skip
            draw_profile(own, out / "profile.svg", _name)
        sections = [f"### {name}\n\n{variants_table(m)}" for name, m in varied.items()]
        page = PAGE.format(
            machines=machines(lines),
            orders=orders_table(rollouts),
            variants="\n\n".join(sections),
            peers=peers_section(rollouts, _name, _error_text, _seconds_text),
            splats="A ball of 2,000 splats at 240 x 136",
            picture=single_table(problems.get("picture", {}), "picture"),
            gradient=single_table(problems.get("gradient", {}), "gradient"),
        )
        (out / "README.md").write_text(page)
    path = lines_folder / "tolerance.jsonl"
    if path.exists():
        (out / "tolerance.md").write_text(tolerance_page(path))
    path = lines_folder / "leave-out.jsonl"
    if path.exists():
        parts = list(dict.fromkeys(case.name for case in leave_out_cases(quick=False)))
        (out / "leave_out.md").write_text(leave_out_page(path, parts))

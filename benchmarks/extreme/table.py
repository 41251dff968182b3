"""python -m benchmarks.extreme.table FILE.jsonl > docs/benchmarks/extreme.md"""

import json
import sys
from pathlib import Path

HEAD = """# Stiff and extreme

Made by `python -m benchmarks run extreme --out {file}` and `python -m benchmarks.extreme.table
{file}`; do not edit. Each case has its answer: what a particle alone does, in numpy
(`benchmarks/extreme/lone.py`), what is conserved, what is similar, every splat at every pixel,
central differences, or the one failure that it must end in. `right 3e-07 (23)` is the measure that
comes nearest to its tolerance, after 23 steps; a name such as `COLLAPSED` is the status with which
the last good state comes back; `refused` is one `InputError` before anything runs. `wrong` stands
at controls, which must be found out, and at the exception that
[limitations](../limitations.md#rendering) names.

{cells} cells of {cases} cases: {right} right, {failed} clear failures,
{controls} controls found out, {exceptions} named exception, {unexpected} unexpected.
"""


def cell(line: dict) -> str:
    """What a method came to."""
    text = line["outcome"]
    if text == "right" and line["error"] is not None:
        text += f" {line['error']:.0e}"
    if line["outcome"].isupper():
        text = f"`{text}`"
    if line["steps"]:
        text += f" ({line['steps']})"
    return text if line["status"] == "ok" else f"**{text}, unexpected**"


def short(number: float | None) -> str:
    """A number in few digits, or nothing."""
    return "" if number is None else f"{number:.1e}"


def table(lines: list[dict], file: str) -> str:
    """The whole page."""
    cases: dict[str, dict[str, dict]] = {}
    for line in lines:
        cases.setdefault(line["case"], {})[line["method"]] = line
    counts = {
        "right": sum(x["outcome"] == "right" and x["status"] == "ok" for x in lines),
        "controls": sum(x["group"] == "control" and x["status"] == "ok" for x in lines),
        "exceptions": sum(
            x["outcome"] == "wrong" and x["group"] != "control" and x["status"] == "ok"
            for x in lines
        ),
        "unexpected": sum(x["status"] != "ok" for x in lines),
    }
    counts["failed"] = len(lines) - sum(counts.values())
    text = [HEAD.format(file=file, cells=len(lines), cases=len(cases), **counts)]
    for group in dict.fromkeys(line["group"] for line in lines):
        own = {name: found for name, found in cases.items() if group in _groups(found)}
        methods = list(dict.fromkeys(m for found in own.values() for m in found))
        text += [f"## {group.capitalize()}\n"]
        stable = any(line["largest_stable_dt"] for found in own.values() for line in found.values())
        last = [" largest stable dt [s] |"] if stable else [""]
        text += [f"| case | against | {' | '.join(methods)} |{last[0]}"]
        text += ["|---" * (len(methods) + 2 + stable) + "|"]
        for name, found in own.items():
            row = [cell(found[m]) if m in found else "" for m in methods]
            by = next(iter(found.values()))["by"]
            bound = max((line["largest_stable_dt"] or 0 for line in found.values()), default=0)
            more = f" {short(bound or None)} |" if stable else ""
            text += [f"| {name} | {by} | {' | '.join(row)} |{more}"]
        text += [""]
    return "\n".join(text)


def _groups(found: dict[str, dict]) -> set[str]:
    return {line["group"] for line in found.values()}


def main() -> None:
    """Entry point."""
    path = Path(sys.argv[1])
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    print(table(lines, str(path)), end="")


if __name__ == "__main__":
    main()

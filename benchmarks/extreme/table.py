"""python -m benchmarks.extreme.table FILE.jsonl [PEERS.jsonl] > docs/benchmarks/extreme.md"""

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


PEERS = """
## Peers

Scenes of this page that peers can state, made by
`python -m benchmarks run extreme-peers --out {file}`
with the interpreters that [peers](peers.md) tells of; versions are there. All are held to what any
solver owes (`benchmarks/extreme/peers.py`), within a percent or so: where the middle goes,
momentum, angular momentum to 5 %, an energy that grows by no more than 10 %, one motion at every
stiffness, a rigid turn, and for particles alone (Genesis, which takes this solver's very steps) the
closed form. Genesis takes half of our largest stable step, Newton four times it: Genesis suggests a
step by the grid alone, Newton none. `error` is an exception that says something, `NaN` numbers that
are none with nothing said, **wrong** numbers out of tolerance with nothing said, of which the
measure that is furthest out is named. An error is right where there is nothing to compute. What is
lost to damping is not judged here: Newton's steps lose much.

{counts}

| case | {methods} |
|---{rule}|
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


def peer_cell(line: dict) -> str:
    """What a peer came to, and by which measure."""
    outcome = line["outcome"]
    if outcome == "error":
        return f"error: {line['message'].split(': ', 1)[-1][:70].replace('|', '/')}"
    if outcome == "wrong":
        size = "not finite" if line["error"] is None else f"{line['error']:.1g}"
        return f"**wrong**: {line['measure']} {size}"
    return f"right {line['error']:.0e}" if outcome == "right" else f"**{outcome}**"


def peers_table(lines: list[dict], file: str) -> str:
    """The section on peers."""
    lines = [line for line in lines if "outcome" in line]
    methods = list(dict.fromkeys(line["method"] for line in lines))
    cases: dict[str, dict[str, dict]] = {}
    for line in lines:
        cases.setdefault(line["case"], {})[line["method"]] = line
    counts = []
    for method in methods:
        own = [line["outcome"] for line in lines if line["method"] == method]
        told = [f"{own.count(o)} {o}" for o in ("right", "error", "NaN", "wrong") if o in own]
        counts.append(f"{method}: {len(own)} cases, {', '.join(told)}.")
    head = PEERS.format(
        file=file,
        counts=" ".join(counts),
        methods=" | ".join(methods),
        rule="|---" * len(methods),
    )
    rows = [
        f"| {name} | {' | '.join(peer_cell(found[m]) if m in found else '' for m in methods)} |"
        for name, found in cases.items()
    ]
    return head + "\n".join(rows) + "\n"


def _groups(found: dict[str, dict]) -> set[str]:
    return {line["group"] for line in found.values()}


def main() -> None:
    """Entry point."""
    for path, made in zip(map(Path, sys.argv[1:]), (table, peers_table), strict=False):
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        print(made(lines, str(path)), end="")


if __name__ == "__main__":
    main()

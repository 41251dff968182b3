"""The page of suite 'leave-out'."""

import json
from pathlib import Path

PAGE = """# What a scene does not need

A part that a scene does not ask for leaves nothing in its compiled program, which a test a part
proves (`tests/pipeline/test_leave_out.py`). This is what it costs those who ask for it: the step of
the smallest scene with that part over the step of the smallest scene by itself, both in fresh
processes that ran in turn ({processor}).

    python -m benchmarks run leave-out --out benchmarks/lines/leave-out.jsonl
    python -m benchmarks report

The smallest scene: {count} neo-Hookean particles in float32, fixed steps, without boundaries and
without gravity. Of pictures: constant colours as they are, no depth.

| part | time over the smallest | compiling over the smallest | peak over the smallest |
|---|---|---|---|
{table}
{absent}"""


def leave_out_page(path: Path, expected: list[str]) -> str:
    """The page's source.

    Args:
        path: of the lines.
        expected: the parts that the suite knows, in its order.
    """
    measured: dict[tuple[str, str], dict] = {}
    costs: dict[str, dict] = {}
    for text in path.read_text().splitlines():
        line = json.loads(text)
        if "cost" in line:
            costs[line["case"]] = line
        elif line.get("status") == "ok":
            measured[line["case"], line["method"]] = line
    rows, absent = [], []
    for part in expected:
        both = [measured.get((part, method)) for method in ("jaxphys", "smallest")]
        if part not in costs or None in both:
            absent.append(part)
            continue
        with_it, without = both
        cost = costs[part]
        spread = ""
        if cost["cost_high"] > cost["cost_low"]:
            spread = f" ({cost['cost_low']:.2f} to {cost['cost_high']:.2f})"
        rows.append(
            f"| {part} | {cost['cost']:.2f}{spread} "
            f"| {with_it['compile_seconds'] / without['compile_seconds']:.2f} "
            f"| {with_it['peak_bytes'] / without['peak_bytes']:.2f} |"
        )
    first = next(line for line in measured.values() if "cells" in line)
    return PAGE.format(
        processor="; ".join(
            dict.fromkeys(line["machine"]["processor"] for line in measured.values())
        ),
        count=f"{8 * first['cells'] ** 3:,}",
        table="\n".join(rows),
        absent=f"\nNot measured yet: {', '.join(absent)}.\n" if absent else "",
    )

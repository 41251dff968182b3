"""Figures and tables of suite 'order', from its JSON lines and nothing else.

python -m benchmarks run order --out outputs/order.jsonl
python -m benchmarks.plot outputs/order.jsonl --out docs/figures

Writes `order-error-time.svg` (error against run time) and `order-convergence.svg` (error against
dx), and prints the table of observed orders in Markdown.
"""

import argparse
import json
import math
from collections import defaultdict
from pathlib import Path

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
SUITE = "order"


def read_lines(path: Path) -> list[dict]:
    """The suite's lines of a file; of several for one case, method and dtype, the last."""
    latest = {}
    for text in path.read_text().splitlines():
        line = json.loads(text)
        if line.get("suite") == SUITE and "problem" in line:
            latest[line["case"], line["method"], line["dtype"]] = line
    return list(latest.values())


def ladders(lines: list[dict]) -> dict[tuple[str, str], list[dict]]:
    """Lines by (problem, dtype), coarsest first."""
    groups = defaultdict(list)
    for line in lines:
        groups[line["problem"], line["dtype"]].append(line)
    return {key: sorted(group, key=lambda line: -line["h"]) for key, group in groups.items()}


def fitted_order(ladder: list[dict]) -> float | None:
    """Least-squares slope of log(error) over log(h); None for fewer than three finite errors."""
    points = [
        (math.log(line["h"]), math.log(line["error"]))
        for line in ladder
        if line["error"] and math.isfinite(line["error"])
    ]
    if len(points) < 3:
        return None
    mean_x = sum(x for x, _ in points) / len(points)
    mean_y = sum(y for _, y in points) / len(points)
    return sum((x - mean_x) * (y - mean_y) for x, y in points) / sum(
        (x - mean_x) ** 2 for x, _ in points
    )


def order_table(lines: list[dict]) -> str:
    """The observed orders as a Markdown table."""
    rows = [
        "| problem | dtype | cells | L2 error, coarse to fine | expected | observed (fit) |",
        "|---|---|---|---|---|---|",
    ]
    for (problem, dtype), ladder in sorted(ladders(lines).items()):
        cells = ", ".join(str(round(1 / line["h"])) for line in ladder)
        errors = ", ".join(f"{line['error']:.2e}" for line in ladder)
        order = fitted_order(ladder)
        observed = "-" if order is None else f"{order:.2f}"
        expected = ladder[0]["expected_order"]
        rows.append(f"| {problem} | {dtype} | {cells} | {errors} | {expected} | {observed} |")
    return "\n".join(rows)


def draw(lines: list[dict], key: str, label: str, path: Path) -> None:
    """Error over `key` of the lines, one curve a problem; float32 dashed. Writes `path`."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = SUITE
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.4, 4.4), layout="constrained")
    names = sorted({line["problem"] for line in lines})
    colours = {name: COLOURS[index % len(COLOURS)] for index, name in enumerate(names)}
    for (problem, dtype), ladder in sorted(ladders(lines).items()):
        double = dtype == "float64"
        axes.loglog(
            [line[key] for line in ladder],
            [line["error"] for line in ladder],
            "o-" if double else "s--",
            color=colours[problem],
            markerfacecolor=colours[problem] if double else "white",
            markersize=5,
            linewidth=1.4 if double else 0.9,
            label=problem if double else None,
        )
    axes.set_xlabel(label)
    axes.set_ylabel("L2 error of the displacement, relative")
    axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(frameon=False, fontsize=8, title="float64 (dashed: float32)", title_fontsize=8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def main(arguments: list[str] | None = None) -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.plot", description=__doc__)
    parser.add_argument("lines", type=Path, help="JSON lines of the suite")
    parser.add_argument("--out", type=Path, required=True, help="folder of the figures")
    options = parser.parse_args(arguments)
    lines = read_lines(options.lines)
    options.out.mkdir(parents=True, exist_ok=True)
    draw(lines, "seconds", "run time [s]", options.out / "order-error-time.svg")
    draw(lines, "h", "dx over size", options.out / "order-convergence.svg")
    print(order_table(lines))


if __name__ == "__main__":
    main()

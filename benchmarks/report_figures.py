"""Figures of work-precision lines: error against run time, and performance profiles."""

import math
from collections.abc import Callable
from pathlib import Path

COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c564b",
    "#7f7f7f", "#17becf", "#bcbd22", "#9467bd", "#2f4f4f", "#ff9896",
)  # fmt: skip
MARKS = "osD^v<>PX*hd8p"
OURS = "jaxphys"
COLUMNS = 3
AS_ACCURATE = 1.5

Methods = dict[str, list[dict]]


def _ours_first(method: str) -> tuple[bool, str]:
    return not method.startswith(OURS), method


def _look(index: int, method: str) -> dict[str, str]:
    """Of a curve: peers are dotted, in the same colours."""
    return {
        "color": COLOURS[index % len(COLOURS)],
        "marker": MARKS[index % len(MARKS)],
        "linestyle": "-" if method.startswith(OURS) else ":",
    }


def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "work-precision"
    matplotlib.rcParams["svg.fonttype"] = "none"
    from matplotlib import pyplot

    return pyplot


def _error(line: dict) -> float:
    error = line.get("error")
    good = error is not None and math.isfinite(error) and not line.get("code", 0)
    return error if good and error > 0 else math.inf


def _few_ticks(axis) -> None:
    """Ticks of a logarithmic axis in a small plot: powers of ten, or 1, 2 and 5 of few of them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    low, high = axis.get_view_interval()
    between = (1.0, 2.0, 5.0) if high < 40 * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=between, numticks=6))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _tidy(axes) -> None:
    axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=7)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_sheet(problems: dict[str, Methods], path: Path, name: Callable[[str], str]) -> None:
    """Error over run time, one small plot a problem, one curve a method, coarse to fine.

    Bars are the spread of samples; failures stand on a rail at the top, open; a dashed line is the
    floor of the reference.
    """
    pyplot = _pyplot()
    methods = sorted({method for curves in problems.values() for method in curves}, key=_ours_first)
    ours = sum(m.startswith(OURS) for m in methods)
    look = {m: _look(i if i < ours else i - ours, m) for i, m in enumerate(methods)}
    rows = math.ceil(len(problems) / COLUMNS)
    height = 2.1 if len(methods) == 1 else 3.4
    figure, grid = pyplot.subplots(
        rows, COLUMNS, figsize=(9.6, height * rows + 0.8), layout="constrained", squeeze=False
    )
    for axes in grid.flat[len(problems) :]:
        axes.set_visible(False)
    for axes, (problem, curves) in zip(grid.flat, problems.items(), strict=False):
        _draw_problem(axes, curves, look)
        axes.set_title(problem, fontsize=9)
        _tidy(axes)
    for axes in grid[-1]:
        axes.set_xlabel("run time [s]", fontsize=8)
    for axes in grid[:, 0]:
        axes.set_ylabel("error, relative", fontsize=8)
    if len(methods) > 1:
        handles = [pyplot.Line2D([], [], markersize=4, label=name(m), **look[m]) for m in methods]
        figure.legend(
            handles=handles, loc="outside lower center", ncols=6, fontsize=7, frameon=False
        )
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def _draw_problem(axes, curves: Methods, look: dict) -> None:
    timed = {m: [line for line in ladder if "seconds" in line] for m, ladder in curves.items()}
    if not any(timed.values()):
        axes.text(0.5, 0.5, "no run came to an end", ha="center", fontsize=7)
        return
    finite = [_error(x) for ladder in timed.values() for x in ladder if _error(x) < math.inf]
    rail = 3 * max(finite, default=1.0)
    for method, ladder in timed.items():
        good = [line for line in ladder if _error(line) < math.inf]
        failed = [line for line in ladder if _error(line) == math.inf]
        seconds = [line["seconds"] for line in good]
        spread = [[], []]
        for line in good:
            samples = [sample for run in line["samples"] for sample in _flat(run)]
            spread[0].append(max(0.0, line["seconds"] - min(samples)))
            spread[1].append(max(0.0, max(samples) - line["seconds"]))
        axes.errorbar(
            seconds, [_error(line) for line in good], xerr=spread, markersize=3.5, linewidth=1.1,
            elinewidth=0.6, **look[method],
        )  # fmt: skip
        axes.plot([line["seconds"] for line in failed], [rail] * len(failed), markersize=5,
                  **(look[method] | {"linestyle": "none", "markerfacecolor": "white"}))  # fmt: skip
    floors = [line.get("floor", 0.0) for ladder in timed.values() for line in ladder]
    if max(floors, default=0.0) > 0:
        axes.axhline(max(floors), color="#888888", linestyle="--", linewidth=0.8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _few_ticks(axes.xaxis)
    _few_ticks(axes.yaxis)


def _flat(run) -> list[float]:
    return list(run) if isinstance(run, list) else [run]


def ratios(problems: dict[str, Methods]) -> dict[str, list[float]]:
    """For each method that ran on every problem, on each of its grids, its time over that of the
    fastest run of any such method whose error is no more than AS_ACCURATE times as large; infinite
    where it failed.
    """
    everywhere = set.intersection(*(set(curves) for curves in problems.values()))
    found: dict[str, list[float]] = {method: [] for method in sorted(everywhere)}
    for curves in problems.values():
        runs = [
            line
            for method in everywhere
            for line in curves[method]
            if "seconds" in line and _error(line) < math.inf
        ]
        for method in everywhere:
            for line in curves[method]:
                if "seconds" not in line or _error(line) == math.inf:
                    found[method].append(math.inf)
                    continue
                as_good = [x for x in runs if _error(x) <= AS_ACCURATE * _error(line)]
                fastest = min(x["seconds"] for x in as_good)
                found[method].append(line["seconds"] / fastest)
    return found


def draw_profile(problems: dict[str, Methods], path: Path, name: Callable[[str], str]) -> None:
    """Dolan and More's performance profile of `ratios`."""
    pyplot = _pyplot()
    figure, axes = pyplot.subplots(figsize=(6.4, 3.6), layout="constrained")
    for i, (method, values) in enumerate(ratios(problems).items()):
        if not values:
            continue
        finite = sorted(value for value in values if value < math.inf)
        x = [1.0, *finite, max(10.0, 1.5 * max(finite, default=1.0))]
        shares = [sum(v <= t for v in values) / len(values) for t in x]
        axes.step(x, shares, where="post", color=COLOURS[i % len(COLOURS)], label=name(method))
    axes.set_xscale("log")
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("time over that of the fastest as accurate", fontsize=8)
    axes.set_ylabel("share of grids", fontsize=8)
    axes.legend(frameon=False, fontsize=7)
    _tidy(axes)
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)

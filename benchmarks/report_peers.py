"""Who has the least error at a run time, and from how many runs on compiling pays."""

import math

OURS = ("jaxphys", "jaxphys-float64")  # as they are by default, in each dtype
SAME = 1.01  # errors within so much are one: rounding, and where a velocity is taken
COLUMNS = (
    "problem",
    "peer's run",
    "its error, time",
    "ours of no more error",
    "time",
    "times as fast",
    "compile: ours, its",
    "ours ends first",
)


def _good(line: dict) -> bool:
    error = line.get("error")
    sound = error is not None and math.isfinite(error) and not line.get("code", 0)
    return "seconds" in line and sound


def compared(problems: dict[str, dict[str, list[dict]]]) -> list[tuple[str, dict, dict | None]]:
    """(problem, a peer's run, our fastest run whose error is no larger or None), of every sound run
    of a peer."""
    found = []
    for problem, methods in problems.items():
        ours = [line for name in OURS for line in methods.get(name, ()) if _good(line)]
        for method, ladder in methods.items():
            if method.startswith("jaxphys"):
                continue
            for line in filter(_good, ladder):
                as_good = [one for one in ours if one["error"] <= SAME * line["error"]]
                best = min(as_good, key=lambda one: one["seconds"], default=None)
                found.append((problem, line, best))
    return found


def runs_until_ahead(ours: dict, theirs: dict) -> float | None:
    """From how many runs of one program on ours has ended first, compiling counted; 1: at once,
    infinite: never, None: where the peer does not tell what compiling took.
    """
    if theirs["compile_seconds"] is None or ours["compile_seconds"] is None:
        return None
    more = ours["compile_seconds"] - theirs["compile_seconds"]
    less = theirs["seconds"] - ours["seconds"]
    if more <= 0 and less >= 0:
        return 1
    if less <= 0:
        return math.inf  # ahead at first, if at all
    return max(1, math.ceil(more / less))


def peers_section(problems: dict, name, error_text, seconds_text) -> str:
    """The share of problems on which no peer's run is on the front, and a row for each of them."""
    found = compared(problems)
    if not found:
        return "No peer was there."
    told = sorted({problem for problem, _, _ in found})
    won = [
        problem
        for problem in told
        if all(
            best is not None and best["seconds"] <= line["seconds"]
            for one, line, best in found
            if one == problem
        )
    ]
    lost = [problem for problem in told if problem not in won]
    rows = ["| " + " | ".join(COLUMNS) + " |", "|---" * len(COLUMNS) + "|"]
    for problem, line, best in found:
        head = (
            f"| {problem} | {name(line['method'])}, {line['resolution']} "
            f"| {error_text(line)}, {seconds_text(line['seconds'])} "
        )
        if best is None:
            rows.append(f"{head}| none | | | | |")
            continue
        ahead = runs_until_ahead(best, line)
        when = (
            "not told" if ahead is None else "never" if ahead == math.inf else f"from run {ahead}"
        )
        compiling = [
            "-" if one["compile_seconds"] is None else f"{one['compile_seconds']:.1f} s"
            for one in (best, line)
        ]
        rows.append(
            f"{head}| {name(best['method'])}, {best['resolution']}: {error_text(best)} "
            f"| {seconds_text(best['seconds'])} | {line['seconds'] / best['seconds']:.3g} "
            f"| {', '.join(compiling)} | {when} |"
        )
    summary = (
        f"On {len(won)} of the {len(told)} problems that a peer can state, every run of a peer has "
        "one of ours beside it, of the defaults in float32 or float64, that is as accurate and at "
        "least as fast (aim: 80%)."
    )
    if lost:
        summary += f" Not on: {', '.join(lost)}."
    return summary + "\n\n" + "\n".join(rows)

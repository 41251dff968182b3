"""Figure and tables of suite 'scaling', from its JSON lines and nothing else.

python -m benchmarks run scaling --out outputs/scaling.jsonl
python -m benchmarks.plot_scaling outputs/scaling.jsonl --out docs/figures

Writes `scaling.svg` (time of a particle's step against the number of particles, and speed-up and
traffic against devices) and prints the tables in Markdown.
"""

import argparse
import json
from pathlib import Path

SUITE = "scaling"
METHODS = {"jaxphys-window": "the window on each", "jaxphys": "slabs"}


def read_lines(path: Path) -> dict[tuple[str, str], dict]:
    """The suite's measured lines by (case, method), the last of each."""
    latest = {}
    for text in path.read_text().splitlines():
        line = json.loads(text)
        if line.get("suite") == SUITE and "work" in line:
            latest[line["case"], line["method"]] = line
    return latest


def nanoseconds(line: dict) -> float:
    """Wall time of one particle's step [ns]."""
    return line["seconds"] / line["work"] * 1e9


def size_rows(lines: dict) -> list[tuple[int, float, float | None]]:
    """(particles, ours, the peer's or None) [ns a particle and step], fewest particles first."""
    rows = []
    for (case, method), line in lines.items():
        if case.startswith("size-") and method == "jaxphys":
            peer = lines.get((case, "taichi"))
            rows.append((line["particles"], nanoseconds(line), peer and nanoseconds(peer)))
    return sorted(rows)


def device_rows(lines: dict, method: str) -> list[tuple[int, int, float, float]]:
    """(devices, particles, ms a step, kB of traffic a device and step) of weak scaling."""
    rows = []
    for (case, by), line in lines.items():
        if case.startswith("weak-") and by == method:
            time = 1e3 * line["seconds"] / line["steps"]
            rows.append((line["devices"], line["particles"], time, line["traffic_bytes"] / 1e3))
    return sorted(rows)


def tables(lines: dict) -> str:
    """Both tables in Markdown, and strong scaling in one line."""
    text = ["| particles | ns a particle and step | Taichi | times Taichi |", "|---|---|---|---|"]
    for count, ours, peer in size_rows(lines):
        theirs = "| - | - |" if peer is None else f"| {peer:.0f} | {peer / ours:.2f} |"
        text.append(f"| {count:,} | {ours:.0f} {theirs}")
    text += ["", "| devices | particles | ms a step | kB a device and step |", "|---|---|---|---|"]
    for method, name in METHODS.items():
        text += [
            f"| {d}, {name} | {n:,} | {t:.1f} | {kb:.0f} |"
            for d, n, t, kb in device_rows(lines, method)
        ]
    one = lines.get(("strong", "jaxphys-1-device"))
    for method, name in METHODS.items():
        two = lines.get(("strong", method))
        if one and two:
            ratio = one["seconds"] / two["seconds"]
            text += ["", f"Strong scaling, 1 to 2 devices, {name}: {ratio:.2f}"]
    return "\n".join(text)


def draw(lines: dict, path: Path) -> None:
    """Writes the figure."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = SUITE
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    rows = size_rows(lines)
    left.semilogx([r[0] for r in rows], [r[1] for r in rows], "o-", label="jaxphys")
    with_peer = [r for r in rows if r[2] is not None]
    left.semilogx([r[0] for r in with_peer], [r[2] for r in with_peer], "s--", label="Taichi")
    left.set(xlabel="particles", ylabel="ns a particle and step", ylim=(0, None))
    left.legend()
    for (method, name), style in zip(METHODS.items(), ("s--", "o-"), strict=True):
        weak = device_rows(lines, method)
        right.plot([r[0] for r in weak], [r[3] for r in weak], style, label=name)
    right.legend()
    right.set(xlabel="devices, 64,000 particles each", ylabel="kB a device and step")
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.plot_scaling", description=__doc__)
    parser.add_argument("lines", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    lines = read_lines(options.lines)
    options.out.mkdir(parents=True, exist_ok=True)
    draw(lines, options.out / "scaling.svg")
    print(tables(lines))


if __name__ == "__main__":
    main()

"""Curves as inline SVG, without scripts."""

import math
from collections.abc import Mapping, Sequence

from jaxphys.page.html import escaped

COLOURS = ("#0b62c4", "#c2410c", "#15803d", "#6d28d9")
DASHES = ("", "7 3", "2 3", "9 3 2 3")  # so that curves differ without colour too
WIDTH, HEIGHT = 560, 220
LEFT, RIGHT, TOP, BOTTOM = 72, 12, 12, 36
TICKS = 5


def ticks(low: float, high: float, count: int = TICKS) -> list[float]:
    """Round numbers from `low` to `high`, some `count` of them."""
    rough = (high - low) / max(count - 1, 1)
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * factor for factor in (1, 2, 5, 10) if size * factor >= rough * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [step * k for k in range(first, last + 1)]


def curves(
    times: Sequence[float],
    values: Mapping[str, Sequence[float]],
    unit: str,
    title: str,
    along: str = "time [s]",
) -> str:
    """A chart of some curves over time, or over what else rises.

    Args:
        times: rising.
        values: by name; what is not finite is left out.
        unit: of the values.
        title: what the chart shows, for those who do not see it.
        along: what `times` are.

    Returns:
        An svg element and a line that says which curve is which.
    """
    finite = [v for curve in values.values() for v in curve if math.isfinite(v)]
    low, high = min(finite, default=0.0), max(finite, default=1.0)
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    low, high = low - room, high + room
    start, end = min(times, default=0.0), max(times, default=1.0)
    end = end if end > start else start + 1.0

    def x(time: float) -> float:
        return LEFT + (time - start) / (end - start) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        return TOP + (high - value) / (high - low) * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" font-size="12"'
        f' font-family="system-ui, sans-serif"><title>{escaped(title)}</title>'
    ]
    for value in ticks(low, high):
        parts.append(
            f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" y2="{y(value):.1f}"'
            f' stroke="#e2e2e2"/><text x="{LEFT - 6}" y="{y(value) + 4:.1f}"'
            f' text-anchor="end" fill="#565656">{value:.4g}</text>'
        )
    for time in ticks(start, end):
        parts.append(
            f'<text x="{x(time):.1f}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle"'
            f' fill="#565656">{time:.4g}</text>'
        )
    parts.append(
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 4}" text-anchor="middle"'
        f' fill="#565656">{escaped(along)}</text>'
    )
    for i, curve in enumerate(values.values()):
        points = " ".join(
            f"{x(time):.1f},{y(value):.1f}"
            for time, value in zip(times, curve, strict=True)
            if math.isfinite(value)
        )
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{COLOURS[i % 4]}"'
            f' stroke-width="1.8" stroke-dasharray="{DASHES[i % 4] or "none"}"/>'
        )
    lines = ("solid", "dashed", "dotted", "dash-dotted")
    legend = ", ".join(f"{name} ({lines[i % 4]})" for i, name in enumerate(values))
    parts.append(
        f'</svg>\n<p class="small">{escaped(title)} [{escaped(unit)}]: {escaped(legend)}</p>\n'
    )
    return "".join(parts)

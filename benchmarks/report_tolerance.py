"""The page of `experiments.tolerance`."""

from pathlib import Path

PAGE = """# Does a tolerance keep what it promises?

`--tolerance 0.03` (`jaxphys.animate(..., tolerance=0.03)`, `jaxphys plan --tolerance 0.03`) runs
three pilots of the scene on coarse grids, 7, 9.9 and 14 cells along a cube of the object's volume,
reads order and error off their differences by Richardson's extrapolation
(`jaxphys/accuracy/convergence.py`), and takes the coarsest grid whose expected error, times 1.25,
is within the tolerance. Error: root mean square over Gaussians and frames of the distance to the
right motion, over that of their displacements. Where no order shows it refuses and says why.

## Checked

On scenes that are drawn by seed, each against a run on a grid 1.5 times finer, whose distance
counts 2.19 times for it is not exact either (`experiments/tolerance.py`):

    python -m experiments.tolerance --out benchmarks/lines/tolerance.jsonl
    python -m benchmarks report

{ran} of the {drawn} scenes drawn have been run, {judged} to the end ({machine}, nothing else
running). Seconds are those of simulating, without the pilots.

{table}

## What that does not show

* **Grids much finer than the pilots'.** Of the {judged} judged, {finer} ran on a grid at least 1.2
  times finer than their finest pilot's; the others met their tolerance on the pilots' grids or
  between them, where the estimate after the run is the one before, the error is all but known from
  the pilots, and these cost more than the run. One scene with a longer film (eight frames; its line
  is in `benchmarks/lines/tolerance-first.jsonl`) was run on a grid 1.4 times finer than its pilots:
  3.6% were expected, the estimate after the run was 8.8%, the truth 7.4%. The tolerance of 5% was
  **not kept**, and the estimate said so.
* The scenes are not all unseen. The number of cells was chosen on a jelly ball (below). That orders
  below 1 are taken for 1 was decided after the pilots of that first scene had asked for 327,000
  particles.
* Only the spacing is chosen, and particles and steps with it. Transfer and dtype stay what they
  are; a tolerance below 1e-4 asks for float64.

## Why 7, 9.9 and 14 cells

A jelly ball (0.8 m; 0.65 m is the side of a cube of its volume) dropped on a floor, half a second,
against a grid of 1/32 m:

| spacings, m | cells of the finest | order seen | error estimated | distance to 1/32 m |
|---|---|---|---|---|
| 0.25, 0.177, 0.125 | 5.2 | none, opposite directions | refused | 0.128 |
| 0.177, 0.125, 0.088 | 7.3 | 0.02 | refused | 0.068 |
| 0.125, 0.088, 0.0625 | 10.3 | 0.75 | 0.123 | 0.024 |
| 0.088, 0.0625, 0.0442 | 14.6 | 1.67 | 0.037 | 0.027 |
"""


def tolerance_page(path: Path) -> str:
    """The page, from its lines."""
    from experiments.tolerance import drawn, read, table

    lines = read(path)
    good = [line for line in lines if line["status"] == "ok"]
    return PAGE.format(
        ran=len(lines),
        drawn=len(drawn()),
        judged=len(good),
        finer=sum(line["spacings"][-1] >= 1.2 * line["spacing"] for line in good),
        machine="; ".join(
            sorted(
                {
                    "{processor}, {cores} cores".format(**line["machine"])
                    for line in lines
                    if "machine" in line
                }
            )
        ),
        table=table(lines),
    )

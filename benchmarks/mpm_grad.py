"""Suite 'mpm-grad': value and gradient of a rollout, beside the forward rollout of the same steps.

The gradient is that of the mean square position by every particle's Young's modulus, through
checkpointed segments. Work is counted in particle-steps, so the ratio of the two lines' seconds is
the cost of a gradient in forward passes.
"""

from functools import partial

from benchmarks.case import Case, Prepared
from benchmarks.mpm import block_case, compiled, forward, value_and_gradient

# case: (cells a side of the block, nodes a side of the grid, steps)
SIZES = {"50k-100": (18, 64, 100), "50k-2000": (18, 64, 2000)}
QUICK_SIZES = {"8k-16": (10, 32, 16)}


def prepare(program, cells: int, nodes: int, steps: int) -> Prepared:
    """`program` is `forward` or `value_and_gradient` of the mpm suite."""
    import jax

    run = program(block_case(cells, nodes), steps)
    return Prepared(
        lambda: jax.block_until_ready(run()),
        work=8 * cells**3 * steps,
        compile_seconds=compiled(run),
        extra={"steps": steps},
    )


def cases(quick: bool) -> list[Case]:
    """Forward and gradient on each size."""
    return [
        Case(
            f"{name}-{size}",
            "jaxphys",
            partial(prepare, program, *numbers),
            {"particles": 8 * numbers[0] ** 3},
            rounds=3 if numbers[2] < 1000 else 1,
        )
        for size, numbers in (QUICK_SIZES if quick else SIZES).items()
        for name, program in (("forward", forward), ("gradient", value_and_gradient))
    ]

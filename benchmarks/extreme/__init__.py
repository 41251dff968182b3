"""Suite 'extreme': scenes and pictures at the edge of what is sound, each with its answer.

python -m benchmarks run extreme --out FILE.jsonl [--quick]
python -m benchmarks.extreme.table FILE.jsonl [PEERS.jsonl] > docs/benchmarks/extreme.md
"""

from collections.abc import Iterator


def catalogue() -> list:
    """Every case."""
    from benchmarks.extreme import gradients, motion, pictures

    return [*motion.cases(), *pictures.cases(), *gradients.cases()]


def lines(quick: bool, only: str = "") -> Iterator[dict]:
    """One line a cell, all in this process, since cases share their programs."""
    import jax

    from benchmarks.extreme.case import line_of

    jax.config.update("jax_enable_x64", True)
    for case in catalogue():
        if only in (case.name, case.group, "") and (case.quick or not quick):
            for method in case.methods:
                yield line_of(case, method)

"""Suite 'mpm-grad': value and gradient of a rollout, its cost in forward rollouts, and the peer.

The gradient is that of the mean square position by every particle's Young's modulus. Where memory
allows, ours keeps every step (`Plain`) and is measured with checkpointed segments beside it. Work
is counted in particle-steps. The peer in `benchmarks/peers/taichi_mpm_grad.py` keeps every step,
and is left out where that takes more memory than `PEER_BYTES`.
"""

from functools import partial

from benchmarks.case import Case, Prepared
from benchmarks.mpm import block_case, compiled, forward, start_devices, value_and_gradient
from benchmarks.peers.taichi_mpm_grad import build, field_bytes

# case: (cells a side of the block, nodes a side of the grid, steps)
SIZES = {"50k-100": (18, 64, 100), "50k-2000": (18, 64, 2000)}
QUICK_SIZES = {"8k-16": (10, 32, 16)}
PEER_BYTES = 8 * 2**30
# From so many steps on, one call is timed and no other.
LONG = 1000


def gradient(case: dict, steps: int, adjoint: str):
    """`value_and_gradient` of the mpm suite with the adjoint of that name."""
    from jaxphys.mpm.loop import adjoint as adjoints

    return value_and_gradient(case, steps, getattr(adjoints, adjoint)())


def prepare(program, cells: int, nodes: int, steps: int) -> Prepared:
    """`program(case, steps)` gives what is timed."""
    import jax

    start_devices()
    run = program(block_case(cells, nodes), steps)
    return Prepared(
        lambda: jax.block_until_ready(run()),
        work=8 * cells**3 * steps,
        compile_seconds=compiled(run),
        once=steps >= LONG,
        extra={"steps": steps},
    )


def prepare_peer(cells: int, nodes: int, steps: int) -> Prepared:
    """Taichi's CPU backend on two threads, forth and back."""
    run, _ = build(block_case(cells, nodes), steps)
    return Prepared(run, work=8 * cells**3 * steps, extra={"steps": steps})


def cases(quick: bool) -> list[Case]:
    """The gradient, the forward rollout and, where it fits, the peer's gradient on each size."""
    found = []
    for size, numbers in (QUICK_SIZES if quick else SIZES).items():
        cells, nodes, steps = numbers
        plain, checkpointed = (partial(gradient, adjoint=a) for a in ("Plain", "Checkpointed"))
        methods = {
            "jaxphys": partial(prepare, checkpointed if steps >= LONG else plain, *numbers),
            "jaxphys-forward": partial(prepare, forward, *numbers),
        }
        if steps < LONG:
            methods["jaxphys-checkpointed"] = partial(prepare, checkpointed, *numbers)
        if field_bytes(8 * cells**3, nodes, steps) <= PEER_BYTES:
            methods["taichi"] = partial(prepare_peer, *numbers)
        found += [
            Case(
                size,
                method,
                run,
                {"particles": 8 * cells**3, "nodes": nodes**3},
                rounds=1 if steps >= LONG else 3,
                baseline=method == "jaxphys-forward",
            )
            for method, run in methods.items()
        ]
    return found

"""What a step costs beside the plainest one: of each transfer against APIC with quadratic splines,
of each material against neo-Hookean, all in one process.

    python -m experiments.ratios

Prints one line of JSON each. Runs take turns, and the least of each counts, so that what else the
machine does falls on all of them alike; beside other load, ratios are still good to some tenth.
"""

import argparse
import json
import time
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.placement import suited
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.materials.catalogue import MATERIALS, get_material
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.mpm.state import Config, Model, initial_state
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.transfer import AFLIP, APIC, FLIP, PIC, Transfer

SIDE = 24  # particles along a side of the block, two a cell
SPACING = 0.05
TRANSFERS = [
    Transfer(scheme, kernel)
    for kernel in ("quadratic", "cubic")
    for scheme in (APIC(), PIC(), FLIP(), AFLIP())
]


def runner(law, values, transfer, steps):
    """A compiled rollout of a block of matter that is strained a little, ready to be called."""
    line = 0.3 + SPACING / 2 * np.arange(SIDE)
    position = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    count, random = len(position), np.random.default_rng(0)
    nodes = SIDE // 2 + 14
    config = Config(
        Grid((nodes,) * 3, SPACING),
        ((law, 0, count),),
        placement=suited(count, 1),
        transfer=transfer,
        check_step=False,
    )
    volume = jnp.full(count, (SPACING / 2) ** 3, jnp.float32)
    parameters = {name: jnp.full(count, values[name], jnp.float32) for name in law.parameters}
    model = Model(values["density"] * volume, volume, parameters, None)
    strain = 1e-3 * random.normal(size=(count, 3, 3))
    state = initial_state(config, position, deformation=np.eye(3) + strain, dtype=jnp.float32)
    dt = 0.1 * largest_stable_dt(config, model, state).dt
    run = jax.jit(partial(rollout, config, model, dt=dt, steps=steps))
    return lambda: jax.block_until_ready(run(state))


def seconds(runners, rounds):
    """The least time of each, after one call of each to compile."""
    for run in runners.values():
        run()
    least = dict.fromkeys(runners, float("inf"))
    for _ in range(rounds):
        for name, run in runners.items():
            begin = time.perf_counter()
            run()
            least[name] = min(least[name], time.perf_counter() - begin)
    return least


def main() -> None:
    """Runs all pairs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    jelly = MATERIALS["jelly"].defaults
    plain = Transfer()
    transfers = {
        f"{one.scheme.type}, {one.kernel}": runner(NEO_HOOKEAN, jelly, one, options.steps)
        for one in TRANSFERS
    }
    laws = {"neo-Hookean": runner(NEO_HOOKEAN, jelly, plain, options.steps)}
    mean = at_mean_volume(NEO_HOOKEAN)
    laws[mean.name] = runner(mean, jelly, plain, options.steps)
    for name, material in MATERIALS.items():
        law = get_material(name).law.reduced(material.defaults)
        laws[f"{name} ({law.name})"] = runner(law, material.defaults, plain, options.steps)
    for runners in (transfers, laws):
        least = seconds(runners, options.rounds)
        first = next(iter(least.values()))
        for name, time_taken in least.items():
            print(json.dumps({"what": name, "ratio": round(time_taken / first, 2)}), flush=True)


if __name__ == "__main__":
    main()

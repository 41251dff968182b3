"""Suite 'mpm': a block of random particles, eight per cell, in a fixed grid.

Our side and the peer in `benchmarks/peers/taichi_mpm.py` get the same particles in the same
(sorted) order. Both have all cores: ours as one device each, in chunks and with a window of the
grid, as a run has them. Work is counted in particle-steps.
"""

import time
from functools import partial

import numpy as np

from benchmarks.case import Case, Prepared

# name: (jaxphys law, parameters beside the elastic ones). The peer knows the first two.
LAWS = {
    "neo-Hookean": ("elasticity.NEO_HOOKEAN", {}),
    "fixed corotated": ("elasticity.FIXED_COROTATED", {}),
    "metal": ("plasticity.VON_MISES", {"yield_stress": 1.2e3, "hardening": 0.0}),
    "sand": ("plasticity.DRUCKER_PRAGER", {"friction_angle": 35.0}),
}
PEER_LAWS = ("neo-Hookean", "fixed corotated")
# case: (cells a side of the block, nodes a side of the grid, steps in a call: about a frame)
SIZES = {"64k": (20, 64, 30), "262k": (32, 128, 20)}
QUICK_SIZES = {"8k": (10, 32, 30)}


def block_case(cells: int, nodes: int, law: str = "neo-Hookean", seed: int = 0) -> dict:
    """A block of `cells`^3 cells with 8 particles each on average, sorted by cell, on `nodes`^3.

    Usual sizes: (20, 64), 64k particles, and (32, 128), 262k. The domain is 1 m wide, the material
    at half its largest stable step. Positions (N, 3) [m] and velocities (N, 3) [m/s] are numpy.
    """
    from jaxphys.mpm.grid import Grid
    from jaxphys.mpm.loop.sorting import cell_order

    random = np.random.default_rng(seed)
    spacing, count = 1.0 / nodes, 8 * cells**3
    start = nodes / 2 - cells / 2
    position = spacing * (start + cells * random.random((count, 3)))
    position = position[cell_order(position, Grid((nodes,) * 3, spacing))]
    density, E, nu = 1000.0, 1e5, 0.3
    sound = (E * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / density) ** 0.5
    return {
        "position": position,
        "velocity": 0.1 * random.normal(size=(count, 3)),
        "nodes": nodes,
        "spacing": spacing,
        "law": law,
        "mass": density * spacing**3 / 8,
        "volume": spacing**3 / 8,
        "youngs_modulus": E,
        "poisson_ratio": nu,
        "dt": 0.5 * 0.7 * spacing / sound,
        "gravity": (0.0, 0.0, -9.8),
    }


def start_devices(number: int | None = None) -> None:
    """Makes JAX, not yet started, take each core for a device, or `number` devices."""
    import jax

    from jaxphys.cli.devices import cores

    jax.config.update("jax_num_cpu_devices", number or cores())


def model_and_state(case: dict, devices: int | None = None, *, slabs: bool | None = None):
    """(config, model, state) of a `block_case` in float32, on all devices or `devices` of them;
    slabs: as for `windowed`.
    """
    import jax.numpy as jnp

    from jaxphys.mpm.grid import Grid
    from jaxphys.mpm.loop.placement import suited
    from jaxphys.mpm.loop.window import windowed
    from jaxphys.mpm.materials import elasticity, plasticity
    from jaxphys.mpm.state import Config, Model, initial_state

    count = len(case["position"])
    name, more = LAWS[case["law"]]
    module, attribute = name.split(".")
    law = getattr({"elasticity": elasticity, "plasticity": plasticity}[module], attribute)
    grid = Grid((case["nodes"],) * 3, case["spacing"])
    config = Config(grid, ((law, 0, count),), placement=suited(count, devices))

    def full(name):
        return jnp.full(count, {**case, **more}[name], jnp.float32)

    model = Model(
        mass=full("mass"),
        volume=full("volume"),
        parameters={name: full(name) for name in law.parameters},
        gravity=jnp.array(case["gravity"], jnp.float32),
    )
    state = initial_state(config, case["position"], case["velocity"], dtype=jnp.float32)
    return windowed(config, state, slabs=slabs), model, state


def forward(case: dict, steps: int, devices: int | None = None, *, slabs: bool | None = None):
    """A compiled `() -> State` that runs `steps` steps from the case's start."""
    import jax

    from jaxphys.mpm.loop.rollout import rollout

    config, model, state = model_and_state(case, devices, slabs=slabs)
    run = jax.jit(partial(rollout, config, dt=case["dt"], steps=steps))
    return partial(run, model, state)


def value_and_gradient(case: dict, steps: int, adjoint=None, devices: int | None = None):
    """A compiled `() -> (value, gradient)` of the mean square position by Young's modulus."""
    import jax
    import jax.numpy as jnp

    from jaxphys.mpm.loop.adjoint import Checkpointed
    from jaxphys.mpm.loop.rollout import rollout

    config, model, state = model_and_state(case, devices)

    def loss(modulus, model, state):
        parameters = {**model.parameters, "youngs_modulus": modulus}
        changed = type(model)(model.mass, model.volume, parameters, model.gravity)
        end = rollout(
            config, changed, state, dt=case["dt"], steps=steps, adjoint=adjoint or Checkpointed()
        )
        return jnp.mean(end.position**2)

    run = jax.jit(jax.value_and_grad(loss))
    return partial(run, model.parameters["youngs_modulus"], model, state)


def compiled(run) -> float:
    """Seconds until a `partial` of a jitted function is compiled; its first call then is free."""
    start = time.perf_counter()
    run.func.lower(*run.args).compile()
    return time.perf_counter() - start


def prepare(law: str, cells: int, nodes: int, steps: int) -> Prepared:
    """Our solver, `steps` steps a call."""
    import jax

    start_devices()
    run = forward(block_case(cells, nodes, law), steps)
    return Prepared(
        lambda: jax.block_until_ready(run()),
        work=8 * cells**3 * steps,
        compile_seconds=compiled(run),
        extra={"steps": steps},
    )


def prepare_peer(law: str, cells: int, nodes: int, steps: int) -> Prepared:
    """Taichi's CPU backend on two threads, `steps` steps a call."""
    from benchmarks.peers.taichi_mpm import build

    advance, _ = build(block_case(cells, nodes, law))
    return Prepared(lambda: advance(steps), work=8 * cells**3 * steps, extra={"steps": steps})


def cases(quick: bool) -> list[Case]:
    """Each law on each size, beside the peer where it knows the law, and beside neo-Hookean where
    the law is plastic.
    """
    found = []
    for size, numbers in (QUICK_SIZES if quick else SIZES).items():
        cells, nodes, _ = numbers
        for law in LAWS:
            name = f"{law.lower().replace(' ', '-')}-{size}"
            counts = {"particles": 8 * cells**3, "nodes": nodes**3}
            found.append(Case(name, "jaxphys", partial(prepare, law, *numbers), counts))
            if law in PEER_LAWS:
                found.append(Case(name, "taichi", partial(prepare_peer, law, *numbers), counts))
            else:
                run = partial(prepare, "neo-Hookean", *numbers)
                found.append(Case(name, "jaxphys-neo-Hookean", run, counts, baseline=True))
    return found

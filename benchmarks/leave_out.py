"""Suite 'leave-out': what each optional part costs those who ask for it, and nobody else.

Each case is the smallest scene with one part added, method `jaxphys`, beside the smallest scene by
itself, method `smallest`: the line's `cost` is their ratio. Work is counted in particle-steps, of
pictures in pictures. That a part left out leaves nothing behind is tested on the traced programs
(`tests/pipeline/test_leave_out.py`).

The smallest scene of motion is neo-Hookean matter in float32, by fixed steps, without boundaries
and without gravity; that of pictures has constant colours, as they are, and no depth.
"""

import time
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.case import Case, Prepared
from benchmarks.mpm import block_case, start_devices

# Parts of a motion -> how `_scene` is asked for them. A number of steps is a frame's.
MOTIONS: dict[str, dict] = {
    "gravity": {"gravity": True},
    "affine terms left out": {"scheme": "PIC"},
    "velocities of their own": {"scheme": "FLIP"},
    "polar rotation": {"laws": ("FIXED_COROTATED",)},
    "decomposition": {"laws": ("HENCKY",)},
    "plasticity": {"laws": ("PERFECT_VON_MISES",)},
    "hardening and history": {"laws": ("VON_MISES",)},
    "total gradient": {"laws": ("PERFECT_VON_MISES",), "total": True},
    "volume correction left out": {"laws": ("UNCORRECTED_DRUCKER_PRAGER",)},
    "volume correction": {"laws": ("DRUCKER_PRAGER",)},
    "several materials": {"laws": ("NEO_HOOKEAN", "FIXED_COROTATED", "HENCKY")},
    "walls": {"boundaries": ("walls",)},
    "plane": {"boundaries": ("plane",)},
    "plane with friction": {"boundaries": ("rough",)},
    "ball": {"boundaries": ("ball",)},
    "damping": {"boundaries": ("damping",)},
    "float64": {"dtype": "float64"},
    "empty grid": {"window": False},
    "adaptive steps": {"how": "adaptive"},
    "gradient": {"how": "gradient"},
    "gradient with checkpoints": {"how": "checkpoints"},
    "everything": {
        "gravity": True,
        "laws": ("NEO_HOOKEAN", "VON_MISES", "DRUCKER_PRAGER"),
        "total": True,
        "boundaries": ("walls", "rough", "ball", "damping"),
        "window": False,
    },
}
PICTURES: dict[str, dict] = {
    "depth": {"depth": True},
    "harmonics of degree 1": {"degree": 1},
    "harmonics of degree 3": {"degree": 3},
    "colour regularisation": {"regular": True},
    "every part of a picture": {"depth": True, "degree": 3, "regular": True},
}


def _bounds(name: str):
    from jaxphys.mpm import boundaries

    plane = partial(boundaries.Plane, (0.5, 0.5, 0.3), (0.0, 0.0, 1.0))
    return {
        "walls": boundaries.Walls,
        "plane": partial(plane, friction=0.0),
        "rough": partial(plane, friction=0.4),
        "ball": partial(boundaries.Ball, (0.5, 0.5, 0.2), 0.1),
        "damping": partial(boundaries.Damping, 0.1),
    }[name]()


def _scene(
    cells: int,
    nodes: int,
    *,
    laws=("NEO_HOOKEAN",),
    boundaries=(),
    gravity=False,
    scheme="APIC",
    total=False,
    dtype="float32",
    window=True,
):
    """(config, model, state, dt): a random block, as suite `mpm` has it."""
    import jax.numpy as jnp

    from jaxphys import mpm
    from jaxphys.mpm.boundaries import Setting, prepare
    from jaxphys.mpm.loop.placement import suited
    from jaxphys.mpm.loop.window import windowed
    from jaxphys.mpm.materials import elasticity, plasticity

    case = block_case(cells, nodes)
    count = len(case["position"])
    ends = np.linspace(0, count, len(laws) + 1).astype(int).tolist()
    found = [getattr(elasticity, name, None) or getattr(plasticity, name) for name in laws]
    grid = mpm.Grid((nodes,) * 3, case["spacing"])
    config = mpm.Config(
        grid,
        tuple(zip(found, ends[:-1], ends[1:], strict=True)),
        track_total=total,
        check_step=False,
        transfer=mpm.Transfer(
            {"APIC": mpm.APIC(), "PIC": mpm.PIC(), "FLIP": mpm.FLIP(0.9)}[scheme]
        ),
        placement=suited(count),
    )
    volume = np.full(count, case["volume"])
    setting = Setting(grid, case["position"], volume, np.dtype(dtype))
    made = prepare(tuple(_bounds(name) for name in boundaries), setting)
    values = {
        "youngs_modulus": case["youngs_modulus"], "poisson_ratio": case["poisson_ratio"],
        "yield_stress": 1.2e3, "hardening": 1e3, "friction_angle": 35.0,
    }  # fmt: skip
    names = dict.fromkeys(name for law in found for name in law.parameters)
    model = mpm.Model(
        mass=jnp.full(count, case["mass"], dtype),
        volume=jnp.full(count, case["volume"], dtype),
        parameters={name: jnp.full(count, values[name], dtype) for name in names},
        gravity=jnp.array(case["gravity"], dtype) if gravity else None,
        boundaries=made,
    )
    state = mpm.initial_state(
        config, case["position"], case["velocity"], dtype=dtype, boundaries=made
    )
    # The window must hold what adaptive and falling matter does in a frame.
    return windowed(config, state) if window else config, model, state, case["dt"]


def motion(cells: int, nodes: int, steps: int, how: str = "fixed", **parts) -> Prepared:
    """`steps` steps of the smallest scene with these parts."""
    start_devices()
    import jax
    import jax.numpy as jnp

    from jaxphys import mpm
    from jaxphys.mpm.loop.rollout import rollout

    jax.config.update("jax_enable_x64", parts.get("dtype") == "float64")
    config, model, state, dt = _scene(cells, nodes, **parts)

    def fixed(model, state, adjoint=None):
        within = adjoint or mpm.Plain()
        return rollout(config, model, state, dt=dt, steps=steps, adjoint=within)

    def adaptive(model, state):
        found = mpm.rollout_adaptively(
            config, model, state, mpm.Adaptive(), duration=steps * dt, record=2 * steps
        )
        return found[0], found[1].count

    def slope(model, state, adjoint):
        def loss(E):
            changed = replace(model, parameters={**model.parameters, "youngs_modulus": E})
            return jnp.mean(fixed(changed, state, adjoint).position ** 2)

        return jax.value_and_grad(loss)(model.parameters["youngs_modulus"])

    program = jax.jit(
        {
            "fixed": fixed,
            "adaptive": adaptive,
            "gradient": partial(slope, adjoint=mpm.Plain()),
            "checkpoints": partial(slope, adjoint=mpm.Checkpointed()),
        }[how]
    )
    begin = time.perf_counter()
    run = program.lower(model, state).compile()
    seconds = time.perf_counter() - begin
    taken = int(run(model, state)[1]) if how == "adaptive" else steps
    return Prepared(
        lambda: jax.block_until_ready(run(model, state)),
        work=float(config.particles * taken),
        compile_seconds=seconds,
        extra={"steps": taken},
    )


def drawn(count: int, width: int, height: int, *, degree=0, regular=False, depth=False) -> Prepared:
    """A picture of the ball of suite `render`, from Gaussians."""
    start_devices(1)
    import jax
    import jax.numpy as jnp

    from benchmarks.render import ball_camera, ball_splats
    from jaxphys.gaussians.colour import colour_range, regularise
    from jaxphys.gaussians.gaussians import from_points, to_splats
    from jaxphys.render import Settings, next_capacity, position, render, required_pairs

    splats, camera = ball_splats(count), ball_camera(width, height)
    size = 0.0106 * 0.5 * (100_000 / count) ** 0.5
    gaussians = from_points(np.asarray(splats.means), np.asarray(splats.colours), size)
    more = jnp.zeros((count, (degree + 1) ** 2 - 1, 3)) + 0.01
    gaussians = replace(gaussians, harmonics=jnp.concatenate([gaussians.harmonics, more], 1))
    settings, limits = Settings(depth=depth), colour_range(gaussians)
    eye = position(camera)
    needed = int(required_pairs(to_splats(gaussians, eye), camera, settings))

    @jax.jit
    def paint(gaussians):
        splats = to_splats(gaussians, eye)
        if regular:
            splats = splats._replace(colours=regularise(splats.colours, limits))
        return render(splats, camera, settings=settings, capacity=next_capacity(needed))

    begin = time.perf_counter()
    run = paint.lower(gaussians).compile()
    return Prepared(
        lambda: jax.block_until_ready(run(gaussians)),
        work=1.0,
        compile_seconds=time.perf_counter() - begin,
        extra={"pairs": needed},
    )


def cases(quick: bool) -> list[Case]:
    """Each part beside the smallest scene, in turn; `quick` takes four of them, small."""
    block, ball = ((10, 32, 20), (5_000, 320, 180)) if quick else ((20, 64, 30), (30_000, 979, 545))
    some = ("gravity", "plasticity", "everything", "depth")
    found = []
    for made, size, kinds in ((motion, block, MOTIONS), (drawn, ball, PICTURES)):
        names = ("cells", "nodes", "steps") if made is motion else ("splats", "width", "height")
        numbers = dict(zip(names, size, strict=True))
        for name, parts in kinds.items():
            if quick and name not in some:
                continue
            task = partial(made, *size, **parts)
            found.append(Case(name, "jaxphys", task, numbers, parts.get("dtype", "float32")))
            found.append(Case(name, "smallest", partial(made, *size), numbers, baseline=True))
    return found

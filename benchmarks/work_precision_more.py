"""The parts of suite 'work-precision' that are no rollouts: pictures and gradients."""

import time
from functools import partial

from benchmarks.case import Case, Prepared

PICTURES: dict[str, dict] = {
    "jaxphys": {},
    "jaxphys-float64": {"dtype": "float64"},
    "jaxphys-tile-4": {"tile_size": 4},
    "jaxphys-tile-16": {"tile_size": 16},
    "jaxphys-tile-32": {"tile_size": 32},
    "jaxphys-alpha-1e-3": {"alpha_min": 1e-3},
    "jaxphys-alpha-2e-2": {"alpha_min": 2e-2},
    "jaxphys-light-1e-2": {"transmittance_min": 1e-2},
    "jaxphys-three-sigma": {"extent": "three_sigma"},
}
GRADIENTS: dict[str, tuple[str, dict, str]] = {
    "jaxphys": ("Plain", {}, "float32"),
    "jaxphys-float64": ("Plain", {}, "float64"),
    "jaxphys-checkpointed": ("Checkpointed", {}, "float32"),
    "jaxphys-segments-4": ("Checkpointed", {"segments": 4}, "float32"),
    "jaxphys-window-32": ("Truncated", {"window": 32}, "float32"),
    "jaxphys-window-8": ("Truncated", {"window": 8}, "float32"),
}
SPLATS, WIDTH, HEIGHT = 2_000, 240, 136
CELLS, STEPS = 8, 64


def dense_picture(splats, camera):
    """The picture with nothing left out, in float64: (H, W, 3). By the tests' own renderer, which
    goes over all splats at all pixels and shares no code with what is measured.
    """
    import jax
    import jax.numpy as jnp

    from jaxphys.render import Settings
    from tests.render.reference import render_dense

    everything = Settings(alpha_min=1e-9, transmittance_min=0.0)
    double = jax.tree.map(
        lambda x: x.astype(jnp.float64) if jnp.issubdtype(x.dtype, jnp.floating) else x,
        (splats, camera),
    )
    picture = jax.jit(lambda s, c: render_dense(s, c, jnp.zeros(3), everything)[0])
    return picture(*double)


def prepare_picture(changes: dict) -> Prepared:
    """One picture of the ball; the error is the root mean square over pixels, of 1."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp

    from benchmarks.render import ball_camera, ball_splats, picture
    from jaxphys.render import Settings, next_capacity, required_pairs

    changes = dict(changes)
    dtype = jnp.dtype(changes.pop("dtype", "float32"))
    settings = Settings(**changes)
    splats, camera = ball_splats(SPLATS), ball_camera(WIDTH, HEIGHT)
    truth = dense_picture(splats, camera)
    splats, camera = jax.tree.map(
        lambda x: x.astype(dtype) if jnp.issubdtype(x.dtype, jnp.floating) else x, (splats, camera)
    )
    run = picture(settings, next_capacity(int(required_pairs(splats, camera, settings))))
    start = time.perf_counter()
    colour = jax.block_until_ready(run(splats, camera)).colour
    seconds = time.perf_counter() - start
    return Prepared(
        lambda: jax.block_until_ready(run(splats, camera)),
        work=1.0,
        compile_seconds=seconds,
        error=lambda: float(jnp.sqrt(jnp.mean((colour.astype(jnp.float64) - truth) ** 2))),
        extra={"problem": "picture", "resolution": WIDTH, "code": 0, "floor": 0.0},
    )


def gradient_program(dtype: str, adjoint):
    """(function, arguments) of the gradient of the mean square displacement of the ringing cube by
    every particle's Young's modulus.
    """
    import jax
    import jax.numpy as jnp

    from jaxphys.mpm.loop.rollout import rollout
    from jaxphys.problems.ringing import Ringing, ringing

    problem = ringing(Ringing(), CELLS, dtype=dtype)

    def loss(moduli, model, state):
        parameters = {**model.parameters, "youngs_modulus": moduli}
        changed = type(model)(model.mass, model.volume, parameters, model.gravity, model.boundaries)
        end = rollout(problem.config, changed, state, dt=problem.dt, steps=STEPS, adjoint=adjoint)
        return jnp.mean((end.position - state.position) ** 2)

    arguments = problem.model.parameters["youngs_modulus"], problem.model, problem.state
    return jax.jit(jax.grad(loss)), arguments


def prepare_gradient(name: str, options: dict, dtype: str) -> Prepared:
    """One gradient; the error is that of the gradient in the L2 norm, relative to float64's."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp

    from jaxphys.mpm.loop import adjoint as adjoints

    run, arguments = gradient_program(dtype, getattr(adjoints, name)(**options))
    start = time.perf_counter()
    found = jax.block_until_ready(run(*arguments))
    seconds = time.perf_counter() - start

    def error() -> float:
        exact, its = gradient_program("float64", adjoints.Plain())
        truth = exact(*its)
        return float(jnp.linalg.norm(found.astype(jnp.float64) - truth) / jnp.linalg.norm(truth))

    return Prepared(
        lambda: jax.block_until_ready(run(*arguments)),
        work=float(len(found) * STEPS),
        compile_seconds=seconds,
        error=error,
        extra={"problem": "gradient", "resolution": STEPS, "code": 0, "floor": 0.0},
    )


def picture_cases(quick: bool) -> list[Case]:
    """What a user can turn of a picture."""
    wanted = list(PICTURES)[:4] if quick else list(PICTURES)
    return [
        Case(
            "picture",
            method,
            partial(prepare_picture, PICTURES[method]),
            {"splats": SPLATS, "width": WIDTH, "height": HEIGHT},
            dtype=PICTURES[method].get("dtype", "float32"),
            rounds=1,
        )
        for method in wanted
    ]


def gradient_cases(quick: bool) -> list[Case]:
    """What a user can turn of a gradient."""
    wanted = ("jaxphys", "jaxphys-checkpointed", "jaxphys-window-8") if quick else GRADIENTS
    return [
        Case(
            "gradient",
            method,
            partial(prepare_gradient, *GRADIENTS[method]),
            {"steps": STEPS},
            dtype=GRADIENTS[method][2],
            rounds=1,
        )
        for method in wanted
    ]

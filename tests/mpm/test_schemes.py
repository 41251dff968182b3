"""PIC, FLIP, APIC and affine FLIP with both kernels, in the solver.

All tests share one compiled program for each pair: 64 particles on a long grid, which hold a moving
block, a bar or a particle alone.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.program import parts
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.frames import advance_frame
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import rollout, step
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN, lame
from jaxphys.mpm.state import LEFT_GRID, OK, Config, Model, initial_state
from jaxphys.mpm.stepping.bounds import SOUND, isolated_bound
from jaxphys.mpm.transfer import AFLIP, APIC, FLIP, PIC, Transfer

from . import reference
from .cases import count_in_transfers, public

GRID = Grid((40, 7, 7), 0.1)
COUNT = 64
DT = 1e-3
# Of each scheme that has a blend one without any PIC.
TRANSFERS = [
    Transfer(scheme, kernel)
    for kernel, schemes in (
        ("quadratic", (PIC(), FLIP(1.0), APIC(), AFLIP(0.9))),
        ("cubic", (PIC(), FLIP(0.9), APIC(), AFLIP(1.0))),
    )
    for scheme in schemes
]
ALL = pytest.mark.parametrize("transfer", TRANSFERS, ids=repr)
CUBIC = Transfer(kernel="cubic")


def config_of(transfer, **options):
    segments = ((NEO_HOOKEAN, 0, COUNT),)
    return Config(GRID, segments, check_step=False, transfer=transfer, **options)


def model_of(mass=0.2, volume=2e-4, youngs=2e3, poisson=0.3, gravity=(0.0, 0.0, 0.0)):
    full = lambda x: jnp.broadcast_to(jnp.asarray(x, float), (COUNT,))  # noqa: E731
    parameters = {"youngs_modulus": full(youngs), "poisson_ratio": full(poisson)}
    return Model(full(mass), full(volume), parameters, jnp.asarray(gravity, float))


def block(transfer, **options):
    """(config, model, state): strained, spinning, every particle on its own way."""
    random = np.random.default_rng(0)
    config = config_of(transfer, **options)
    state = initial_state(
        config,
        np.array([0.3, 0.2, 0.2]) + np.array([0.4, 0.2, 0.2]) * random.random((COUNT, 3)),
        velocity=0.5 * random.normal(size=(COUNT, 3)),
        deformation=np.eye(3) + 0.1 * random.normal(size=(COUNT, 3, 3)),
        affine=random.normal(size=(COUNT, 3, 3)),
    )
    return config, model_of(mass=0.1 + 0.2 * random.random(COUNT)), state


def advanced(config, model, state, steps, dt=DT):
    return advance_frame(config, model, state, dt, steps)


@partial(jax.jit, static_argnums=0)
def plain_step(kernel, model, now, dt, affine, blend):
    numbers = {
        "mass": model.mass,
        "volume": model.volume,
        "E": model.parameters["youngs_modulus"],
        "nu": model.parameters["poisson_ratio"],
        "gravity": model.gravity,
    }
    return reference.step(GRID, numbers, *now, dt, kernel, affine, blend)


@ALL
def test_step_is_the_plain_step(transfer):
    config, model, state = block(transfer)
    model = replace(model, gravity=jnp.array([0.1, -0.2, -9.8]))
    scheme, expected = transfer.scheme, public(state)
    for _ in range(3):
        expected = plain_step(
            transfer.kernel, model, expected, DT, float(scheme.affine), scheme.blend
        )
    end = advanced(config, model, state, 3)
    assert int(end.status.code) == OK and int(end.status.taken) == 3
    for ours, theirs in zip(public(end), expected, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12 * float(jnp.abs(theirs).max()))


@ALL
def test_frames_go_on_where_others_ended(transfer):
    config, model, state = block(transfer)
    once = advanced(config, model, state, 6)
    twice = advanced(config, model, advanced(config, model, state, 2), 4)
    for a, b in zip(public(once), public(twice), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-13)


def axial(C):
    return jnp.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], 1)


def angular_momentum(transfer, mass, x, v, C):
    """That of the particles on the grid: with an affine part their spins count."""
    D = GRID.spacing**2 / {"quadratic": 4, "cubic": 3}[transfer.kernel]
    spin = D * axial(C) if transfer.scheme.affine else 0.0
    return jnp.sum(mass[:, None] * (jnp.cross(x, v) + spin), axis=0)


def momenta(transfer, steps=5):
    """Momentum and angular momentum before and after, and how large they could be."""
    config, model, state = block(transfer)
    found = []
    for now in (state, advanced(config, model, state, steps)):
        x, v, C, _ = public(now)
        linear = jnp.sum(model.mass[:, None] * v, axis=0)
        found.append((linear, angular_momentum(transfer, model.mass, x, v, C)))
    return *found, float(jnp.sum(model.mass) * jnp.abs(state.velocity).max())


@ALL
def test_momentum_is_kept(transfer):
    (before, _), (after, _), scale = momenta(transfer)
    np.testing.assert_allclose(after, before, atol=1e-13 * scale)


@pytest.mark.parametrize("kernel", ["quadratic", "cubic"])
def test_apic_keeps_angular_momentum_and_pic_does_not(kernel):
    (_, before), (_, after), scale = momenta(Transfer(APIC(), kernel))
    np.testing.assert_allclose(after, before, atol=1e-13 * scale)
    (_, before), (_, after), scale = momenta(Transfer(PIC(), kernel))
    assert float(jnp.abs(after - before).max()) > 1e-3 * scale


@pytest.mark.parametrize("transfer", [t for t in TRANSFERS if isinstance(t.scheme, AFLIP)])
def test_affine_flip_gains_the_angular_momentum_that_its_blend_adds(transfer):
    """With v' = u + b (v - v_old), x' = x + dt u and C_old gathered as v_old is, the grid keeps

        sum m (x cross u + D axial C'), and L' - L is
        b sum m (D axial(C_old - C) + dt u cross (v - v_old)):

    nothing where velocities are affine, but no round-off where they are not.
    """
    config, model, state = block(transfer)
    x, v, C, _ = public(state)
    m, kernel, blend = model.mass, transfer.kernel, transfer.scheme.blend
    k = {"quadratic": 4, "cubic": 3}[kernel] / GRID.spacing**2
    grid = reference.to_grid(GRID, x, m, m[:, None] * v, m[:, None, None] * C, kernel)
    old, B = reference.to_particle(GRID, x, reference.per_mass(*grid), kernel)
    end = advanced(config, model, state, 1)
    carried = (public(end)[0] - x) / DT
    added = axial(k * B - C) / k + DT * jnp.cross(carried, v - old)
    expected = blend * jnp.sum(m[:, None] * added, axis=0)
    x, v, C, _ = public(end)
    found = angular_momentum(transfer, m, x, v, C) - angular_momentum(
        transfer, m, *public(state)[:3]
    )
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert float(jnp.abs(expected).max()) > 1e-6


def thrown(transfer, spin):
    """A cloud at rest in itself that flies and, perhaps, turns."""
    config, model, state = block(transfer)
    W = spin * np.array([[0, -0.9, -0.2], [0.9, 0, -0.3], [0.2, 0.3, 0]])
    x = np.asarray(state.position.T)
    state = initial_state(
        config,
        x,
        velocity=np.array([0.2, 0.1, -0.1]) + (x - x.mean(0)) @ W.T,
        affine=np.broadcast_to(W, (COUNT, 3, 3)),
    )
    return config, model, state


@ALL
def test_free_flight_is_exact(transfer):
    config, model, state = thrown(transfer, spin=0.0)
    end = advanced(config, model, state, 20)
    np.testing.assert_allclose(end.velocity, state.velocity, atol=1e-13)
    np.testing.assert_allclose(end.position, state.position + 20 * DT * state.velocity, atol=1e-13)
    np.testing.assert_allclose(end.deformation, state.deformation, atol=1e-12)


@ALL
def test_velocities_of_a_rotation_pass_through_the_grid(transfer):
    """Exactly with an affine part, and where a particle keeps all of its own; not with PIC."""
    config, model, state = thrown(transfer, spin=1.0)
    end = advanced(config, model, state, 1)
    lost = float(jnp.abs(end.velocity - state.velocity).max())
    exact = transfer.scheme.affine or transfer.scheme.blend == 1
    assert lost < 1e-13 if exact else lost > 1e-4


# A bar in its first mode: mirrored at its middle, free at both ends, one line of particles.

HALF = 16  # cells of the bar, a half of what is simulated
BAR = {"mass": 1.25, "volume": 5e-4, "youngs": 2.5e5, "poisson": 0.0}  # c = 10 m/s
LENGTH = HALF * GRID.spacing
PERIOD = 4 * LENGTH / 10.0


def bar(transfer, speed=1e-5, stretch=0.0):
    """(config, model, state) of the bar; stretched uniformly about its middle, and at rest."""
    config = config_of(transfer)
    X = 0.5 * GRID.spacing * (np.arange(COUNT) + 0.5) - LENGTH
    x = (1 + stretch) * X
    place = np.stack([1.95 + x, np.full(COUNT, 0.3), np.full(COUNT, 0.3)], axis=1)
    wave = np.sin(np.pi / (2 * LENGTH) * X)
    state = initial_state(
        config,
        place,
        velocity=speed * wave[:, None] * np.array([1.0, 0, 0]),
        deformation=np.eye(3) + stretch * np.diag([1.0, 0, 0])[None].repeat(COUNT, 0),
    )
    return config, model_of(**BAR), state


def kept_energy(transfer, courant=0.5):
    """Share of the bar's energy that is left after a period."""
    config, model, state = bar(transfer)
    steps = int(np.ceil(PERIOD * 10 / (courant * GRID.spacing)))
    end = advanced(config, model, state, steps, PERIOD / steps)
    assert int(end.status.code) == OK

    def energy(state):
        stored = NEO_HOOKEAN.energy(model.parameters, state.deformation, None)
        kinetic = 0.5 * model.mass * jnp.sum(state.velocity**2, axis=0)
        return float(jnp.sum(kinetic + model.volume * stored))

    return energy(end) / energy(state)


def test_flip_keeps_the_energy_that_pic_loses():
    kept = {repr(t): kept_energy(t) for t in TRANSFERS}
    for kernel in ("quadratic", "cubic"):
        pic, flip, apic, aflip = (kept[repr(t)] for t in TRANSFERS if t.kernel == kernel)
        assert min(flip, apic, aflip) > 0.95 > 0.8 > pic, kept
    # All of FLIP keeps all of it; a tenth of PIC in it shows.
    flips = [kept[repr(t)] for t in TRANSFERS if isinstance(t.scheme, FLIP)]
    assert abs(flips[0] - 1) < 3e-3 < 1e-2 < 1 - flips[1], kept


def crossing_noise(transfer):
    """Velocity that a uniformly stretched bar, whose particles lie differently in every cell, gains
    inside of it in a step, over that of its ends.
    """
    config, model, state = bar(transfer, speed=0.0, stretch=0.13)
    velocity = np.abs(np.asarray(advanced(config, model, state, 1, 1e-4).velocity[0]))
    return velocity[8:-8].max() / velocity.max()


def test_cubic_splines_are_quieter_where_particles_cross_cells():
    quadratic, cubic = (crossing_noise(Transfer(APIC(), k)) for k in ("quadratic", "cubic"))
    assert 1e-4 < cubic < 0.5 * quadratic, (quadratic, cubic)


# The domain.


def test_a_cubic_particle_may_come_within_a_cell_of_the_end():
    """On faces, on a corner and on a node all is well up to the end and not beyond it."""
    config, model, state = thrown(CUBIC, spin=0.0)
    last = np.array(GRID.extent)
    one = np.full(3, 0.1)
    below, above = one * (1 + 1e-9), last - one * (1 + 1e-9)
    inside = [below, above, np.array([below[0], 0.3, above[2]]), np.full(3, 0.3)]
    outside = [one * (1 - 1e-9), last - one * (1 - 1e-9), np.array([0.3, 0.3, 0.6])]
    for places, code in ((inside, OK), (outside, LEFT_GRID)):
        for place in places:
            put = state._replace(
                position=state.position.at[:, 7].set(place), velocity=0 * state.velocity
            )
            status = advanced(config, model, put, 1).status
            assert int(status.code) == code, place
            assert int(status.particle) == (7 if code else -1)
    # With three nodes they may come nearer.
    config, model, state = thrown(Transfer(), spin=0.0)
    put = state._replace(position=state.position.at[:, 7].set(0.06), velocity=0 * state.velocity)
    assert int(advanced(config, model, put, 1).status.code) == OK


# Bounds of the step.


def alone(transfer, strain=1e-6):
    """One particle, strained, among others that have no mass."""
    config, _, state = block(transfer)
    heavy = jnp.arange(COUNT) == 0
    model = model_of(mass=0.2 * heavy, volume=2e-4 * heavy)
    F = jnp.broadcast_to(jnp.eye(3)[..., None], (3, 3, COUNT))
    state = state._replace(
        velocity=0 * state.velocity, affine=0 * state.affine, deformation=(1 + strain) * F
    )
    return config, model, state


@ALL
def test_isolated_bound_is_sharp(transfer):
    config, model, state = alone(transfer)
    density, F = model.mass[:1] / model.volume[:1], state.deformation[..., :1]
    numbers = {name: value[:1] for name, value in model.parameters.items()}
    bound = float(
        isolated_bound(NEO_HOOKEAN, numbers, F, 0 * F, density, GRID.spacing, transfer)[0]
    )
    mu, lam = (float(x[0]) for x in lame(model.parameters))
    k = {"quadratic": 4, "cubic": 3}[transfer.kernel]
    limit = 2 if transfer.scheme.affine else np.sqrt(2)
    expected = limit * GRID.spacing * np.sqrt(1000 / (k * (2 * mu + 3 * lam)))
    assert bound == pytest.approx(expected, rel=1e-6)
    for share, stable in ((0.98, True), (1.1, False)):
        end = advanced(config, model, state, 200, share * bound)
        grown = float(jnp.abs(end.deformation[0, 0, 0] - 1)) / 1e-6
        assert (int(end.status.code) == OK and grown < 10) == stable


@pytest.mark.parametrize("transfer", [t for t in TRANSFERS if t.scheme.affine], ids=repr)
def test_a_particle_alone_swings_at_second_order_in_time(transfer):
    """At w = sqrt(k (2 mu + 3 lambda) / rho) / dx, from rest, its rate half a step before."""
    config, model, state = alone(transfer, strain=1e-6)
    mu, lam = (float(x[0]) for x in lame(model.parameters))
    k = {"quadratic": 4, "cubic": 3}[transfer.kernel]
    w = np.sqrt(k * (2 * mu + 3 * lam) / 1000) / GRID.spacing
    end, errors = 1.3 * 2 * np.pi / w, []
    for steps in (50, 100, 200):
        dt = end / steps
        rate = 1e-6 * w * np.sin(w * dt / 2) * jnp.eye(3)[..., None]
        start = state._replace(affine=jnp.broadcast_to(rate, state.affine.shape))
        found = advanced(config, model, start, steps, dt).deformation[0, 0, 0] - 1
        errors.append(abs(float(found) / 1e-6 - np.cos(w * end)))
    order = np.polyfit(np.log([1 / 50, 1 / 100, 1 / 200]), np.log(errors), 1)[0]
    assert abs(order - 2) < 0.1, errors


def amplification(kernel, affine, blend, per_cell, offset, wave, dt):
    """Largest growth a step of a plane wave in one dimension, dx = c = rho = 1: particles lie at
    (j + offset) / per_cell in every cell and hold velocity, C and strain.
    """
    k, reach = (3, 3) if kernel == "cubic" else (4, 2)
    place = (np.arange(per_cell) + offset) / per_cell
    cell = np.arange(-reach, reach + 1)
    to_node = -(cell[:, None] + place)
    w = np.asarray(reference.spline(to_node, kernel)) * np.exp(1j * wave * cell)[:, None]
    mass = np.abs(w).sum()
    give, give_affine = w.sum(0) / mass, (w * to_node).sum(0) / mass
    from_node = np.arange(-reach, reach + 2) - place[:, None]
    phase = np.exp(1j * wave * np.arange(-reach, reach + 2))
    w = np.asarray(reference.spline(from_node, kernel)) * phase
    take, take_affine = w.sum(1), (w * from_node).sum(1)
    one, none = np.eye(per_cell), np.zeros((per_cell, per_cell))
    before = np.concatenate([give, affine * give_affine, 0 * give])
    after = np.concatenate([give, affine * give_affine, -dt * k * give_affine])
    kept = np.concatenate([one, none, none], axis=1) - np.outer(take, before)
    gradient = k * np.outer(take_affine, after)
    strain = np.concatenate([none, none, one], axis=1) + dt * gradient
    velocity = np.outer(take, after) + blend * kept
    return np.abs(np.linalg.eigvals(np.concatenate([velocity, gradient, strain]))).max()


@ALL
def test_sound_bound_is_where_waves_start_to_grow(transfer):
    scheme = transfer.scheme
    bound = SOUND[transfer.kernel][scheme.affine]

    def largest(dt, per_cell, offsets):
        return max(
            amplification(transfer.kernel, scheme.affine, scheme.blend, per_cell, o, q, dt)
            for o in offsets
            for q in np.linspace(0.1, np.pi, 16)
        )

    offsets = (0.01, 0.2, 0.4, 0.5)
    assert all(largest(0.998 * bound, n, offsets) < 1 + 1e-6 for n in (1, 2, 3))
    assert largest(1.02 * bound, 1, offsets) > 1.001


# The program.


def test_only_a_scheme_that_keeps_velocities_has_code_for_them():
    def found(transfer):
        config, model, state = block(transfer)
        jaxpr = jax.make_jaxpr(step, static_argnums=0)(config, model, state, DT).jaxpr
        counts = [count_in_transfers(jaxpr, name) for name in ("scatter-add", "gather")]
        return "velocity of its own" in parts(partial(step, config), model, state, DT), *counts

    assert found(Transfer()) == found(Transfer(PIC())) == (False, 9, 18)
    assert found(Transfer(FLIP(0.0))) == (False, 9, 18)
    assert found(Transfer(AFLIP())) == (True, 9, 18)
    assert found(CUBIC) == (False, 16, 32)


@pytest.mark.parametrize(
    "transfer",
    [
        Transfer(AFLIP(1.0), "cubic"),
        pytest.param(Transfer(FLIP(0.9)), marks=pytest.mark.slow),
        pytest.param(Transfer(PIC(), "cubic"), marks=pytest.mark.slow),
        pytest.param(CUBIC, marks=pytest.mark.slow),
    ],
    ids=repr,
)
def test_gradient_is_the_central_difference_to_second_order(transfer):
    config, model, state = block(transfer)
    random = np.random.default_rng(8)
    numbers = (model.parameters["youngs_modulus"], state.position, state.velocity, state.affine)
    direction = tuple(
        scale * jnp.asarray(random.normal(size=n.shape))
        for scale, n in zip((1e3, 1e-2, 0.5, 0.5), numbers, strict=True)
    )

    def loss(step, numbers):
        moved = jax.tree.map(lambda n, d: n + step * d, numbers, direction)
        E, position, velocity, affine = moved
        parameters = model.parameters | {"youngs_modulus": E}
        start = state._replace(position=position, velocity=velocity, affine=affine)
        end = rollout(config, replace(model, parameters=parameters), start, dt=2e-3, steps=4)
        x, v, C, F = public(end)
        return jnp.sum(x**2) + jnp.sum(jnp.sin(v)) + 1e-2 * jnp.sum(C**2) + jnp.sum(F**3)

    both = jax.jit(jax.value_and_grad(loss, argnums=1))
    _, gradient = both(0.0, numbers)
    slope = float(sum(jnp.sum(g * d) for g, d in zip(gradient, direction, strict=True)))

    def error(h):
        ends = [float(both(side * h, numbers)[0]) for side in (1, -1)]
        return abs((ends[0] - ends[1]) / (2 * h) - slope) / abs(slope)

    coarse, fine = error(1e-3), error(1e-4)
    assert fine < 1e-6
    assert coarse / fine > 50  # 100 for an exact gradient, 1 for a wrong one


def test_chunks_devices_and_a_window_change_nothing():
    transfer = TRANSFERS[-1]
    config, model, state = block(transfer)
    spread = replace(config, placement=Placement(4, 16), window=(16, 7, 7))
    a, b = (advanced(c, model, state, 10) for c in (config, spread))
    assert int(b.status.code) == OK
    for ours, theirs in zip(public(b), public(a), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_scenes_over_a_batch_axis():
    config, model, state = block(TRANSFERS[1])
    speeds = jnp.stack([state.velocity, 0 * state.velocity])

    def end(velocity):
        return rollout(config, model, state._replace(velocity=velocity), dt=DT, steps=2).velocity

    together = jax.jit(jax.vmap(end))(speeds)
    for i in range(2):
        alone = advanced(config, model, state._replace(velocity=speeds[i]), 2).velocity
        np.testing.assert_allclose(together[i], alone, atol=1e-13)


def test_wrong_transfers_are_named():
    for scheme in (FLIP, AFLIP):
        for blend in (-0.1, 1.5, float("nan")):
            with pytest.raises(InputError, match="blend"):
                scheme(blend)
    with pytest.raises(InputError, match=r"scheme: 'flip' is none of PIC\(\), FLIP\(\), APIC\(\)"):
        Transfer("flip")
    with pytest.raises(InputError, match=r"kernel: unknown value 'linear'.*quadratic"):
        Transfer(kernel="linear")
    grid = Grid((3, 8, 8), 0.1)
    with pytest.raises(InputError, match="cubic splines touch 4 nodes"):
        Config(grid, ((NEO_HOOKEAN, 0, 5),), transfer=CUBIC)
    with pytest.raises(InputError, match="between 4 nodes"):
        Config(GRID, ((NEO_HOOKEAN, 0, 5),), window=(3, 7, 7), transfer=CUBIC)

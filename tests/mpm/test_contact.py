"""Contact at particles: a plane acts where it stands, at any place, spacing and time step."""

import dataclasses
from functools import partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Box, Damping, Plane, Setting, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.materials.elasticity import ELASTIC_PARAMETERS, NEO_HOOKEAN, elastic_rest
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.state import Config, Model, initial_state
from jaxphys.mpm.stepping.bounds import with_wave_modulus

from .cases import count_primitives

H = 0.1
DENSITY, POISSON = 1000.0, 0.25
P_WAVE = (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))  # over Young's modulus
G = 9.81


def stiffest(config, model):
    """Stiffness over mass [1/s^2] of the first boundary's contact."""
    return float(model.boundaries[0].stiffest(with_wave_modulus(config, model), config.grid))


def lattice(lower, upper, distance):
    """Points (N, 3) in the middles of equal cubes that fill a box."""
    lower, upper, distance = np.broadcast_arrays(lower, upper, distance)
    lines = [
        low + d * (np.arange(round((high - low) / d)) + 0.5)
        for low, high, d in zip(lower, upper, distance, strict=True)
    ]
    return np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 3)


def turned(points, middle, angle):
    """Points turned about y so that z goes to (sin, 0, cos)."""
    c, s = np.cos(angle), np.sin(angle)
    return (points - middle) @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + middle


def body(points, volume, boundaries, *, young=2e4, gravity=(0, 0, -G), velocity=(0, 0, 0),
         nodes=(11, 11, 14), h=H, dtype=jnp.float64):  # fmt: skip
    """(config, model, state) of one elastic body."""
    count, grid = len(points), Grid(nodes, h)
    config = Config(grid, ((NEO_HOOKEAN, 0, count),))
    boundaries = prepare(boundaries, Setting(grid, points, np.full(count, volume), dtype))
    model = Model(
        mass=jnp.full(count, volume * DENSITY, dtype),
        volume=jnp.full(count, volume, dtype),
        parameters={
            "youngs_modulus": jnp.full(count, young, dtype),
            "poisson_ratio": jnp.full(count, POISSON, dtype),
        },
        gravity=jnp.asarray(gravity, dtype),
        boundaries=boundaries,
    )
    velocity = np.broadcast_to(velocity, points.shape)
    return (
        config,
        model,
        initial_state(config, points, velocity, dtype=dtype, boundaries=boundaries),
    )


def wave_speed(young=2e4):
    return (young * P_WAVE / DENSITY) ** 0.5


@partial(jax.jit, static_argnums=(0, 3))
def film(config, model, state, frames, steps, dt):
    """The last state, and positions and velocities (frames, 3, N)."""

    def frame(state, _):
        state = jax.lax.fori_loop(0, steps, lambda _, s: step(config, model, s, dt), state)
        return state, (state.position, state.velocity)

    return jax.lax.scan(frame, state, length=frames)


def contact_energy(model, config, position, distance):
    """sum k/2 (r - d)+^2 [J] with k = 2 M V / h^2 and r = V^(1/3) / 2."""
    k = 2 * P_WAVE * model.parameters["youngs_modulus"] * model.volume / config.grid.spacing**2
    x = jnp.maximum(jnp.cbrt(model.volume) / 2 - distance, 0)
    return jnp.sum(0.5 * k * x**2)


def test_a_particle_alone_swings_back_as_from_a_spring():
    """It goes in by v / w and comes out with the reverse of its velocity after pi / w."""
    place, speed, volume = 0.537, 0.4, (H / 2) ** 3
    radius = H / 4
    start = np.array([[0.5, 0.5, place + radius]])
    config, model, state = body(
        start,
        volume,
        (Plane((0, 0, place), friction=0),),
        gravity=(0, 0, 0),
        velocity=(0, 0, -speed),
    )
    w = (2 * 2e4 * P_WAVE / DENSITY) ** 0.5 / H
    assert stiffest(config, model) == pytest.approx(w**2)
    steps = 4000
    end, (x, _) = film(config, model, state, 40, steps // 40, np.pi / w / steps)
    assert float(x[:, 2, 0].min()) == pytest.approx(place + radius - speed / w, abs=2e-4 * H)
    assert float(end.velocity[2, 0]) == pytest.approx(speed, rel=2e-3)


def no_stress(parameters, F, history, dt):
    return F, jnp.zeros_like(F), history


DUST = Law(
    "dust", ELASTIC_PARAMETERS, (), (), no_stress, None, None, plastic=False, rest=elastic_rest
)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_the_bound_of_its_springs_is_sharp_for_a_particle_alone(share):
    """A slipping surface keeps it on its spring on both sides: it swings, or is thrown off."""
    plane = Plane((0, 0, 0.48), surface="slip", friction=0)
    config, model, state = body(
        np.array([[0.5, 0.5, 0.48 + H / 4]]), (H / 2) ** 3, (plane,), gravity=(0, 0, 0),
        velocity=(0, 0, -1e-6),
    )  # fmt: skip
    config = dataclasses.replace(config, segments=((DUST, 0, 1),))
    dt = share * 2 / stiffest(config, model) ** 0.5
    _, (x, _) = film(config, model, state, 10, 20, dt)
    swing = np.abs(np.asarray(x)[:, 2, 0] - 0.48 - H / 4)
    assert (swing.max() < 1e-3 * H) == (share < 1)


def drop(offset, angle=0.0, friction=0.0, h=H, frames=20):
    """Positions (T, 3, N) of a block that falls on a plane, both moved by `offset` (3,)."""
    normal = np.array([np.sin(angle), 0, np.cos(angle)])
    foot = np.array([0.5, 0.5, 0.37]) + offset
    points = lattice((0.35, 0.35, 0.0), (0.65, 0.65, 0.3), h / 2)
    points = points + np.array([0, 0, foot[2] + 0.03])
    points = turned(points + offset * [1, 1, 0], foot, angle)
    config, model, state = body(
        points,
        (h / 2) ** 3,
        (Plane(tuple(foot), tuple(normal), friction=friction),),
        young=1e5,
        gravity=tuple(-G * normal),
        velocity=tuple(-1.0 * normal),
        nodes=(round(1.1 / h),) * 3,
        h=h,
    )
    steps = round(0.02 / (0.35 * h / wave_speed(1e5)))
    _, (x, _) = film(config, model, state, frames, steps, 0.02 / steps)
    return np.asarray(x) - offset[:, None]


@pytest.mark.parametrize(("angle", "friction", "largest"), [(0.0, 0.0, 0.03), (0.6, 0.4, 0.05)])
def test_motion_is_the_same_at_every_place(angle, friction, largest):
    """Held nodes differ by 0.4 cells here."""
    first = drop(np.zeros(3), angle, friction)
    assert np.ptp(first.mean(2) @ [np.sin(angle), 0, np.cos(angle)]) > 0.3 * H  # it falls and leaps
    for share in (0.3, 0.5, 0.8):
        offset = share * H * np.array([0.4, 0.2, 1.0] if angle else [0.0, 0.0, 1.0])
        apart = np.sqrt(((drop(offset, angle, friction) - first) ** 2).sum(1).mean(1)).max()
        assert apart < largest * H, (share, apart / H)


def settled(points, volume, *boundaries, young=1e5, h=H, gravity=(0, 0, -G), seconds=0.6):
    config, model, state = body(
        points,
        volume,
        (*boundaries, Damping(15.0)),
        young=young,
        h=h,
        gravity=gravity,
    )
    steps = round(seconds / (0.35 * h / wave_speed(young)))
    end, _ = film(config, model, state, 1, steps, seconds / steps)
    assert int(end.status.code) == 0 and float(jnp.abs(end.velocity).max()) < 5e-3
    return np.asarray(end.position)


@pytest.mark.parametrize("per_cell", [4, 8, 27])
def test_a_body_rests_on_its_own_surface(per_cell):
    """Whatever the number of particles in a cell, the underside of a lattice lies on the plane."""
    place, side = 0.463, H * per_cell ** (-1 / 3)
    points = lattice(0, side * np.array([6, 6, 5]), side) + np.array([0.4, 0.4, place])
    x = settled(points, side**3, Plane((0, 0, place), friction=0))
    lowest = points[:, 2] < place + side
    gap = x[2, lowest].mean() - place - side / 2
    assert abs(gap) < 0.1 * H and x[2, lowest].std() < 0.02 * H


def slide(friction, slope):
    """Acceleration along an incline, and speed at last, of a flat block that rested on it."""
    gravity = (G * np.sin(slope), 0, -G * np.cos(slope))
    points = lattice((0.25, 0.4, 0.33), (0.55, 0.6, 0.43), H / 2)
    config, model, state = body(
        points, (H / 2) ** 3, (Plane((0, 0, 0.33), friction=friction), Damping(60.0, end=0.15)),
        young=4e4, gravity=gravity, nodes=(16, 10, 9),
    )  # fmt: skip
    dt = 0.35 * H / wave_speed(4e4)
    _, (_, v) = film(config, model, state, 8, round(0.075 / dt), dt)
    v = np.asarray(v)[:, 0].mean(1)
    return (v[-1] - v[3]) / (4 * round(0.075 / dt) * dt), v[-1]


@pytest.mark.parametrize("friction", [0.3, 0.7])
def test_friction_holds_up_to_its_angle_and_slides_beyond(friction):
    acceleration, speed = slide(friction, np.arctan(0.98 * friction))
    assert abs(acceleration) < 0.02 and abs(speed) < 0.01
    for steeper in (1.02, 1.5):
        slope = np.arctan(steeper * friction)
        acceleration, _ = slide(friction, slope)
        expected = G * (np.sin(slope) - friction * np.cos(slope))
        assert acceleration == pytest.approx(expected, rel=0.04, abs=0.02)


def small_drop(dtype=jnp.float64, friction=0.4, share=0.35, frames=1, seconds=0.16, slide=0.5):
    """A small block that falls on a slope, slides and leaves: config, model, state, steps, dt."""
    points = lattice(0, (0.2, 0.2, 0.15), H / 2) + np.array([0.4, 0.4, 0.43])
    made = body(
        points, (H / 2) ** 3, (Plane((0.5, 0.5, 0.4), (0.1, 0.0, 1.0), friction=friction),),
        velocity=(slide, 0, -1.0), nodes=(12, 10, 11), dtype=dtype,
    )  # fmt: skip
    steps = round(seconds / frames / (share * H / wave_speed()))
    return *made, steps, seconds / frames / steps


def test_no_energy_is_gained():
    config, model, state, steps, dt = small_drop(slide=0.2, share=0.2)

    @jax.jit
    def energies(state):
        def both(s, _):
            after = step(config, model, s, dt)
            return after, total(s, after)

        return jax.lax.scan(both, state, length=steps)[1]

    def total(s, after):
        """Kinetic, stored, of contact, and of weight [J]; velocities belong half a step earlier
        than positions, and are the mean of two.
        """
        distance = model.boundaries[0].faces(s.position, s.time)[0].distance
        v, C = 0.5 * (s.velocity + after.velocity), 0.5 * (s.affine + after.affine)
        squares = jnp.sum(v**2, axis=0) + H**2 / 4 * jnp.sum(C**2, axis=(0, 1))
        stored = NEO_HOOKEAN.energy(model.parameters, s.deformation, None)
        inner = jnp.sum(0.5 * model.mass * squares + model.volume * stored)
        weight = G * jnp.sum(model.mass * (s.position[2] - 0.4))
        return inner + weight + contact_energy(model, config, s.position, distance), distance.min()

    energy, lowest = energies(state)
    assert lowest.min() < 0.2 * H  # it does touch
    assert float(energy.max()) < 1.01 * float(energy[0])
    assert float(energy[-1]) < 0.99 * float(energy[0])


@pytest.fixture(scope="module")
def landed():
    """Mean position after the drop, as a function of the plane's numbers."""
    config, model, state, steps, dt = small_drop()

    @jax.jit
    def mean(point, velocity, friction):
        plane = model.boundaries[0].changed(point=point, velocity=velocity, friction=friction)
        end = jax.lax.scan(
            lambda s, _: (
                step(config, dataclasses.replace(model, boundaries=(plane,)), s, dt),
                None,
            ),
            state,
            length=steps,
        )[0]
        return jnp.mean(end.position * jnp.array([[1.0], [0.5], [2.0]]))

    return mean


def test_derivatives_by_the_plane_are_central_differences(landed):
    arguments = [jnp.array([0.5, 0.5, 0.4]), jnp.array([0.0, 0.0, 0.1]), jnp.array(0.4)]
    gradients = jax.jit(jax.grad(landed, (0, 1, 2)))(*arguments)
    assert abs(float(gradients[0][2])) > 0.1
    for index, entry in ((0, (0,)), (0, (2,)), (1, (2,)), (2, ())):
        nudge = jnp.zeros_like(arguments[index]).at[entry].set(1e-6)
        up, down = (
            landed(*(a + sign * nudge if i == index else a for i, a in enumerate(arguments)))
            for sign in (1, -1)
        )
        found = float(gradients[index][entry])
        assert found == pytest.approx(float(up - down) / 2e-6, rel=1e-4) and found != 0


def test_motion_does_not_depend_on_the_length_of_steps_nor_on_precision():
    ends = []
    for dtype, share in ((jnp.float64, 0.35), (jnp.float64, 0.175), (jnp.float32, 0.35)):
        config, model, state, steps, dt = small_drop(dtype, share=share)
        end, _ = film(config, model, state, 1, steps, dt)
        assert end.position.dtype == dtype and end.slip.shape == (3, len(state.position[0]))
        ends.append(np.asarray(end.position, np.float64))
    assert np.abs(ends[1] - ends[0]).max() < 0.05 * H
    assert np.abs(ends[2] - ends[0]).max() < 2e-3 * H


@pytest.mark.parametrize("surface", ["sticky", "slip", "separate"])
def test_a_ceiling_holds_as_its_surface_says(surface):
    """Gravity pulls off and along: sticky holds both, slip the first, separate lets fall."""
    points = lattice(0, (0.2, 0.2, 0.1), H / 2) + np.array([0.4, 0.4, 0.5])
    plane = Plane((0, 0, 0.6), (0, 0, -1), surface, friction=0, acts_on="particles")
    config, model, state = body(points, (H / 2) ** 3, (plane,), gravity=(1.0, 0, -2.0))
    steps = round(0.3 / (0.35 * H / wave_speed()))
    end, _ = film(config, model, state, 1, steps, 0.3 / steps)
    moved = np.asarray(end.position).mean(1) - points.mean(0)
    assert moved[0] == pytest.approx(0.0 if surface == "sticky" else 0.045, abs=0.003)
    assert moved[2] == pytest.approx(-0.09 if surface == "separate" else 0.0, abs=0.004)


def test_a_box_pushes_and_does_not_hold():
    points = lattice(0, (0.15, 0.15, 0.15), H / 2) + np.array([0.5, 0.4, 0.4])
    box = Box((0.33, 0.5, 0.5), (0.1, 0.2, 0.2), (1.0, 0, 0), end=0.2, surface="separate")
    config, model, state = body(
        points, (H / 2) ** 3, (box,), gravity=(0, 0, 0), nodes=(16, 11, 11), young=5e4
    )
    steps = round(0.3 / (0.3 * H / wave_speed(5e4)))
    _, (x, v) = film(config, model, state, 3, steps // 3, 0.3 / steps)
    x, v = np.asarray(x), np.asarray(v)
    # Elastic: it is thrown ahead, at up to twice the speed of the box, and goes on.
    assert 1.0 < v[-1, 0].mean() < 2.01 and np.ptp(v[1:, 0].mean(1)) < 0.05
    assert x[1, 0].min() > 0.43 + 0.2 - 0.3 * H


def test_what_went_deep_inside_is_pushed_out_or_told_of():
    for depth in (0.5, 1.5, 3.0):
        config, model, state = body(
            np.array([[0.5, 0.5, 0.8]]), (H / 2) ** 3, (Plane((0, 0, 0.6), friction=0),)
        )
        state = state._replace(position=jnp.array([[0.5], [0.5], [0.6 - depth * H]]))
        end, _ = film(config, model, state, 10, 5, 0.35 * H / wave_speed())
        assert int(end.status.code) != 0 or float(end.position[2, 0]) > 0.6


def test_friction_of_zero_leaves_no_trace():
    def roots(friction):
        config, model, state, _, dt = small_drop(friction=friction)
        assert (state.slip is None) == (friction == 0)
        traced = jax.make_jaxpr(lambda m, s: step(config, m, s, dt))(model, state)
        return count_primitives(traced.jaxpr, "sqrt"), model.boundaries[0]

    (without, plane), (with_some, _) = roots(0.0), roots(0.4)
    assert with_some == without + 1
    with pytest.raises(InputError, match="friction: was built as zero"):
        plane.changed(friction=jnp.array(0.2))
    with pytest.raises(InputError, match="did you mean 'friction'"):
        plane.changed(fricton=0.2)


def test_a_state_without_room_for_slip_is_refused():
    config, model, state, _, dt = small_drop()
    with pytest.raises(InputError, match=r"boundaries=model\.boundaries"):
        step(config, model, state._replace(slip=None), dt)


def ball(middle, radius, distance):
    """A ball cut out of a lattice that lies askew."""
    count = int(np.ceil(radius / distance)) + 2
    line = distance * (np.arange(-count, count) + 0.5)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    points = turned(turned(points, 0, 0.5)[:, [1, 2, 0]], 0, 0.3)
    return points[np.sum(points**2, axis=1) < radius**2] + middle


def leap(h, offset=0.0, frames=13):
    """Positions (T, 3, N) of an elastic ball that falls from 0.2 m, at 1 m/s, and leaps once."""
    points = ball([0.75, 0.75, 0.45 + 0.55 + offset * h], 0.35, h / 2)
    config, model, state = body(
        points,
        (h / 2) ** 3,
        (Plane((0, 0, 0.45 + offset * h), friction=0),),
        young=3e5,
        velocity=(0, 0, -1.0),
        nodes=(round(1.5 / h) + 1,) * 2 + (round(1.7 / h) + 1,),
        h=h,
        dtype=jnp.float32,
    )
    steps = round(1 / 24 / (0.3 * h / wave_speed(3e5)))
    end, (x, _) = film(config, model, state, frames, steps, 1 / 24 / steps)
    assert int(end.status.code) == 0
    return np.asarray(x, np.float64) - np.array([[0.0], [0.0], [0.45 + offset * h]])


def leaps(spacings):
    """Height [m] of the leap and path of the middle (T,) at each spacing."""
    paths = [leap(h)[:, 2].mean(1) for h in spacings]
    return [path[path[:8].argmin() :].max() - 0.35 for path in paths], paths


@pytest.mark.slow
def test_a_ball_leaps_alike_at_every_spacing():
    """Errors fall with every refinement, and halving the cells changes the leap by little."""
    heights, paths = leaps((0.1, 0.07, 0.05, 0.035, 0.025))
    errors = [np.sqrt(np.mean((path - paths[-1]) ** 2)) for path in paths[:-1]]
    assert all(finer < coarser for coarser, finer in pairwise(errors)), errors
    assert heights[2] == pytest.approx(heights[4], rel=0.05), heights


@pytest.mark.slow
@pytest.mark.parametrize("h", [0.1, 0.05])
def test_a_ball_leaps_alike_at_every_place(h):
    first = leap(h)
    for offset in (0.25, 0.5, 0.75):
        apart = np.sqrt(((leap(h, offset) - first) ** 2).sum(1).mean(1)).max()
        assert apart < 0.03 * h, (offset, apart / h)

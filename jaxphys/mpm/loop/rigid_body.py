"""A rigid body among particles: how a step moves it, and how it meets planes and other obstacles.

Its momentum changes by what it takes from the particles, to the last digit what they get; so does
its angular momentum, about the same point. The turn follows the angular momentum by a midpoint on
the group of rotations, second order in dt.

Against other surfaces it stands on a few points, as stiff as the step allows, with a dashpot beside
each spring for the restitution: these are rigid, and have no stiffness of their own.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra, compensated
from jaxphys.core.program import part
from jaxphys.core.rotations import (
    quaternion_product,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from jaxphys.mpm.boundaries.base import Boundary
from jaxphys.mpm.boundaries.contact import Face, deflection
from jaxphys.mpm.boundaries.free import Free, Pose, Solid, Wrench
from jaxphys.mpm.boundaries.obstacle import Obstacle, others
from jaxphys.mpm.state import RigidBody

SWING = 0.3  # angle of its springs' swing in a step; 2 is the limit of stability
TOGETHER = 4  # points on which it stands at once with that


class Inertia(NamedTuple):
    """mass: [kg], (); own: about the centre of mass in its own axes [kg m^2], (3, 3); solid: its
    shape.
    """

    mass: Array
    own: Array
    solid: Solid


def free_one(boundaries: tuple[Boundary, ...]) -> Obstacle | None:
    """The boundary that is a rigid body; there is one at most."""
    return next((b for b in boundaries if isinstance(b, Obstacle) and b.free), None)


def inertia_of(obstacle: Obstacle) -> Inertia:
    """Of a free obstacle."""
    assert isinstance(obstacle.motion, Free)
    solid = obstacle.solid()
    motion = obstacle.motion
    return Inertia(motion.mass_of(solid), motion.inertia_of(solid), solid)


def spin_of(inertia: Inertia, orientation: Array, angular_momentum: Array) -> Array:
    """[rad/s], (3,), in the world's axes."""
    axes = quaternion_to_matrix(orientation)
    own = algebra.matvec(axes.T, angular_momentum)
    return algebra.matvec(axes, algebra.matvec(algebra.inverse(inertia.own), own))


def moved(obstacle: Obstacle, body: RigidBody, dt: Array) -> RigidBody:
    """The body `dt` [s] later: x <- x + dt v, and its turn."""
    with part("rigid body"):
        inertia = inertia_of(obstacle)
        rest = body.rest or (None, None)
        position, position_rest = compensated.add(
            body.position, rest[0], dt * body.momentum / inertia.mass
        )
        turn = dt * spin_of(inertia, body.orientation, body.angular_momentum)
        half = body.orientation + _turned_by(0.5 * turn, body.orientation)
        turn = dt * spin_of(inertia, half, body.angular_momentum)
        orientation, orientation_rest = compensated.add(
            body.orientation, rest[1], _turned_by(turn, body.orientation)
        )
        if position_rest is None or orientation_rest is None:
            return body._replace(position=position, orientation=orientation)
        kept = position_rest, orientation_rest
        return body._replace(position=position, orientation=orientation, rest=kept)


def _turned_by(turn: Array, orientation: Array) -> Array:
    """By how much a quaternion (4,) changes when it is turned by a rotation vector [rad], to the
    last digit however small that is.
    """
    change = rotation_vector_to_quaternion(turn)
    along = change[1:]
    less = -jnp.sum(along**2, keepdims=True) / (1 + change[:1])
    return quaternion_product(jnp.concatenate([less, along]), orientation)


def pose_of(obstacle: Obstacle, body: RigidBody) -> Pose:
    """Where a free obstacle is."""
    inertia = inertia_of(obstacle)
    arm = algebra.matvec(quaternion_to_matrix(body.orientation), inertia.solid.middle)
    spin = spin_of(inertia, body.orientation, body.angular_momentum)
    velocity = body.momentum / inertia.mass - jnp.cross(spin, arm)
    return Pose(body.position - arm, body.orientation, velocity, spin)


def placed(
    boundaries: tuple[Boundary, ...], obstacle: Obstacle, body: RigidBody
) -> tuple[Boundary, ...]:
    """The boundaries, the obstacle among them where the body is."""
    pose = pose_of(obstacle, body)
    return tuple(b.placed(pose) if isinstance(b, Obstacle) and b.free else b for b in boundaries)


def pushed(
    boundaries: tuple[Boundary, ...],
    body: RigidBody,
    given: Wrench,
    gravity: Array | None,
    time: Array,
    since: Array,
    dt: Array,
) -> RigidBody:
    """The body after what it gave to the particles, gravity, and all that it touches.

    boundaries: as `placed` makes them; since: the step [s] that moved it here, dt: the next one.
    """
    obstacle = free_one(boundaries)
    assert obstacle is not None and isinstance(obstacle.motion, Free)
    assert obstacle.motion.now is not None
    with part("rigid body"):
        inertia = inertia_of(obstacle)
        taken, turned, slip = met(boundaries, inertia, obstacle, body, time, since, dt)
        momentum = body.momentum - given.momentum + taken
        if gravity is not None:
            momentum = momentum + dt * inertia.mass * gravity
        # About its centre of mass, not that of its pose.
        arm = obstacle.motion.now.centre - body.position
        turning = given.turning + jnp.cross(arm, given.momentum)
        return body._replace(
            momentum=momentum,
            angular_momentum=body.angular_momentum - turning + turned,
            slip=slip,
        )


def met(
    boundaries: tuple[Boundary, ...],
    inertia: Inertia,
    obstacle: Obstacle,
    body: RigidBody,
    time: Array,
    since: Array,
    dt: Array,
) -> tuple[Array, Array, Array | None]:
    """Momentum (3,), angular momentum about its centre of mass (3,), and slip after a step against
    all surfaces that are not the body's own.
    """
    assert isinstance(obstacle.motion, Free)
    solid = inertia.solid
    axes = quaternion_to_matrix(body.orientation)
    arms = _product(axes, solid.points - solid.middle[:, None])
    radius = jnp.broadcast_to(solid.radius, arms.shape[1:])
    spin = spin_of(inertia, body.orientation, body.angular_momentum)
    velocity = body.momentum / inertia.mass
    normal_stiffness, share = _stiffness(inertia, dt)
    # As many points together are damped by that share of critical damping.
    dashpot = 2 * obstacle.motion.damping_ratio() * normal_stiffness * dt / SWING
    momentum = turned = jnp.zeros_like(body.momentum)
    kept, first = [], 0
    for other in others(boundaries):
        for face in other.faces(body.position[:, None] + arms, time):
            face = face._replace(velocity=jnp.broadcast_to(face.velocity, arms.shape))
            touch = arms - radius * face.normal
            slips = velocity[:, None] + jnp.cross(spin, touch.T).T - face.velocity
            strain = None
            if face.keeps_slip and body.slip is not None:
                strain = body.slip[first : first + 3] + since * slips
                first += 3
            push, strain = _strained(face, radius, strain, share)
            along = jnp.sum(slips * face.normal, axis=0)
            force = normal_stiffness * push - dashpot * along * (face.distance < radius)
            if face.surface == "separate":
                force = jnp.maximum(force, 0)
            impulse = dt * force * face.normal
            if strain is not None:
                impulse = impulse - dt * share * normal_stiffness * strain
                kept.append(strain)
            momentum = momentum + jnp.sum(impulse, axis=1)
            turned = turned + jnp.sum(jnp.cross(touch.T, impulse.T), axis=0)
    return momentum, turned, jnp.concatenate(kept) if kept else body.slip


def _strained(
    face: Face, radius: Array, strain: Array | None, share: Array
) -> tuple[Array, Array | None]:
    """`deflection`, where springs along the surface are softer by `share`."""
    if face.friction is not None:
        face = face._replace(friction=face.friction / share)
    return deflection(face, radius, strain)


def _product(A: Array, x: Array) -> Array:
    """A @ x for (3, 3) and (3, P), in full precision everywhere."""
    return algebra.total(A[:, i, None] * x[i] for i in range(3))


def _stiffness(inertia: Inertia, dt: Array) -> tuple[Array, Array]:
    """Of each point's spring [N/m], (), and how much softer the one along the surface is, ().

    A push at r is met by 1 / M and by the sum over all directions of (r x n) I^-1 (r x n).
    """
    solid = inertia.solid
    inverse = algebra.inverse(inertia.own)
    arms = solid.points - solid.middle[:, None]
    turning = jnp.sum(arms**2, axis=0) * algebra.trace(inverse) - jnp.sum(
        arms * _product(inverse, arms), axis=0
    )
    normal = 1 / inertia.mass + jnp.max(turning)
    tangential = normal + solid.radius**2 * jnp.max(jnp.diag(inverse))
    together = min(TOGETHER, arms.shape[1])
    return (SWING / dt) ** 2 / (together * normal), normal / tangential

"""A simulation that takes commands while it runs, and says what is to be seen of it.

It knows no browser. What a command changes is the scene, of which the solver's numbers are built
again as they would be for a film: so that a saved scene is what ran. Shapes stay, so that nothing
is compiled again, but where another material asks for another program.

Pokes are `impulse`s of one frame, which a saved scene lists; a hand's pulls are not kept.
"""

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.splats import Splats
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.mpm.boundaries import FOREVER, Box, Impulse, Plane, Setting, Vector
from jaxphys.mpm.boundaries.base import Boundary
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.motion import Frame
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import Model, State
from jaxphys.mpm.stepping import Adaptive
from jaxphys.pipeline.draw import frame_splats
from jaxphys.pipeline.film import picture, settings_for, surroundings_of
from jaxphys.pipeline.frames import Moment, moment_of, retried
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import next_capacity, required_pairs
from jaxphys.scene.build import Built, build, place_objects, validate
from jaxphys.scene.scene import Scene
from jaxphys.viewer.events import (
    Drag,
    Event,
    Grab,
    MoveBoundary,
    Pause,
    Play,
    Poke,
    Release,
    Reset,
    SetMaterial,
    SetNumber,
    Step,
)
from jaxphys.viewer.hand import Hand
from jaxphys.viewer.numbers import with_material, with_number
from jaxphys.viewer.picking import met
from jaxphys.viewer.reduced import reduced
from jaxphys.viewer.shown import Shown, camera_of
from jaxphys.viewer.sums import energies

NODES = 50_000
GAUSSIANS = 8_000
REACH = 0.15  # of the object's longest side: how far around its place a poke or hand acts
HAND_SPEED = 1.0  # [m/s], of planes and boxes
LONGEST_PULL = 0.6  # of the object's longest side
NOTHING = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Moved:
    """A boundary that a hand moves: where it is and where it is to go (3,) [m]."""

    now: np.ndarray
    wanted: np.ndarray


class Session:
    """One scene that runs.

    Args:
        scene: as `animate` takes it, its files named as they are found from here.
        objects: the Gaussians of each object.
        nodes: of the grid, at most; a finer one is made coarser.
        gaussians: of each object, at most.

    Raises:
        InputError: the scene cannot be built.

    Attributes:
        scene: as it is now, at its own size.
        playing: whether frames follow one another.
        message: what went wrong, in one line; empty: nothing.
        camera: that of a film's first picture.
    """

    _poking: Impulse  # of the frame to come, or of one before
    _pokes: tuple[Impulse, ...]  # all of them, as a scene lists them
    _hand: Hand
    _held: int | None  # the particle, in the solver's order

    def __init__(
        self,
        scene: Scene,
        objects: tuple[Gaussians, ...],
        *,
        nodes: int = NODES,
        gaussians: int = GAUSSIANS,
    ):
        validate(scene)
        self.scene, self._nodes = scene, nodes
        self.playing, self.message = False, ""
        self._failed, self._compiled, self._grabs = False, set[Any](), 0
        small = self._small(self.scene)
        self._placed = place_objects(small, objects, most=gaussians)
        self._begin()

    # --- what is to be seen -------------------------------------------------------------------

    @property
    def built(self) -> Built:
        """What runs, as it was built, without hands."""
        return self._built

    @property
    def small(self) -> Scene:
        """The scene at the size that runs."""
        return self._small(self.scene)

    @property
    def moment(self) -> Moment:
        """The present frame, and its sums."""
        return self._moment

    @property
    def frame(self) -> Frame:
        """The present frame, of what is drawn."""
        return self._moment.frame

    @property
    def compiles(self) -> bool:
        """Whether the next frame has to wait for a program."""
        return not self._failed and self._program not in self._compiled

    def shown(self) -> Shown:
        """What is to be drawn and told of the present frame; finite."""
        return Shown(
            number=self._moment.number,
            time=float(self._moment.frame.time),
            splats=self._splats,
            energies=self._energies,
            momentum=tuple(self._moment.metrics["momentum"]),
            held=self.held,
            grabs=self._grabs,
        )

    @property
    def held(self) -> Vector | None:
        """Where the grabbed particle is [m], None: nothing is held."""
        if self._held is None:
            return None
        x, y, z = np.asarray(self._state.position[:, self._held], np.float64).tolist()
        return x, y, z

    @property
    def movable(self) -> dict[int, Plane | Box]:
        """Planes and boxes at rest, by their place in the scene's list, where they are now."""
        listed = self.scene.boundaries
        return {i: _placed_at(listed[i], one.now) for i, one in self._moved.items()}

    def picture(self, camera: Camera) -> np.ndarray:
        """The present frame by our own renderer, as in a film, (H, W, 3) uint8."""
        look, frame = self._built.look, self.frame
        points = np.asarray(self._start)
        low, high = points.min(axis=0), points.max(axis=0)
        splats = frame_splats(look, frame, position(camera))
        needed = required_pairs(splats, camera, settings_for(camera))
        pixels, _ = picture(
            look,
            frame,
            camera,
            jnp.asarray((low + high)[:2] / 2),
            jnp.asarray(1.2 * float(np.max(high - low)), points.dtype),
            surroundings=surroundings_of(self.scene),
            capacity=next_capacity(int(needed)),
        )
        return np.asarray(pixels)

    def saved(self) -> Scene:
        """The scene as `animate` takes it: the numbers, the material and the boundaries' places as
        they are now, and the pokes so far, at their times. Numbers count from the start.
        """
        return replace(self.scene, boundaries=(*self.scene.boundaries, *self._pokes))

    # --- what is asked ------------------------------------------------------------------------

    def do(self, event: Event) -> None:
        """Carries out a command; what it cannot do is told in `message`, and changes nothing."""
        self.message = "" if not self._failed else self.message
        try:
            self._do(event)
        except InputError as error:
            self.message = str(error)

    def _do(self, event: Event) -> None:
        match event:
            case Play():
                self.playing = not self._failed
            case Pause():
                self.playing = False
            case Step():
                self.playing = False
                self.advance()
            case Reset():
                self._begin()
            case Poke():
                self._poke(event)
            case Grab():
                self._grab(event)
            case Drag():
                self._drag(np.asarray(event.place))
            case Release():
                self._hand, self._held = self._hand.released(), None
            case SetNumber():
                self._change(with_number(self.scene, event.key, event.value))
            case SetMaterial():
                self._change(with_material(self.scene, event.thing, event.material))
            case MoveBoundary():
                self._move(event.index, np.asarray(event.place, np.float64))
            case _:
                raise InputError(f"{type(event).__name__}: is nothing that a simulation does")

    def advance(self) -> None:
        """One frame on. One that fails is told in `message`: the frame before stays, until a
        reset."""
        if self._failed:
            return
        model = self._put(self._with_hands())
        state = retried(self._runs(), self._simulation.config, model, self._state)
        self._compiled.add(self._program)
        number = self._moment.number + 1
        try:
            check(state.status, number)
            self._arrive(model, state, number)
        except InputError as error:
            self.playing, self._failed = False, True
            self.message = f"{error}; reset to go on"
            return
        step = HAND_SPEED * self._frame_time
        for i, one in self._moved.items():
            self._moved[i] = replace(one, now=_towards(one.now, one.wanted, step))

    # --- building -----------------------------------------------------------------------------

    def _small(self, scene: Scene) -> Scene:
        # Steps adapt whatever the film's do: a slider must not make them unstable.
        scene = replace(scene, substep=None, unsafe_substep=False, stepping=Adaptive())
        return reduced(scene, self._nodes)

    def _build(self, scene: Scene) -> Built:
        """A scene at the size that runs. Gravity is part of its program even where it is zero: the
        slider goes there and comes back, and nothing begins anew."""
        simulation, look = build(self._small(scene), placed=self._placed)
        model = simulation.model
        if model.gravity is None:
            model = replace(model, gravity=jnp.zeros(3, model.mass.dtype))
        return Built(replace(simulation, model=model), look)

    def _begin(self) -> None:
        """At the start of the scene as it is now."""
        built = self._build(self.scene)
        self._built, self._simulation = built, built.simulation
        config, model, state = (
            built.simulation.config,
            built.simulation.model,
            built.simulation.state,
        )
        self._frame_time = self.small.seconds_per_frame
        self._setting = Setting(config.grid, state.position.T, model.volume, state.position.dtype)
        size = np.ptp(np.asarray(state.position), axis=1)
        self._size = float(size.max())
        self._reach = max(REACH * self._size, 2 * config.grid.spacing)
        reach = self._reach
        self._poking = Impulse(NOTHING, (reach, reach, reach), NOTHING).prepared(self._setting)
        self._hand = Hand().prepared(self._setting)
        self._held = None
        self._pokes = ()
        self._moved = {
            i: Moved(place, place)
            for i, one in enumerate(self.scene.boundaries)
            if (place := _place(one)) is not None
        }
        self._start_places = {i: one.now for i, one in self._moved.items()}
        first = built.simulation.frame(state, built.simulation.carriers)
        self._start = first.position
        self.camera = camera_of(self.small, built.look, first)
        self._eye = position(self.camera)
        self._failed, self.message, self._state = False, "", state
        self._arrive(self._put(self._with_hands()), self._put(state), 0)

    def _change(self, scene: Scene) -> None:
        """Other numbers from here on; another program begins anew."""
        # Boundaries are checked against the start, where those that moved since are not.
        began = list(scene.boundaries)
        for i, place in self._start_places.items():
            began[i] = _placed_at(began[i], place)
        built = self._build(replace(scene, boundaries=tuple(began)))
        self.scene = scene
        if _program_of(built.simulation) == self._program:
            self._built, self._simulation = built, built.simulation
        else:
            self._begin()

    @property
    def _program(self) -> tuple[Any, Any]:
        return _program_of(self._simulation)

    def _put(self, tree):
        """Where the devices want it, so that no frame is a program of its own."""
        placement = self._simulation.config.placement
        return jax.device_put(tree, placement.everywhere()) if placement.devices > 1 else tree

    def _runs(self) -> Simulation:
        """The simulation without what changes with its numbers and no program reads."""
        return replace(self._simulation, dt=self._frame_time, steps=1)

    def _with_hands(self) -> Model:
        """The model with what hands do in the frame to come."""
        model, time = self._simulation.model, self._time()
        boundaries = list(model.boundaries)
        for i, one in self._moved.items():
            step = HAND_SPEED * self._frame_time
            velocity = (_towards(one.now, one.wanted, step) - one.now) / self._frame_time
            changes = {"velocity": velocity, "start": time, _FIELD[boundaries[i].type]: one.now}
            boundaries[i] = boundaries[i].changed(**changes)
        return replace(model, boundaries=(*boundaries, self._poking, self._hand))

    def _time(self) -> float:
        return float(self._state.time)

    def _arrive(self, model: Model, state: State, number: int) -> None:
        simulation = replace(self._runs(), model=model)
        moment = moment_of(simulation, state, number, simulation.carriers)
        splats = jax.device_get(frame_splats(self._built.look, moment.frame, self._eye))
        if not all(np.isfinite(part).all() for part in splats):
            raise InputError(f"frame {number}: what is to be drawn is not finite; reset")
        self._state, self._moment, self._splats = state, moment, Splats(*splats)
        sums = jax.device_get(energies(simulation.config, model, state))
        self._energies = {name: float(value) for name, value in sums.items()}

    # --- hands --------------------------------------------------------------------------------

    def _met(self, origin: Vector, direction: Vector) -> int:
        """The particle, in the solver's order, that a ray meets."""
        points = np.asarray(self._state.position).T
        radius = 0.75 * self._simulation.config.grid.spacing
        particle = met(points, np.asarray(origin), np.asarray(direction), radius)
        if particle is None:
            raise InputError("nothing there: the ray passes all matter")
        return particle

    def _poke(self, poke: Poke) -> None:
        particle = self._met(poke.origin, poke.direction)
        along = np.asarray(poke.direction) / np.linalg.norm(poke.direction)
        # A region is one at rest: the matter that is here, where it was at the start.
        rest = np.asarray(self._simulation.state.position[:, particle], np.float64)
        chosen = self._setting.in_box(jnp.asarray(rest), jnp.full(3, self._reach))
        mass = float(jnp.sum(jnp.where(chosen, self._simulation.model.mass, 0)))
        force = mass * poke.speed / self._frame_time * along
        reach = self._reach
        made = Impulse(
            _vector(rest),
            (reach, reach, reach),
            _vector(force),
            start=self._time(),
            duration=self._frame_time,
        )
        # One a frame: another one before it takes the place of the first.
        earlier = tuple(one for one in self._pokes if one.start < made.start)
        self._poking, self._pokes = made.prepared(self._setting), (*earlier, made)

    def _grab(self, grab: Grab) -> None:
        particle = self._met(grab.origin, grab.direction)
        points = np.asarray(self._state.position).T
        self._hand = self._hand.holding(points, particle, self._reach)
        self._held, self._from = particle, points[particle].astype(np.float64)
        self._grabs += 1

    def _drag(self, place: np.ndarray) -> None:
        if self._held is None:
            return
        moved = place - self._from
        length = float(np.linalg.norm(moved))
        most = LONGEST_PULL * self._size
        if length > most:
            moved = moved * (most / length)
        self._hand = self._hand.changed(moved=moved)

    def _move(self, index: int, place: np.ndarray) -> None:
        if index not in self._moved:
            raise InputError(f"boundaries[{index}]: is no plane or box at rest; others stay")
        moved = _placed_at(self.scene.boundaries[index], place)
        listed = list(self.scene.boundaries)
        listed[index] = moved
        self.scene = replace(self.scene, boundaries=tuple(listed))
        self._moved[index] = replace(self._moved[index], wanted=place)


def _program_of(simulation: Simulation) -> tuple[Any, Any]:
    """What decides which program steps a simulation, beside shapes."""
    return simulation.config, jax.tree.structure(simulation.model)


_FIELD = {"plane": "point", "box": "centre"}


def _place(boundary: Boundary) -> np.ndarray | None:
    """Where a plane or box is that a hand may move, else None."""
    if not isinstance(boundary, Plane | Box):
        return None
    if any(boundary.velocity) or boundary.start != 0 or boundary.end != FOREVER:
        return None
    return np.asarray(getattr(boundary, _FIELD[boundary.type]), np.float64)


def _placed_at(boundary, place: np.ndarray):
    return replace(boundary, **{_FIELD[boundary.type]: _vector(place)})


def _towards(now: np.ndarray, wanted: np.ndarray, step: float) -> np.ndarray:
    """`wanted`, or as far on the way there as a step goes."""
    way = wanted - now
    length = float(np.linalg.norm(way))
    return wanted if length <= step else now + way * (step / length)


def _vector(array: np.ndarray) -> Vector:
    x, y, z = np.asarray(array, np.float64).tolist()
    return x, y, z

"""What a user may ask of the viewer, and the queue that carries it to the one thread that computes.

Callbacks of the browser run in threads of their own: they put events here and do nothing else.
"""

import threading
from collections.abc import Hashable
from dataclasses import dataclass

from jaxphys.mpm.boundaries import Vector


@dataclass(frozen=True)
class Play:
    """Frame after frame from here on."""


@dataclass(frozen=True)
class Pause:
    """Stand still."""


@dataclass(frozen=True)
class Step:
    """One frame."""


@dataclass(frozen=True)
class Reset:
    """Back to the start, with the numbers as they are now."""


@dataclass(frozen=True)
class Seek:
    """Of a finished run, show frame `number`."""

    number: int


@dataclass(frozen=True)
class Poke:
    """A push for one frame along a ray from `origin` [m] in `direction`, where it meets matter:
    what it pushes gets `speed` [m/s]."""

    origin: Vector
    direction: Vector
    speed: float


@dataclass(frozen=True)
class Grab:
    """Hold the matter that a ray meets."""

    origin: Vector
    direction: Vector


@dataclass(frozen=True)
class Drag:
    """Pull what is held to `place` [m]."""

    place: Vector


@dataclass(frozen=True)
class Release:
    """Let go."""


@dataclass(frozen=True)
class SetNumber:
    """Another number of the scene; `key` as `viewer.numbers` lists it."""

    key: str
    value: float


@dataclass(frozen=True)
class SetMaterial:
    """Make an object of something else; begins anew where that is another program."""

    thing: int
    material: str


@dataclass(frozen=True)
class MoveBoundary:
    """Bring a plane or box to `place` [m], as fast as hands move."""

    index: int
    place: Vector


@dataclass(frozen=True)
class SaveScene:
    """Hand the scene to the browser `client` as a file."""

    client: int


@dataclass(frozen=True)
class PlanFilm:
    """Tell what a film of the scene needs, at its own size."""


@dataclass(frozen=True)
class Picture:
    """The present frame by our own renderer, seen by the camera of the browser `client`."""

    client: int


Event = (
    Play
    | Pause
    | Step
    | Reset
    | Seek
    | Poke
    | Grab
    | Drag
    | Release
    | SetNumber
    | SetMaterial
    | MoveBoundary
    | SaveScene
    | PlanFilm
    | Picture
)


def _about(event: Event) -> Hashable:
    """What an event is about: of two that follow each other about the same, the last one counts."""
    match event:
        case SetNumber():
            return SetNumber, event.key
        case MoveBoundary():
            return MoveBoundary, event.index
        case Drag() | Seek():
            return (type(event),)
    return None


class Queue:
    """Events in the order in which they came. A slider or a hand that moves faster than frames are
    computed leaves its last place, not all of them."""

    def __init__(self) -> None:
        self._events: list[Event] = []
        self._came = threading.Condition()

    def put(self, event: Event) -> None:
        """From any thread."""
        with self._came:
            about = _about(event)
            if self._events and about is not None and _about(self._events[-1]) == about:
                self._events.pop()
            self._events.append(event)
            self._came.notify()

    def take(self, wait: float = 0.0) -> list[Event]:
        """All that came, after at most `wait` [s] where there is nothing."""
        with self._came:
            if not self._events and wait > 0:
                self._came.wait(wait)
            taken, self._events = self._events, []
        return taken

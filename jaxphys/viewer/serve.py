"""The viewer as a whole: one thread computes and shows, the browser's threads ask.

browser --events--> queue --> session --Shown--> window --> browser
"""

import io
import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.pipeline.plan import describe, make_plan, memory_text
from jaxphys.pipeline.replay import replay
from jaxphys.scene.json import to_json
from jaxphys.scene.obstacles import located, mesh_file, mesh_obstacles, with_sources
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import find, load_object
from jaxphys.viewer.events import (
    Event,
    Picture,
    PlanFilm,
    Queue,
    Reset,
    SaveScene,
    SetMaterial,
    Step,
)
from jaxphys.viewer.panel import Panel
from jaxphys.viewer.playback import Playback
from jaxphys.viewer.session import GAUSSIANS, NODES, Session
from jaxphys.viewer.window import Window

PATIENCE = 0.2  # [s] between looks at whether to stop, where nothing plays
FASTEST = 1 / 30  # [s] a frame
PICTURE = 800, 600
COMMAND = "jaxphys animate --config scene.json --out outputs/viewed"


def view_scene(
    scene: Scene,
    beside: Path | None = None,
    *,
    port: int = 0,
    nodes: int = NODES,
    gaussians: int = GAUSSIANS,
    tell: Callable[[str], None] = print,
    stop: Callable[[], bool] = lambda: False,
) -> None:
    """Shows a scene that runs, until `stop()`.

    Args:
        scene: as `animate` takes it, with sources.
        beside: where relative sources are looked up first.
        port: 0: a free one.
        nodes, gaussians: of the grid and of each object, at most.
        tell: gets the address.

    Raises:
        InputError: the scene cannot be built, or there is no viser or no port.
    """
    queue = Queue()
    window = Window(queue, port, "jaxphys view")  # first: what is missing is missing at once
    try:
        scene = rooted(scene, beside)
        objects = tuple(
            load_object(thing, None, scene.seed + i, f"objects[{i}]")
            for i, thing in enumerate(scene.objects)
        )
        session = Session(scene, objects, nodes=nodes, gaussians=gaussians)
        panel = window.panel = Panel(window.server, queue)
        panel.for_simulation(session.scene, COMMAND)
        panel.list_movable(session.movable)
        panel.tell_plan(plan_text(session))
        panel.tell_step(session.built.simulation.dt, session.built.simulation.steps)
        window.floor(scene.ground, scene.domain.size)
        window.clicks()
        _run(window, queue, session, scene.seconds_per_frame, tell, stop, _Keeper(window, session))
    finally:
        window.stop()


def rooted(scene: Scene, beside: Path | None) -> Scene:
    """The scene with the paths of its files as they are from anywhere, so that it may be saved
    anywhere; relative ones are looked up beside its file first.
    """
    objects = tuple(
        thing
        if thing.source is None
        else replace(thing, source=str(find(thing.source, beside).absolute()))
        for thing in scene.objects
    )
    scene = located(replace(scene, objects=objects), beside)
    meshes = {i: str(mesh_file(scene, i).absolute()) for i in mesh_obstacles(scene)}
    return with_sources(scene, meshes)


def view_run(
    directory: Path,
    *,
    port: int = 0,
    tell: Callable[[str], None] = print,
    stop: Callable[[], bool] = lambda: False,
) -> None:
    """Plays a finished run, until `stop()`. Arguments are those of `view_scene`.

    Raises:
        InputError: no finished run, or there is no viser or no port.
    """
    queue = Queue()
    window = Window(queue, port, f"jaxphys view {directory.name}")
    try:
        playback = Playback(replay(directory, progress=True))
        window.panel = Panel(window.server, queue, frames=playback.count)
        window.floor(playback.scene.ground, playback.scene.domain.size)
        seconds = 1 / playback.scene.fps
        _run(window, queue, playback, seconds, tell, stop, lambda event: False)
    finally:
        window.stop()


def plan_text(session: Session) -> str:
    """What runs here, before it does: sizes, steps and memory."""
    plan = describe(session.small, session.built)
    grid = " x ".join(map(str, plan.grid))
    lines = [
        f"**here**: {plan.particles} particles, grid {grid}; steps adapt, from {plan.substep:.2e} s"
        f" on, limited by {plan.reason}",
        memory_text(plan),
    ]
    return "\n\n".join(lines)


def film_text(scene: Scene) -> str:
    """What `animate` takes for the film of a scene, with the time on this machine."""
    plan = make_plan(scene, measure=True)
    assert plan.seconds is not None
    grid = " x ".join(map(str, plan.grid))
    total = sum(plan.seconds.values())
    parts = ", ".join(f"{name} {seconds:.0f} s" for name, seconds in plan.seconds.items())
    lines = [
        f"**the film**: {plan.particles} particles, grid {grid}",
        f"step {plan.substep:.2e} s; {plan.steps} steps in {plan.frames} frames",
        memory_text(plan),
        f"time, roughly: {total:.0f} s ({parts})",
    ]
    return "\n\n".join(lines)


class _Keeper:
    """Carries out what is kept: files, plans and pictures."""

    def __init__(self, window: Window, session: Session):
        self._window, self._session = window, session

    def __call__(self, event: Event) -> bool:
        """Whether the event was for it."""
        session, window, panel = self._session, self._window, self._window.panel
        assert panel is not None
        match event:
            case SaveScene():
                text = json.dumps(to_json(session.saved()), indent=2, sort_keys=True) + "\n"
                window.hand_over(event.client, "scene.json", text.encode())
            case PlanFilm():
                panel.tell("measuring a second of each stage of the film", session.playing)
                panel.tell_plan(f"{plan_text(session)}\n\n{film_text(session.saved())}")
            case Picture():
                pixels = session.picture(window.camera_of(event.client, *PICTURE))
                panel.show_picture(pixels)
                window.hand_over(event.client, "picture.png", _png(pixels))
            case _:
                return False
        return True


def _run(
    window: Window,
    queue: Queue,
    session: Session | Playback,
    seconds: float,
    tell: Callable[[str], None],
    stop: Callable[[], bool],
    keep: Callable[[Event], bool],
) -> None:
    """The one thread that computes."""
    panel = window.panel
    assert panel is not None
    shown = session.shown()
    window.stand(session.camera, np.asarray(shown.splats.means))
    window.show(shown)
    panel.tell(session.message, session.playing)
    tell(window.address)
    due = time.monotonic()
    while not stop():
        wait = due - time.monotonic() if session.playing else PATIENCE
        events = queue.take(max(wait, 0.0))
        for event in events:
            _carry_out(event, session, panel, keep)
        if session.playing and time.monotonic() >= due:
            due = time.monotonic() + max(seconds, FASTEST)
            _announce(session, panel)
            session.advance()
        elif not events:
            continue
        window.show(session.shown())
        panel.tell(session.message, session.playing)


def _carry_out(
    event: Event, session: Session | Playback, panel: Panel, keep: Callable[[Event], bool]
) -> None:
    try:
        if keep(event):
            return
    except InputError as error:
        session.message = str(error)
        return
    if isinstance(event, Step):
        _announce(session, panel)
    session.do(event)
    if not isinstance(session, Session):
        return
    panel.tell_step(session.built.simulation.dt, session.built.simulation.steps)
    if isinstance(event, SetMaterial):
        panel.list_numbers(session.scene)
        panel.tell_plan(plan_text(session))
    if isinstance(event, SetMaterial | Reset):
        panel.list_movable(session.movable)


def _announce(session: Session | Playback, panel: Panel) -> None:
    """Says why nothing moves for some seconds, where that is so."""
    if isinstance(session, Session) and session.compiles:
        panel.tell("compiling the program of this material; some seconds, once", session.playing)


def _png(pixels: np.ndarray) -> bytes:
    made = io.BytesIO()
    iio.imwrite(made, pixels, extension=".png")
    return made.getvalue()

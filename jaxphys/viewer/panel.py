"""The panel beside the scene: buttons, sliders, curves. Callbacks only put events in the queue."""

import math
from typing import Any

import numpy as np

from jaxphys.mpm.boundaries import Box, Plane, Vector
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.scene.scene import Scene
from jaxphys.viewer.events import (
    MoveBoundary,
    Pause,
    Picture,
    PlanFilm,
    Play,
    Queue,
    Release,
    Reset,
    SaveScene,
    Seek,
    SetMaterial,
    SetNumber,
    Step,
)
from jaxphys.viewer.numbers import Number, numbers_of

COLOURS = ("#d62728", "#1f77b4", "#2ca02c")
PLATE = (0.8, 0.8, 0.004)  # [m], for a plane
UNTURNED = (1.0, 0.0, 0.0, 0.0)
HELP = (
    "Drag to orbit, scroll to zoom. **Click the object** to poke it, or to grab it and pull by "
    "the arrows that come up. Planes and boxes move by their arrows."
)


class Panel:
    """Of a simulation, or of a film where `frames` says how many it has."""

    def __init__(self, server: Any, queue: Queue, *, frames: int | None = None):
        self._gui, self._scene, self._queue = server.gui, server.scene, queue
        self._message = self._gui.add_markdown("")
        self._at = self._gui.add_markdown("")
        self._playing = False
        self._play = self._gui.add_button("Play")
        self._play.on_click(lambda _: queue.put(Pause() if self._playing else Play()))
        self._gui.add_button("Step").on_click(lambda _: queue.put(Step()))
        self._gui.add_button("Reset").on_click(lambda _: queue.put(Reset()))
        self._seek = None
        if frames is not None:
            self._seek = self._gui.add_slider("frame", 0, max(frames - 1, 1), 1, 0)
            self._seek.on_update(self._sought)
        self._sliders: list[Any] = []
        self._curves: list[Any] = []
        self._gizmos: dict[int, Any] = {}

    # --- a simulation's ------------------------------------------------------------------------

    def for_simulation(self, scene: Scene, command: str) -> None:
        """Adds what a simulation has beyond a film."""
        gui, queue = self._gui, self._queue
        gui.add_markdown(HELP)
        self._click = gui.add_dropdown("a click", ("pokes", "grabs"))
        self._speed = gui.add_slider("poke [m/s]", 0.1, 8.0, 0.1, 2.0)
        gui.add_button("Let go").on_click(lambda _: queue.put(Release()))
        self._numbers = gui.add_folder("Material and numbers")
        self.list_numbers(scene)
        with gui.add_folder("Energy and momentum", expand_by_default=False):
            self._curves_of(("kinetic", "elastic", "gravity"), "energy [J]")
            self._curves_of(("x", "y", "z"), "momentum [kg m/s]")
        with gui.add_folder("What it takes"):
            self._step = gui.add_markdown("")
            self._plan = gui.add_markdown("")
            self._film = gui.add_button("Plan the film")
            self._film.on_click(lambda _: queue.put(PlanFilm()))
        with gui.add_folder("Keep it"):
            save = gui.add_button("Save scene")
            save.on_click(lambda event: queue.put(SaveScene(event.client_id)))
            self._command = gui.add_text("command", command, disabled=False)
            draw = gui.add_button("Exact picture")
            draw.on_click(lambda event: queue.put(Picture(event.client_id)))
            self._picture: Any = None

    def list_numbers(self, scene: Scene) -> None:
        """Sliders of the scene as it is now, in place of those that are there."""
        for one in self._sliders:
            one.remove()
        self._sliders = []
        with self._numbers:
            for i, thing in enumerate(scene.objects):
                chosen = self._gui.add_dropdown(
                    f"object {i}", tuple(MATERIALS), initial_value=thing.material
                )
                chosen.on_update(
                    lambda event, i=i: self._queue.put(SetMaterial(i, event.target.value))
                )
                self._sliders.append(chosen)
            for number in numbers_of(scene):
                self._sliders.append(self._slider(number))

    def _slider(self, number: Number) -> Any:
        unit = f" [{number.unit}]" if number.unit else ""
        low, high, value = number.low, number.high, number.value
        label = f"{number.label}{unit}"
        if number.logarithmic:
            low, high, value = (math.log10(part) for part in (low, high, value))
            label = f"log10 {label}"
        step = max((high - low) / 200, 1e-9)
        made = self._gui.add_slider(label, low, high, step, min(max(value, low), high))

        def moved(event) -> None:
            there = float(event.target.value)
            if number.logarithmic:
                there = 10**there
            self._queue.put(SetNumber(number.key, there))

        made.on_update(moved)
        return made

    def list_movable(self, boundaries: dict[int, Plane | Box]) -> None:
        """Arrows at the planes and boxes that hands may move, by their place in the scene's list:
        each where it is now."""
        for one in self._gizmos.values():
            one.remove()
        self._gizmos = {}
        for i, boundary in boundaries.items():
            name = f"/boundaries/{i}"
            if isinstance(boundary, Plane):
                place, sides, turn = boundary.point, PLATE, upright(boundary.normal)
            else:
                x, y, z = boundary.half_size
                place, sides, turn = boundary.centre, (2 * x, 2 * y, 2 * z), UNTURNED
            made = self._scene.add_transform_controls(
                name, scale=0.25, disable_rotations=True, depth_test=False, position=place
            )
            self._scene.add_box(
                f"{name}/shape", (90, 120, 160), sides, opacity=0.25, wxyz=turn, cast_shadow=False
            )

            def moved(event, i=i) -> None:
                x, y, z = np.asarray(event.target.position, np.float64).tolist()
                self._queue.put(MoveBoundary(i, (x, y, z)))

            made.on_update(moved)
            self._gizmos[i] = made

    @property
    def grabs(self) -> bool:
        """Whether a click grabs, not pokes."""
        return self._click.value == "grabs"

    @property
    def poke_speed(self) -> float:
        """[m/s]."""
        return float(self._speed.value)

    # --- what is told --------------------------------------------------------------------------

    def tell(self, message: str, playing: bool) -> None:
        """One line of what went wrong, and whether it plays."""
        # As code: what a file is called must not become markup.
        text = f"`{message.replace('`', chr(39))}`" if message else ""
        if self._message.content != text:
            self._message.content = text
        if playing != self._playing:
            self._playing = playing
            self._play.label = "Pause" if playing else "Play"

    def tell_frame(self, number: int, time: float) -> None:
        """Which frame is shown, at which time [s]."""
        self._at.content = f"frame {number}, {time:.3f} s"
        if self._seek is not None and int(self._seek.value) != number:
            self._seek.value = number

    def tell_plan(self, text: str) -> None:
        """What running takes, as Markdown."""
        self._plan.content = text

    def tell_step(self, dt: float, steps: int) -> None:
        """The step [s] that the numbers allow at the start, and how many make a frame."""
        self._step.content = f"step {dt:.2e} s, {steps} a frame"

    def show_picture(self, pixels: np.ndarray) -> None:
        """A picture of our own renderer, (H, W, 3) uint8."""
        if self._picture is None:
            self._picture = self._gui.add_image(pixels, label="exact picture", format="png")
        else:
            self._picture.image = pixels

    def draw_curves(self, rows: np.ndarray, energies: int) -> None:
        """Columns of time, energies and momentum, (7, T); finite."""
        time, parts = rows[0], (rows[1 : 1 + energies], rows[1 + energies :])
        for plot, values in zip(self._curves, parts, strict=True):
            plot.data = (time, *values)

    def _curves_of(self, names: tuple[str, ...], title: str) -> None:
        from viser import uplot

        series = [uplot.Series(label="s")]
        series += [
            uplot.Series(label=name, stroke=colour, width=2)
            for name, colour in zip(names, COLOURS, strict=True)
        ]
        start = tuple(np.zeros(1) for _ in series)
        self._curves.append(
            self._gui.add_uplot(
                start,
                tuple(series),
                title=title,
                scales={"x": uplot.Scale(time=False, auto=True)},
                aspect=1.6,
            )
        )

    def _sought(self, event) -> None:
        # What the film itself sets is no wish of a user's.
        if event.client is not None:
            self._queue.put(Seek(int(event.target.value)))


def upright(normal: Vector) -> tuple[float, float, float, float]:
    """The quaternion w, x, y, z that turns z to a direction of any length but zero."""
    x, y, z = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    if z < -1 + 1e-9:
        return 0.0, 1.0, 0.0, 0.0
    half = np.array([1 + z, -y, x, 0.0])
    w, a, b, c = (half / np.linalg.norm(half)).tolist()
    return w, a, b, c

"""The browser's side: what is seen, and what is clicked. It computes nothing.

Callbacks run in threads of the server, and only put events into the queue.
"""

import contextlib
import io
import math
from collections import deque
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.core.splats import Splats
from jaxphys.mpm.boundaries import Vector
from jaxphys.render.camera import Camera
from jaxphys.scene.scene import Ground
from jaxphys.viewer.events import Drag, Grab, Poke, Queue
from jaxphys.viewer.panel import Panel
from jaxphys.viewer.shown import Shown

HOST = "127.0.0.1"  # and nothing else: whoever reaches the viewer commands it
FIELD = math.radians(40)  # of view, from top to bottom
ROOM = 1.3  # of the object's size, from the middle of the view to its end
KEPT = 400  # frames that curves show
ARROWS, AHEAD = 0.3, 0.4  # of the object's size: a hand's arrows, and how far before the matter
CLAMPED = 1e4  # of a variance in units of the node, of 6.5e4 that half precision holds


class Window:
    """A server on this machine alone, and what its browsers show.

    Args:
        queue: gets what users ask for.
        port: of the server; 0: a free one.
        title: of the page.

    Raises:
        InputError: viser is not installed, or the port cannot be had.
    """

    def __init__(self, queue: Queue, port: int, title: str):
        try:
            import viser
        except ImportError:
            raise InputError(
                "the viewer needs viser: pip install 'jaxphys-splats[viewer]'"
            ) from None
        try:
            with quietly():
                self.server: Any = viser.ViserServer(HOST, port, label=title, verbose=False)
        except OSError as error:
            raise InputError(f"--port: {port} cannot be had ({error.strerror})") from None
        self._queue = queue
        self.server.gui.configure_theme(
            control_layout="fixed", show_logo=False, show_share_button=False
        )
        self.server.scene.set_up_direction("+z")
        self._splats: Any = None
        self._hand: Any = None
        self._grab: int | None = None
        self._size = 1.0  # of the object [m]
        self._ahead = np.zeros(3)  # from the matter that is held to the arrows [m]
        self._enlarged = 1.0
        self._curves: deque[tuple[float, ...]] = deque(maxlen=KEPT)
        self._last: int | None = None
        self.panel: Panel | None = None

    @property
    def address(self) -> str:
        """Where to look."""
        return f"http://{HOST}:{self.server.get_port()}"

    def stop(self) -> None:
        """Closes the server."""
        with quietly():
            self.server.stop()

    # --- the scene ----------------------------------------------------------------------------

    def stand(self, camera: Camera, points: np.ndarray) -> None:
        """Lets browsers that come look from where a camera looks from, at points (N, 3) [m] and
        what is around them: a film's camera leaves no room for what hands do."""
        low, high = np.quantile(points, [0.01, 0.99], axis=0)
        middle, size = (low + high) / 2, float(np.max(high - low))
        forward = np.asarray(camera.rotation, np.float64)[2]
        self._size = size
        first = self.server.initial_camera
        first.look_at = middle
        first.position = middle - max(ROOM * size / math.tan(FIELD / 2), 1e-3) * forward
        first.fov = FIELD

    def floor(self, ground: Ground | None, size: Vector) -> None:
        """Draws the floor of a scene's domain."""
        if ground is None:
            return
        thickness = 0.01
        self.server.scene.add_box(
            "/floor",
            color=tuple(round(255 * part) for part in ground.colour),
            dimensions=(size[0], size[1], thickness),
            position=(size[0] / 2, size[1] / 2, ground.height - thickness / 2),
            cast_shadow=False,
        )

    def clicks(self) -> None:
        """Listens to clicks on the scene: pokes or grabs, as the panel says."""

        @self.server.scene.on_click()
        def _(event) -> None:
            panel = self.panel
            if panel is None:
                return
            if panel.grabs:
                along = np.asarray(event.ray_direction, np.float64)
                self._ahead = -AHEAD * self._size * along / np.linalg.norm(along)
                self._queue.put(Grab(event.ray_origin, event.ray_direction))
            else:
                self._queue.put(Poke(event.ray_origin, event.ray_direction, panel.poke_speed))

    def show(self, shown: Shown) -> None:
        """Draws a frame, at once."""
        with self.server.atomic():
            self._draw(shown.splats)
            self._draw_hand(shown)
            if self.panel is not None:
                self._trace(shown)
                self.panel.tell_frame(shown.number, shown.time)
        self.server.flush()

    def _draw(self, splats: Splats) -> None:
        if self._splats is None:
            # Covariances travel in half precision: in units in which most are about 1.
            typical = np.sqrt(np.median(np.trace(splats.covariances, axis1=1, axis2=2) / 3))
            self._enlarged = 1 / max(float(typical), 1e-6)
        larger = self._enlarged
        # Variances of what is far larger than most are cut, where half precision would overflow.
        centres = larger * np.asarray(splats.means, np.float32)
        covariances = np.clip(
            larger**2 * np.asarray(splats.covariances, np.float64), -CLAMPED, CLAMPED
        ).astype(np.float32)
        colours = np.clip(splats.colours, 0, 1).astype(np.float32)
        opacities = np.asarray(splats.opacities, np.float32)[:, None]
        if self._splats is None:
            self._splats = self.server.scene.add_gaussian_splats(
                "/splats", centres, covariances, colours, opacities, scale=1 / larger
            )
        else:
            self._splats.set_gaussians(centres, covariances, colours, opacities)

    def _draw_hand(self, shown: Shown) -> None:
        """Arrows before the place where matter was grabbed, until it is let go: at the place
        itself splats would hide them.
        """
        wanted = None if shown.held is None else shown.grabs
        if wanted == self._grab:
            return
        if self._hand is not None:
            self._hand.remove()
            self._hand = None
        self._grab = wanted
        if shown.held is None:
            return
        ahead = self._ahead
        self._hand = self.server.scene.add_transform_controls(
            "/hand",
            scale=ARROWS * self._size,
            disable_rotations=True,
            depth_test=True,  # viser draws splats last, over what leaves no depth
            position=_vector(np.asarray(shown.held) + ahead),
        )

        @self._hand.on_update
        def _(event) -> None:
            self._queue.put(Drag(_vector(event.target.position - ahead)))

    # --- the panel's curves -------------------------------------------------------------------

    def _trace(self, shown: Shown) -> None:
        if not shown.energies or shown.momentum is None or shown.number == self._last:
            return
        if self._last is None or shown.number < self._last:
            self._curves.clear()
        self._last = shown.number
        row = (shown.time, *shown.energies.values(), *shown.momentum)
        if np.isfinite(row).all():  # what is not would take all curves from the screen
            self._curves.append(row)
        assert self.panel is not None
        self.panel.draw_curves(np.array(self._curves).T, len(shown.energies))

    # --- cameras ------------------------------------------------------------------------------

    def camera_of(self, client: int, width: int, height: int) -> Camera:
        """The camera of a browser, for a picture of so many pixels.

        Raises:
            InputError: the browser has gone.
        """
        found = self.server.get_clients().get(client)
        if found is None:
            raise InputError("the browser that asked has gone")
        seen = found.camera
        # From the camera's axes, x right and y down, to the world's.
        outwards = np.asarray(quaternion_to_matrix(jnp.asarray(seen.wxyz)[None]))[0]
        focal = 0.5 * height / np.tan(0.5 * seen.fov)
        return Camera(
            rotation=jnp.asarray(outwards.T),
            translation=jnp.asarray(-outwards.T @ np.asarray(seen.position)),
            focal=jnp.full(2, focal),
            centre=jnp.array([width / 2, height / 2]),
            width=width,
            height=height,
        )

    def hand_over(self, client: int, name: str, content: bytes) -> None:
        """Lets a browser save a file."""
        found = self.server.get_clients().get(client)
        if found is not None:
            found.send_file_download(name, content)


def quietly() -> contextlib.AbstractContextManager:
    """Viser says that it starts and stops on standard output, which is the command's."""
    return contextlib.redirect_stdout(io.StringIO())


def _vector(array: np.ndarray) -> Vector:
    x, y, z = np.asarray(array, np.float64).tolist()
    return x, y, z

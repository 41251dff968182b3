"""Splats and a camera in, a picture out."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from jaxphys.core.ensemble import over_devices
from jaxphys.core.errors import InputError
from jaxphys.core.splats import Splats
from jaxphys.render.binning import MOST_PAIRS, UNCOUNTABLE, make_grid, tile_boxes, tile_lists
from jaxphys.render.blending import blend
from jaxphys.render.camera import Camera
from jaxphys.render.projection import project
from jaxphys.render.settings import Settings

DEFAULT = Settings()


class Image(NamedTuple):
    """A picture.

    Attributes:
        colour: over the background, shape (H, W, C).
        alpha: how much of the background is hidden, in [0, 1], shape (H, W).
        depth: sum of w_i z_i [m], shape (H, W); see `mean_depth`. None without `Settings.depth`.
        required: pairs of tile and splat that this picture needs, int32 ().
        overflow: whether that was more than the capacity, so that far splats are missing, bool ().
    """

    colour: Array
    alpha: Array
    depth: Array | None
    required: Array
    overflow: Array


def render(
    splats: Splats,
    camera: Camera,
    *,
    background=0.0,
    settings: Settings = DEFAULT,
    capacity: int | None = None,
) -> Image:
    """Draws splats.

    Exact: every splat contributes wherever its alpha is at least `alpha_min`, in order of depth.
    Differentiable (reverse mode) with respect to the splats, the background and all arrays of the
    camera. Splats with a number that is not finite or beyond 1e12 are left out and get zero
    gradient (`jaxphys.render.usable` tells which).

    Args:
        splats: N splats with C colour channels; N may be 0.
        camera: see `Camera`. For several cameras of one size, `jax.lax.map` over a camera with
            stacked arrays draws one after another; `jax.vmap` works too, in lockstep.
        background: a number, (C,) or (H, W, C).
        settings: conventions; static.
        capacity: pairs of tile and splat to make room for; static. None, outside `jax.jit`, counts
            them first and takes the next power of two; it can also be had from `required_pairs`.
            Inside `jax.jit` it must be given, and `Image.overflow` be looked at.

    Raises:
        InputError: shapes that do not fit, or capacity None inside `jax.jit`.
    """
    _check(splats, camera, background)
    background = jnp.asarray(background, splats.colours.dtype)
    if capacity is not None:
        if capacity < 1:
            raise InputError(f"capacity = {capacity}: must be at least 1")
        return _render(splats, camera, background, settings, int(capacity))
    room = next_capacity(_concrete(required_pairs(splats, camera, settings)))
    while True:
        image = _render(splats, camera, background, settings, room)
        # The two programs may round a bound differently, hence the second look.
        if not _concrete(image.overflow):
            return image
        room = next_capacity(room + 1)


@partial(jax.jit, static_argnames=("settings",))
def required_pairs(splats: Splats, camera: Camera, settings: Settings = DEFAULT) -> Array:
    """Pairs of tile and splat that a picture needs, int32 (); 2^31 - 1 where more than 2^30."""
    if splats.means.shape[0] == 0:
        return jnp.int32(0)
    projected = project(splats, camera, settings)
    grid = make_grid(camera.width, camera.height, settings)
    each = [tile_boxes(projected, grid, settings, k).required for k in range(grid.share)]
    return _required_together(jnp.stack(each))


def _required_together(each: Array) -> Array:
    """Room that all need who share a picture, each having as much of it, from what each needs."""
    most = jnp.max(each)
    countable = most <= MOST_PAIRS // each.shape[0]
    return jnp.where(countable, most * each.shape[0], UNCOUNTABLE)


def next_capacity(required: int) -> int:
    """The next power of two, at least 256, so that few programs are compiled.

    Raises:
        InputError: more than 2^30 pairs.
    """
    if required > MOST_PAIRS:
        raise InputError(
            f"the picture needs more than {MOST_PAIRS} pairs of tile and splat: draw fewer or "
            "smaller splats, or use a larger tile_size"
        )
    return max(256, 1 << (int(required) - 1).bit_length()) if required else 256


def mean_depth(image: Image) -> Array:
    """Depth averaged over what is seen, sum w z / sum w [m], shape (H, W); 0 where nothing is.

    Raises `InputError` if the picture was drawn without depth.
    """
    if image.depth is None:
        raise InputError("mean_depth: the picture has no depth; give Settings(depth=True)")
    seen = image.alpha > 1e-6
    return jnp.where(seen, image.depth / jnp.where(seen, image.alpha, 1), 0)


@partial(jax.jit, static_argnames=("settings", "capacity"))
def _render(splats, camera, background, settings, capacity) -> Image:
    height, width = camera.height, camera.width
    dtype = splats.means.dtype
    if splats.means.shape[0] == 0:
        colour = jnp.broadcast_to(background, (height, width, splats.colours.shape[1]))
        empty = jnp.zeros((height, width), dtype)
        depth = empty if settings.depth else None
        return Image(colour, empty, depth, jnp.int32(0), jnp.bool_(False))

    grid = make_grid(width, height, settings)
    projected = project(splats, camera, settings)
    valid = projected.valid
    depths = [jnp.where(valid, projected.depths, 0)[None]] if settings.depth else []
    features = jnp.concatenate(
        [jnp.where(valid, splats.colours.T, 0), *depths, jnp.ones((1, valid.shape[0]), dtype)]
    )
    own_capacity = -(-capacity // grid.share)

    def own_tiles(first: Array) -> tuple[Array, Array]:
        return _tiles(projected, features, first, grid, settings, own_capacity)

    if grid.share == 1:
        tiles, required = own_tiles(jnp.int32(0))
    else:
        share = over_devices(own_tiles, grid.share)
        tiles, each = share(jnp.arange(grid.share, dtype=jnp.int32))
        required = _required_together(each)
    size = grid.tile_size
    picture = tiles.reshape(grid.share, grid.own_rows, grid.columns, -1, size, size)
    picture = picture.transpose(1, 0, 4, 2, 5, 3)
    picture = picture.reshape(-1, grid.columns * size, picture.shape[-1])[:height, :width]
    channels = splats.colours.shape[1]
    colour, alpha = picture[..., :channels], picture[..., -1]
    depth = picture[..., channels] if settings.depth else None
    colour = colour + (1 - alpha)[..., None] * background
    return Image(colour, alpha, depth, required, required > grid.share * own_capacity)


def _tiles(projected, features, first, grid, settings, capacity) -> tuple[Array, Array]:
    """Blended features of own tiles (tiles, F, tile_size^2), and the pairs that they need."""
    boxes = tile_boxes(projected, grid, settings, first)
    frozen = jax.tree.map(lax.stop_gradient, projected)
    lists = tile_lists(frozen, boxes, grid, settings, capacity)
    geometry = jnp.concatenate([projected.centres, projected.factors, projected.opacities[None]])
    return blend(geometry, features, boxes, lists, grid, settings), boxes.required


def _concrete(value: Array):
    """The number behind `value`, also under `jax.grad`; not inside `jax.jit`."""
    try:
        return np.asarray(lax.stop_gradient(value)).item()
    except (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError) as error:
        raise InputError(
            "render inside jax.jit, jax.vmap or jax.lax.map: give capacity=, for example "
            "next_capacity(required_pairs(...)) from outside"
        ) from error


def _check(splats: Splats, camera: Camera, background) -> None:
    count = splats.means.shape[0]
    channels = splats.colours.shape[-1]
    expected = ((count, 3), (count, 3, 3), (count,), (count, channels))
    for name, array, wanted in zip(Splats._fields, splats, expected, strict=True):
        if array.shape != wanted:
            raise InputError(f"splats.{name} has shape {array.shape}, expected {wanted}")
    shape = jnp.shape(background)
    allowed = ((), (channels,), (1,), (camera.height, camera.width, channels))
    if shape not in allowed:
        raise InputError(
            f"background has shape {shape}, expected ({channels},) or "
            f"({camera.height}, {camera.width}, {channels})"
        )

"""Coloured surfaces as a few latent vectors, and back: a distance and a colour at any place.

A transformer over the blocks of a cube. An encoder's token reads the oriented coloured points of
its block as small cells; a decoder's writes its block's part of a finer grid of features, and what
lies between eight cells is read off them by a small perceptron. The result is a continuous surface
without scatter. (Latents that read whole clouds by attention, as 3DShape2VecSet's, must learn first
where they are: with the same computation they stayed at blobs.)
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.guidance.bundled.adaptive import (
    NormalisedAttention,
    SquaredPerceptron,
    TrainableLinear,
    normalise,
    spread,
)

READ = 10  # of a cell: whether it holds points, their mean offset, normal and colour


@dataclass(frozen=True)
class AutoencoderConfig:
    """Sizes of the network and the frame of its field, lengths in object lengths.

    side: blocks a side of the cube; cells: cells a side of a block; features: of a cell.
    half: half the side of the cube, which holds all there is and a little around it.
    thickness: half of what thin sheets are given, and by how much every surface is raised, so that
    whatever has a surface has an inside. reach: distances are told up to this.
    """

    width: int = 192
    side: int = 4
    channels: int = 32
    cells: int = 10
    features: int = 8
    head_width: int = 64
    hidden: int = 512
    reading: int = 2
    writing: int = 3
    answer: int = 64
    half: float = 0.54
    thickness: float = 0.006
    reach: float = 0.1
    dtype: str = "float32"

    @property
    def latents(self) -> int:
        return self.side**3

    @property
    def grid(self) -> int:
        """Cells a side of the cube."""
        return self.side * self.cells


class Field(NamedTuple):
    """distance: (B, Q) signed, negative inside, zero at `thickness` outside the true surface,
    within +- `reach`; colour: (B, Q, 3) in [0, 1]."""

    distance: Array
    colour: Array


class Layer(nnx.Module):
    """Pre-norm transformer layer."""

    def __init__(self, width: int, head_width: int, hidden: int, *, rngs: nnx.Rngs):
        heads = width // head_width
        self.attention = NormalisedAttention(width, width, heads, head_width, rngs=rngs)
        self.perceptron = SquaredPerceptron(width, hidden, width, rngs=rngs)

    def __call__(self, x: Array) -> Array:
        inner = normalise(x)
        x = x + self.attention(inner, inner)
        return x + self.perceptron(normalise(x))


class ShapeAutoencoder(nnx.Module):
    """`encode` clouds to latents (B, latents, channels) of unit mean square, `decode` them."""

    def __init__(self, config: AutoencoderConfig, *, rngs: nnx.Rngs):
        self.config = config
        width, block = config.width, config.cells**3

        def layers(count: int) -> nnx.List:
            made = (Layer(width, config.head_width, config.hidden, rngs=rngs) for _ in range(count))
            return nnx.List(made)

        def places() -> nnx.Param:
            return nnx.Param(jax.random.normal(rngs.params(), (config.latents, width)))

        self.embed, self.read_place = TrainableLinear(READ * block, width, rngs=rngs), places()
        self.read = layers(config.reading)
        self.narrow = TrainableLinear(width, config.channels, rngs=rngs)
        self.widen, self.write_place = TrainableLinear(config.channels, width, rngs=rngs), places()
        self.write = layers(config.writing)
        self.unfolded = TrainableLinear(width, config.features * block, rngs=rngs)
        self.output = SquaredPerceptron(config.features, config.answer, 4, rngs=rngs, zero=True)

    def _placed(self, x: Array, place: nnx.Param) -> Array:
        rows = spread(place[...].astype(x.dtype).reshape(1, -1), x.shape[0])
        return x + rows.reshape(x.shape)

    def _in_cells(self, points: Array) -> Array:
        """Places of the object frame in units of cells, from 0 to `grid`."""
        return (points + self.config.half) * (self.config.grid / (2 * self.config.half))

    def _cells(self, points: Array, normals: Array, colours: Array) -> Array:
        """What the cells hold: (B, latents, READ cells^3), block by block."""
        side, cells, grid = self.config.side, self.config.cells, self.config.grid
        at = self._in_cells(points)
        cell = jnp.clip(jnp.floor(at), 0, grid - 1)
        x, y, z = jnp.moveaxis(cell.astype(jnp.int32), -1, 0)
        one = jnp.ones_like(points[..., :1])
        held = jnp.concatenate([one, at - cell - 0.5, normals, 2 * colours - 1], -1)
        batch = jnp.broadcast_to(jnp.arange(points.shape[0])[:, None], x.shape)
        total = jnp.zeros((points.shape[0], grid**3, READ), points.dtype)
        total = total.at[batch, (x * grid + y) * grid + z].add(held)
        mean = total / jnp.maximum(total[..., :1], 1)
        blocks = mean.reshape(-1, side, cells, side, cells, side, cells, READ)
        blocks = blocks.transpose(0, 1, 3, 5, 2, 4, 6, 7)
        return blocks.reshape(-1, side**3, READ * cells**3)

    def encode(self, points: Array, normals: Array, colours: Array) -> Array:
        """Latents (B, latents, channels) of clouds (B, N, 3): points in the object frame, outward
        unit normals (zeros if unknown), colours in [0, 1]. The order of points does not matter."""
        held = self._cells(points, normals, colours).astype(jnp.dtype(self.config.dtype))
        x = self._placed(4.0 * self.embed(held), self.read_place)
        for layer in self.read:
            x = layer(x)
        return normalise(self.narrow(normalise(x))).astype(points.dtype)

    def unfold(self, latents: Array) -> Array:
        """What places read: features (B, grid^3, features). Once for any number of `field`s."""
        side, cells = self.config.side, self.config.cells
        x = self.widen(latents.astype(jnp.dtype(self.config.dtype)))
        x = self._placed(x, self.write_place)
        for layer in self.write:
            x = layer(x)
        blocks = self.unfolded(normalise(x)).astype(latents.dtype)
        blocks = blocks.reshape(-1, side, side, side, cells, cells, cells, self.config.features)
        blocks = blocks.transpose(0, 1, 4, 2, 5, 3, 6, 7)
        return blocks.reshape(-1, self.config.grid**3, self.config.features)

    def _between(self, features: Array, places: Array) -> Array:
        """Trilinear mean (B, Q, features) of the eight cells around places (B, Q, 3)."""
        grid = self.config.grid
        at = jnp.clip(self._in_cells(places) - 0.5, 0.0, grid - 1.0)
        low = jnp.clip(jnp.floor(at), 0, grid - 2)
        part = at - low
        x, y, z = jnp.moveaxis(low.astype(jnp.int32), -1, 0)
        mixed = jnp.zeros((*places.shape[:2], self.config.features), places.dtype)
        for i in (0, 1):
            for j in (0, 1):
                for k in (0, 1):
                    row = ((x + i) * grid + y + j) * grid + z + k
                    near = jnp.abs(jnp.array([1 - i, 1 - j, 1 - k]) - part).prod(-1, keepdims=True)
                    mixed += near * jnp.take_along_axis(features, row[..., None], axis=1)
        return mixed

    def field(self, features: Array, places: Array) -> Field:
        """The field at places (B, Q, 3) of the object frame, of features that `unfold` gave."""
        mixed = self._between(features, places)
        # Four of the features are the answer to begin with, and the perceptron what they lack.
        found = mixed[..., :4] + self.output(mixed)
        distance = self.config.reach * jnp.tanh(found[..., 0])
        return Field(distance, jax.nn.sigmoid(2.0 * found[..., 1:]))

    def decode(self, latents: Array, places: Array) -> Field:
        """`field` of `unfold`."""
        return self.field(self.unfold(latents), places)

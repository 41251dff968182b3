"""Where particles are computed: in which chunks, on which devices."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from jaxphys.core.errors import InputError

AXIS = "particles"  # of the mesh
EVERYWHERE, APART = PartitionSpec(), PartitionSpec(AXIS)  # as a whole; along the first axis
PARTICLE_BYTES = 256  # of the state and of a pass's temporaries that a particle keeps in the cache
STATE_BYTES = 400  # of a state in float32 and of the next one, a particle
LEAST = {"cpu": 4_000}  # particles on each device, below which meeting costs more than it saves
LEAST_ELSEWHERE = 50_000
WHOLE_CHUNKS = 4  # as many on one device are computed as a whole


@dataclass(frozen=True)
class Placement:
    """How the particles of a step are spread. Part of the program.

    Attributes:
        devices: how many; the first ones of `jax.devices()`.
        chunk: particles that are computed together, at most; None for all that a device has. Chunks
            that stay in the cache are what makes a processor fast; an accelerator wants one.
    """

    devices: int = 1
    chunk: int | None = None

    def __post_init__(self):
        if self.devices < 1:
            raise InputError(f"Placement.devices is {self.devices}: give at least 1.")
        if self.chunk is not None and self.chunk < 1:
            raise InputError(
                f"Placement.chunk is {self.chunk}: give at least 1 particle, or None for all."
            )

    def mesh(self) -> Mesh:
        """The devices, along one axis.

        Raises:
            InputError: there are fewer.
        """
        return _mesh(self.devices)

    def everywhere(self) -> NamedSharding:
        """Where arrays lie that every device has as a whole, as a state between two frames."""
        return NamedSharding(self.mesh(), EVERYWHERE)


@dataclass(frozen=True)
class Slabs:
    """How the grid is spread, where each device has a slab of it across x. Part of the program.

    planes: nodes along x of every slab.
    bands: nodes along x that a device exchanges with the next one on either side, with the one
        after that, and so on. Those further away share no node with it.
    """

    planes: int
    bands: tuple[int, ...]

    def __post_init__(self):
        if not self.bands or min(self.bands) < 1 or self.planes < max(self.bands):
            raise InputError(
                f"Slabs.bands is {self.bands}: give at least one, each from 1 to the slab's "
                f"{self.planes} planes."
            )


@cache
def _mesh(count: int) -> Mesh:
    found = jax.devices()
    if count > len(found):
        raise InputError(
            f"Placement.devices is {count}, but JAX has {len(found)} {found[0].platform} "
            "device(s); for more on a processor, call "
            f"jax.config.update('jax_num_cpu_devices', {count}) before anything else of JAX."
        )
    return Mesh(np.array(found[:count]), (AXIS,))


def spread(
    placement: Placement,
    function: Callable,
    reduce: Callable,
    common=EVERYWHERE,
    results=EVERYWHERE,
) -> Callable:
    """`function(common, own) -> (common results, own results)` over the devices: each has its share
    of the chunks of `own`, along their first axis, and `reduce` makes one of their common results.

    common, results: where parts of the common arguments and results are not `EVERYWHERE`, a
    pytree's first levels that tell it.
    """
    if placement.devices == 1:
        return function

    def on_each(common, own):
        results, own = function(common, own)
        return reduce(results), own

    return jax.shard_map(
        on_each,
        mesh=placement.mesh(),
        in_specs=(common, APART),
        out_specs=(results, APART),
        check_vma=False,
    )


def gathered(placement: Placement, own: Any) -> Any:
    """Arrays that the devices share along their first axis, as a whole on each of them.

    Said as what it is: left to itself XLA adds up arrays that are zero but for a device's part.
    """
    if placement.devices == 1:
        return own
    return jax.shard_map(
        lambda tree: jax.tree.map(lambda x: jax.lax.all_gather(x, AXIS, tiled=True), tree),
        mesh=placement.mesh(),
        in_specs=APART,
        out_specs=EVERYWHERE,
        check_vma=False,
    )(own)


def suited(particles: int, devices: int | None = None) -> Placement:
    """The placement that suits this machine.

    As many devices as have enough to do, and on a processor chunks that stay in a core's second
    cache. One device alone computes arrays as a whole while they are a few such chunks: all cores
    work on these, and one on a chunk. (The last cache says nothing: a rented machine has a share of
    it that nobody tells.)

    Args:
        particles: how many.
        devices: at most so many; None: as many as there are.

    Raises:
        InputError: one of them has no room for the state, which each of them has as a whole.
    """
    platform = jax.default_backend()
    least = LEAST.get(platform, LEAST_ELSEWHERE)
    there = jax.device_count() if devices is None else devices
    used = max(1, min(there, particles // least))
    check_memory(jax.devices()[:used], particles)
    if platform != "cpu":
        return Placement(used)
    chunk = max(1024, second_cache_bytes() // PARTICLE_BYTES)
    whole = used == 1 and particles <= WHOLE_CHUNKS * chunk
    return Placement(used, None if whole else chunk)


def check_memory(devices: list, particles: int) -> None:
    """Raises `InputError` that names the first device that cannot hold `particles`: the smallest
    decides, since all have equal shares and the whole state. What does not tell its memory passes.
    """
    needed = particles * STATE_BYTES
    for device in devices:
        limit = (device.memory_stats() or {}).get("bytes_limit")
        if limit is not None and limit < needed:
            raise InputError(
                f"{particles} particles need {needed / 1e9:.3g} GB on every device, but {device} "
                f"has {limit / 1e9:.3g}: take fewer particles, or leave the device out "
                "(CUDA_VISIBLE_DEVICES)."
            )


@cache
def second_cache_bytes() -> int:
    """Size of a core's second cache in bytes; a usual one if unknown."""
    for folder in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*"):
        try:
            if int((folder / "level").read_text()) == 2:
                return int((folder / "size").read_text().strip().removesuffix("K")) * 1024
        except (OSError, ValueError):
            continue  # told otherwise on this machine
    return 2**20

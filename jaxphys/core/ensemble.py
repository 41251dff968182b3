"""Many independent computations side by side: sweeps, ensembles, views."""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, PartitionSpec

from jaxphys.core.errors import InputError

AXIS = "members"


def over_devices(
    function: Callable, devices: int | None = None, *, in_turn: bool = False
) -> Callable:
    """`function` of one member as a function of many, each device computing its share of them.

    Arguments and results get a leading axis, as with `jax.vmap`; any number of members does, and
    gradients go through. `function` must use one device itself (`Placement(devices=1)`).

        ends = jaxphys.over_devices(lambda E: simulate_with(E).position)(moduli)

    What is the same for all members may be closed over, traced or not; gradients reach it too.

    Args:
        function: of pytrees of arrays.
        devices: how many, the first ones; None: all.
        in_turn: whether a device takes its members one after the other, instead of all of them in
            lockstep. For what has loops of its own that end when they are done, as pictures have.

    Raises:
        InputError: there are fewer devices, or arguments disagree about the number of members.
    """
    found = jax.devices()
    count = len(found) if devices is None else devices
    if not 1 <= count <= len(found):
        raise InputError(f"over_devices: {count} devices, but JAX has {len(found)}")
    mesh = Mesh(np.array(found[:count]), (AXIS,))
    spec = PartitionSpec(AXIS)

    def each(*arguments: Any) -> Any:
        if all(leaf.shape[0] == 1 for leaf in jax.tree.leaves(arguments)):
            alone = function(*jax.tree.map(lambda x: x[0], arguments))
            return jax.tree.map(lambda x: jnp.asarray(x)[None], alone)
        if in_turn:
            return jax.lax.map(lambda member: function(*member), arguments)
        return jax.vmap(function)(*arguments)

    def of_many(*arguments: Any) -> Any:
        sizes = {jnp.shape(leaf)[:1] for leaf in jax.tree.leaves(arguments)}
        if len(sizes) != 1 or sizes == {()}:
            raise InputError(
                "over_devices: every argument needs the same leading axis, one entry a member; "
                f"leading axes are {sorted(sizes)}"
            )
        ((members,),) = sizes
        # What is left over repeats the last member, on devices that would have waited.
        places = jnp.minimum(jnp.arange(count * math.ceil(members / count)), members - 1)
        filled = jax.tree.map(lambda x: jnp.asarray(x)[places], arguments)
        share = jax.shard_map(each, mesh=mesh, in_specs=spec, out_specs=spec, check_vma=False)
        return jax.tree.map(lambda x: x[:members], share(*filled))

    return jax.jit(of_many)

"""Against volumetric locking: the stress at a volume that neighbours share (F-bar; de Souza Neto et
al. 1996, Zhao, Jiang and Choo 2023).

Each pass, a particle tells the grid m (J - 1) beside its momentum, and the next pass gathers the
mean by mass, Jm, at the place and time to which it belongs; then F takes its step, and the stress
is that of

    (Jm / J)^(1/3) F',    whose volume is Jm J' / J,

J' being that of F'. What the step itself changed is thus the particle's own and the mean is of the
volumes before it, so that a step needs no second pass over particles and grid. Waves long beside a
cell see no difference; for shorter ones the step's own share is a damping of changes of volume,
which is what bounds the step (`stepping.bounds.LAGGED`).

F itself, and with it J, stays what it is: a mean that was carried on would be averaged again in
every step, and spread ever further. Where densities differ, so do weights.
"""

from dataclasses import replace
from functools import cache

import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.law import Law, Parameters


@cache
def at_mean_volume(law: Law) -> Law:
    """An elastic law whose stress is that of (Jm / J)^(1/3) F, its history being log(Jm / J), which
    the loop writes, with Jm the mean of J around the particle. It begins at zero: in the first step
    each particle has its own volume.

    There is no energy whose derivative that stress is, since Jm depends on others.

    Raises:
        InputError: the law is plastic or remembers.
    """
    if law.plastic or law.history:
        raise InputError(
            f"mean_volume: the law {law.name!r} flows or remembers; the mean is for elastic ones"
        )

    def update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
        _, stress, _ = law.update(parameters, jnp.exp(history[0] / 3) * F_trial, history[:0], dt)
        return F_trial, stress, history

    return replace(
        law,
        name=f"{law.name} at the mean volume",
        history=(0.0,),
        history_names=("log_volume_ratio",),
        update=update,
        energy=None,
        shares_volume=True,
        without=tuple((name, at_mean_volume(simpler)) for name, simpler in law.without),
    )

"""Against volumetric locking: the stress at a volume that neighbours share (F-bar; de Souza Neto et
al. 1996, Zhao, Jiang and Choo 2023), the part of it that one particle sees.

The other part is an average over the grid once a step, which writes the history's row: no loop does
that yet, so that no material offers such a law.
"""

from dataclasses import replace

import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.law import Law, Parameters


def at_mean_volume(law: Law) -> Law:
    """An elastic law whose stress is that of (Jm / J)^(1/3) F, its history being log(Jm / J) with
    Jm the mean of J around the particle. F itself, and with it J, stays what it is: an average that
    was carried on would be averaged again in every step, and spread ever further.

    There is no energy whose derivative that stress is, since Jm depends on others.

    Raises:
        InputError: the law is plastic or remembers.
    """
    if law.plastic or law.history:
        raise InputError(f"at_mean_volume: {law.name} is no elastic law; give one")

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
    )

"""What a particle alone does, written down again in numpy: the reference of most cases.

A particle that shares its nodes with no other sees an affine velocity field, which APIC transfers
exactly. What is left of the method (Hu et al. 2018, with the force of that one particle) is

    C <- C - dt (4 / dx^2) tau(F) / rho,   F <- (I + dt C) F,   x <- x + dt v,

whatever its place, its speed and the grid. Particles at one and the same place, strained alike, are
such a particle too. The steps are those that were taken, so that only rounding may differ.
"""

import numpy as np


def lame(E, nu):
    """mu and lambda [Pa], of arrays."""
    return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))


def _spread(values):
    return np.asarray(values)[..., None, None] * np.eye(3)


def neo_hookean(F, mu, lam):
    """mu (F F^T - I) + lambda log(J) I (Bonet and Wood 2008, eq. 6.29), (N, 3, 3) [Pa]."""
    B = F @ np.swapaxes(F, 1, 2)
    return mu[:, None, None] * (B - np.eye(3)) + _spread(lam * np.log(np.linalg.det(F)))


def fixed_corotated(F, mu, lam):
    """2 mu (F - R) F^T + lambda (J - 1) J I (Stomakhin et al. 2012, eq. 8), (N, 3, 3) [Pa]."""
    U, _, V = np.linalg.svd(F)
    J = np.linalg.det(F)
    return 2 * mu[:, None, None] * (F - U @ V) @ np.swapaxes(F, 1, 2) + _spread(lam * (J - 1) * J)


def hencky(F, mu, lam):
    """U (2 mu e + lambda tr(e)) U^T with e = log of the singular values, (N, 3, 3) [Pa]."""
    U, s, _ = np.linalg.svd(F)
    e = np.log(s)
    tau = 2 * mu[:, None] * e + (lam * e.sum(axis=1))[:, None]
    return (U * tau[:, None, :]) @ np.swapaxes(U, 1, 2)


STRESSES = {"neo-Hookean": neo_hookean, "fixed corotated": fixed_corotated, "Hencky": hencky}


def march(stress, F, C, lengths, *, E, nu, density, spacing):
    """(F, C), each (N, 3, 3), after steps of `lengths` [s], in float64."""
    mu, lam = lame(np.asarray(E, np.float64), np.asarray(nu, np.float64))
    pull = 4 / (spacing**2 * np.asarray(density, np.float64))
    for dt in np.asarray(lengths, np.float64):
        C = C - dt * pull[:, None, None] * stress(F, mu, lam)
        F = F + dt * C @ F
    return F, C

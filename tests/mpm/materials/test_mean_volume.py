import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.mpm.materials.plasticity import VON_MISES

NUMBERS = {"youngs_modulus": 1e4, "poisson_ratio": 0.4999}


def test_particles_that_breathe_against_each_other_share_one_pressure():
    """Hencky's pressure is that of the mean volume, its deviator that of the particle."""
    random = np.random.default_rng(0)
    F = jnp.asarray(np.eye(3)[..., None] + 0.02 * random.normal(size=(3, 3, 40)))
    J = np.linalg.det(np.moveaxis(np.asarray(F), -1, 0))
    mean = J.mean()
    law = at_mean_volume(HENCKY)
    values = law.prepare({name: jnp.full(40, number) for name, number in NUMBERS.items()})
    kept, tau, ratio = law.update(values, F, jnp.log(mean / J)[None], 1e-3)
    np.testing.assert_array_equal(kept, F)
    np.testing.assert_allclose(ratio[0], np.log(mean / J))
    bulk = 1e4 / (3 * (1 - 2 * 0.4999))
    pressure = -np.trace(np.asarray(tau)) / 3
    np.testing.assert_allclose(pressure, -bulk * np.log(mean), rtol=1e-6)
    _, plain, _ = HENCKY.update(values, F, jnp.zeros((0, 40)), 1e-3)
    assert np.std(np.trace(np.asarray(plain)) / 3) > 100 * abs(bulk * np.log(mean)) / 40
    deviators = [np.asarray(t) - np.trace(t) / 3 * np.eye(3)[..., None] for t in (tau, plain)]
    np.testing.assert_allclose(*deviators, atol=1e-4)


def test_only_of_what_is_elastic():
    with pytest.raises(InputError, match="the law 'von Mises' flows or remembers"):
        at_mean_volume(VON_MISES)

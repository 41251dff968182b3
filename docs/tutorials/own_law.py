# %% [markdown]
# # A law of one's own
#
# An energy is enough: stress, wave speeds, the bound on the time step, scene files, `jaxphys
# plan` and gradients follow. Here: Gent's rubber, which stretches easily and then locks.

# %%
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxphys
from jaxphys.gaussians import from_points

G = jaxphys.Parameter("gum_shear", "shear modulus at rest", "Pa")
K = jaxphys.Parameter("gum_bulk", "bulk modulus", "Pa")
LIMIT = jaxphys.Parameter("locking", "sum of s^2 - 1 at which it is stretched out", "")


def gent(p, s):  # energy [J/m^3] of the principal stretches s (3, ...): Gent (1996)
    J = s[0] * s[1] * s[2]
    pulled = (jnp.sum(s**2, axis=0) * J ** (-2 / 3) - 3) / p["locking"]
    chains = -p["gum_shear"] * p["locking"] * jnp.log1p(-jnp.minimum(pulled, 0.99))
    return 0.5 * (chains + p["gum_bulk"] * (0.5 * (J**2 - 1) - jnp.log(J)))


law = jaxphys.law_of_stretches("Gent", (G, K, LIMIT), gent)
jaxphys.register_material(
    "gum", law, "rubber that locks", gum_shear=2e4, gum_bulk=8e4, locking=3.0, density=900.0
)

# %% [markdown]
# `register_material` has run it: a stress that is not symmetric, or disagrees with the energy, or
# a slope that is not finite at rest is refused with the number.
#
# ## What it does
#
# Pulled along one axis at constant volume, beside a rubber that does not lock. The stress comes
# from the law itself.


# %%
def pulled(locking, stretch):
    parameters = {"gum_shear": 2e4, "gum_bulk": 8e4, "locking": locking, "density": 900.0}
    parameters = {name: jnp.asarray(value) for name, value in parameters.items()}
    F = jnp.diag(jnp.array([stretch, stretch**-0.5, stretch**-0.5]))
    _, stress, _ = law.update(law.prepare(parameters), F, None, jnp.asarray(1e-4))
    return stress[0, 0] - stress[1, 1]


stretches = np.linspace(0.7, 1.9, 60)
for locking in (3.0, 1000.0):
    stress = jax.vmap(lambda s, locking=locking: pulled(locking, s))(stretches)
    plt.plot(stretches, np.asarray(stress) / 1e3, label=f"locking at {locking:g}")
plt.xlabel("stretch")
plt.ylabel("stress difference [kPa]")
plt.legend()
plt.show()

# %% [markdown]
# For small strains both are Hooke's law with this shear modulus: the slope at rest of the stress
# difference is three times it.

# %%
slope = jax.grad(lambda s: pulled(3.0, s))(1.0)
print(f"{slope:.1f} Pa, and 3 G = {3 * 2e4:.1f} Pa")
assert abs(slope / 6e4 - 1) < 1e-3

# %% [markdown]
# ## In a scene
#
# By its name, like any other material; gradients by its own parameters are there as well.

# %%
random = np.random.default_rng(1)
points = random.normal(size=(500, 3))
points *= 0.3 / np.linalg.norm(points, axis=1, keepdims=True)
ball = from_points(points, (0.3, 0.5, 0.8), 0.03)

scene = jaxphys.default_scene("gum", spacing=0.12)
simulation, look = jaxphys.build(scene, ball)


@jax.jit
def flattest(shear):
    """How flat the ball gets in half a second [m]."""
    changed = simulation.with_(gum_shear=shear, velocity=(0.0, 0.0, -3.0))
    motion = jaxphys.rollout_frames(changed, 12, adjoint=jaxphys.Checkpointed())
    heights = motion.position[:, : look.counts[0], 2]
    return -jax.nn.logsumexp(-40 * (heights.max(1) - heights.min(1))) / 40


value, by_shear = jax.value_and_grad(flattest)(2e4)
print(f"flattest about {value:.3f} m; {by_shear * 1e4:+.4f} m for each 10 kPa more")

# %%
difference = (flattest(2.2e4) - flattest(1.8e4)) / 4e3
print(f"by difference {difference * 1e4:+.4f} m")
assert by_shear > 0 and abs(by_shear / difference - 1) < 0.3

# %% [markdown]
# With `return_map=` a law yields, with `history=` it remembers:
# [materials](../materials.md#a-law-of-ones-own).

# %% [markdown]
# # From a video to a material
#
# Somebody filmed a strawberry-red ball that was thrown onto a table: one camera, no markers,
# nothing known of the throw. How soft is it?
#
# The film is made here, by numbers that the fit does not see, and spoiled as a phone would:
# compressed, with noise in every pixel.

# %%
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxphys
from jaxphys.fitting import Bounded, Free, Images, Log
from jaxphys.gaussians import from_points

FRAMES, RATE = 10, 24  # pictures, and pictures a second
random = np.random.default_rng(0)
points = random.normal(size=(600, 3))
points *= 0.3 / np.linalg.norm(points, axis=1, keepdims=True)
stripes = np.where(np.sin(14 * points[:, 2:]) > 0, [[0.85, 0.15, 0.2]], [[0.95, 0.75, 0.5]])
ball = from_points(points, stripes, 0.03)

scene = jaxphys.default_scene("jelly", spacing=0.15)
simulation, look = jaxphys.build(scene, ball)
camera = jaxphys.orbit((1.25, 1.25, 0.8), 3.0, -1.0, 0.2, width=64, height=48)


def film(simulation):
    motion = jax.jit(lambda s: jaxphys.rollout_frames(s, FRAMES))(simulation).check()
    options = {"background": 1.0, "capacity": 1 << 16}
    pictures = [jaxphys.draw(look, motion[t], camera, **options) for t in range(FRAMES)]
    return np.clip([np.asarray(picture.colour) for picture in pictures], 0, 1)


secret = simulation.with_(youngs_modulus=3.2e4, poisson_ratio=0.37, velocity=(0.5, -0.2, -2.5))
seen = film(secret)
seen = np.round(255 * np.clip(seen + random.normal(0, 0.02, seen.shape), 0, 1)) / 255


def strip(*films):
    figure, axes = plt.subplots(len(films), 5, figsize=(10, 1.7 * len(films)), squeeze=False)
    for row, pictures in zip(axes, films, strict=True):
        for axis, index in zip(row, np.linspace(0, FRAMES - 1, 5).astype(int), strict=True):
            axis.imshow(pictures[index])
            axis.set_axis_off()
    figure.tight_layout()


strip(seen)

# %% [markdown]
# ## The fit
#
# What is free gets a start that need not be near, and a kind: stiffness is searched by its
# logarithm, Poisson's ratio stays in its bounds. What was observed is the film with the noise
# that we expect in a pixel. Everything else (the throw first, then the material; how many steps
# each trial needs) is [decided and told](../fitting.md).

# %%
fit = jaxphys.fit(
    simulation,
    look=look,
    free={
        "youngs_modulus": Log(1e4),
        "poisson_ratio": Bounded(0.3, 0.05, 0.48),
        "velocity": Free((0.0, 0.0, -1.0)),
    },
    observed=Images(seen, camera, times=np.arange(FRAMES) / RATE, noise=0.02),
)
print(fit)

# %% [markdown]
# True were 32,000 Pa, 0.37 and (0.5, -0.2, -2.5) m/s. The intervals say how sure this film makes
# us: a direction that it does not determine would be named `undetermined`, without a number.
#
# ## Is it the right motion?
#
# Below the film that was seen, and the one that the fitted numbers make.

# %%
again = film(fit.simulation)
strip(seen, again)
print(f"root mean square difference of a pixel: {np.sqrt(np.mean((seen - again) ** 2)):.3f}")

# %%
assert abs(np.log(fit.values["youngs_modulus"] / 3.2e4)) < 0.1
assert np.allclose(fit.values["velocity"], (0.5, -0.2, -2.5), atol=0.06)

# %% [markdown]
# ## The gradient alone
#
# The same loss is a function that you can hand to any other search, or differentiate yourself.


# %%
@jax.jit
@jax.value_and_grad
def loss(log_stiffness):
    changed = fit.simulation.with_(youngs_modulus=jnp.exp(log_stiffness))
    motion = jaxphys.rollout_frames(changed, FRAMES, adjoint=jaxphys.Checkpointed())
    picture = jaxphys.draw(look, motion[-1], camera, background=1.0, capacity=1 << 16)
    return jnp.mean((picture.colour - seen[-1]) ** 2)


for stiffness in (1e4, 3.2e4, 1e5):
    value, slope = loss(jnp.log(stiffness))
    print(f"{stiffness:8.0f} Pa: loss {value:.5f}, slope {slope:+.5f} for each e-fold")

# %% [markdown]
# Too soft, and more stiffness lowers the loss; too stiff, and it raises it. From a file, the same
# is `jaxphys fit CONFIG.json --out DIR` ([fitting](../fitting.md)).

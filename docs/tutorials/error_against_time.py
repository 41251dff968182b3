# %% [markdown]
# # Error against run time
#
# How right is a motion, and what does it cost to make it twice as right? First on a problem whose
# answer is known, then on a scene of one's own, whose answer nobody knows.

# %%
import time
from dataclasses import replace

import jax
import matplotlib.pyplot as plt
import numpy as np

import jaxphys
from jaxphys.problems.catalogue import PROBLEMS
from jaxphys.problems.discrete import solve

jax.config.update("jax_enable_x64", True)
problem = PROBLEMS["free-bar"]
print(problem.source)

cells, errors, seconds = (8, 16, 32), [], []
for count in cells:
    posed = problem.build(count, "float64")
    solve(posed)  # compiles
    start = time.perf_counter()
    end = jax.block_until_ready(solve(posed))
    seconds.append(time.perf_counter() - start)
    errors.append(problem.norm(posed, end))
    print(f"{count:3} cells: error {errors[-1]:.2e} in {1e3 * seconds[-1]:.0f} ms")

plt.loglog(seconds, errors, "o-")
plt.xlabel("run time [s]")
plt.ylabel("relative error of the displacement")
plt.show()

# %% [markdown]
# The order that this shows beside the one that theory gives:

# %%
orders = np.diff(np.log(errors)) / np.log(0.5)
print("observed", np.round(orders, 2), "expected", problem.order)
assert np.all(np.abs(orders - problem.order) < 0.4)

# %% [markdown]
# Twice the cells are twice the particles here (the bar grows along one axis alone) and twice the
# steps; in a full 3D scene they are eight times the particles.
#
# ## A scene of one's own
#
# Nobody knows its answer, but three coarse runs of the scene itself show how fast they come
# closer to each other (Richardson). `plan_for` makes them and chooses the grid; `jaxphys animate
# --tolerance 0.01` is the same on the command line, and refuses with the reason where no order
# shows.

# %%
from jaxphys.gaussians import from_points  # noqa: E402

jax.config.update("jax_enable_x64", False)
random = np.random.default_rng(1)
points = random.normal(size=(500, 3))
points *= 0.5 / np.linalg.norm(points, axis=1, keepdims=True)
ball = from_points(points, (0.8, 0.5, 0.3), 0.05)
scene = replace(jaxphys.default_scene("elastic"), frames=6)
plan = jaxphys.plan_for(scene, (ball,), 0.01)
print(f"spacing {plan.choice.spacing:.3f} m, expected error {plan.choice.error:.3f}")
print(f"{plan.steps} steps, about {plan.seconds:.0f} s on this machine")

# %% [markdown]
# What stands behind it, and how often it was right: [the check on scenes that it was not made
# on](../benchmarks/tolerance.md). Choosing by hand: [grid, step, material, transfer,
# dtype](../choosing.md).

# %% [markdown]
# # From a sentence to a motion
#
# `jaxphys generate` does it in one command. Here the same in steps, small, and with the
# parametric library for the object, which takes a second; without `prior="library"` the bundled
# diffusion priors make it, in a minute or two.

# %%
import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import jaxphys

here = Path(tempfile.mkdtemp())
scene = jaxphys.default_scene("jelly", spacing=0.1)
scene = replace(scene, frames=20, width=240, height=136)
prompt = "a red teapot with a long spout"
jaxphys.generate(prompt, scene, here / "teapot", prior="library", splats=4000)
print(*sorted(path.name for path in (here / "teapot").iterdir()), sep="\n")

# %%
plt.figure(figsize=(10, 5))
plt.imshow(Image.open(here / "teapot" / "contact_sheet.png"))
plt.axis("off")
plt.show()

# %% [markdown]
# ## The same object, another material
#
# The object that was made is a file like any other. Metal keeps what jelly gives back.

# %%
teapot = jaxphys.load(here / "teapot")
for material in ("jelly", "metal"):
    scene = replace(jaxphys.default_scene(material, spacing=0.12), frames=12)
    simulation, look = jaxphys.build(scene, teapot)
    simulation = simulation.with_(velocity=(0.0, 0.0, -6.0))
    motion = jaxphys.rollout_frames(simulation, scene.frames).check()
    heights = np.asarray(motion.position)[:, : look.counts[0], 2]
    tall = np.ptp(heights, axis=1)
    print(f"{material:6} {tall[0]:.2f} m tall at first, {tall.min():.2f} m at the least")

# %% [markdown]
# What the words mean, which prior reads them and what it knows: `jaxphys priors`, [published
# models](../published.md), [how a prompt is refined](../refiners.md).

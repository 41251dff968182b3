"""Building a scene is mostly compiling: how many programs that takes, from nothing."""

import subprocess
import sys

COUNT = """
import jax, jaxphys
from jaxphys.pipeline.plan import ball

found = []

def note(name, seconds, **more):
    if name.endswith("backend_compile_duration"):
        found.append(name)

jax.monitoring.register_event_duration_secs_listener(note)
jaxphys.build(jaxphys.default_scene("jelly"), ball(500))
print(len(found))
"""


def test_building_a_scene_compiles_few_programs():
    # 148 once, each some 40 ms however small: every operation on its own array was one.
    done = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True, check=True)
    assert 10 < int(done.stdout.split()[-1]) < 60

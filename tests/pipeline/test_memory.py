"""What a run needs of memory: refused before anything is made, and near what a process takes."""

import json
import subprocess
import sys
from dataclasses import replace
from importlib import import_module

import pytest

from jaxphys.core.errors import InputError
from jaxphys.pipeline.memory import at_least, expected, require_room, room
from jaxphys.pipeline.plan import as_text, ball, describe
from jaxphys.scene import Domain, Object, Scene
from jaxphys.scene.build import build

module = import_module("jaxphys.pipeline.animate")


def scene(**changes):
    thing = Object(material="jelly", size=0.4, centre=(0.5, 0.5, 0.5), filling=None)
    small = Scene(
        objects=(thing,),
        domain=Domain((1.0, 1.0, 1.0), 1 / 24),
        frames=3,
        frame_time=2e-4,
        width=160,
        height=90,
    )
    return replace(small, **changes)


def test_what_does_not_fit_is_refused_with_the_numbers():
    needed = {"program": 10**9, "motion": 5 * 10**9, "splats": 2 * 10**9}
    require_room(needed, 8 * 10**9)
    require_room(needed, None)  # nobody knows
    with pytest.raises(InputError, match=r"about 8 GB .*motion 5, splats 2.* 7\.9: .*fewer frames"):
        require_room(needed, int(7.9e9))


def test_a_scene_that_does_not_fit_is_refused_before_anything_is_made(tmp_path, monkeypatch):
    free = room()
    assert free is None or free > 10**8
    called = []
    monkeypatch.setattr(module, "build", lambda *made: called.append(made))
    monkeypatch.setattr(module, "room", lambda: 10**9)
    # 40,000 Gaussians for a thousand frames: 1.9 GB of where they are.
    with pytest.raises(InputError, match=r"most of it motion 1\.92, .*there are 1: .*fewer frames"):
        module.animate(scene(frames=1000), tmp_path / "run", objects=(ball(40_000),))
    assert not called and not (tmp_path / "run").exists()


def test_more_of_each_takes_more_of_what_it_is():
    asked = scene()
    made = build(asked, ball(500))
    needed = expected(asked, made)
    longer = expected(replace(asked, frames=30), made)
    wider = expected(replace(asked, width=320), made)
    assert longer["motion"] == 10 * needed["motion"] and wider["pictures"] == 2 * needed["pictures"]
    finer = expected(asked, build(asked, ball(1000)))
    assert finer["state and parameters"] > 1.8 * needed["state and parameters"]
    assert all(size <= needed[name] for name, size in at_least(asked, (ball(500),)).items())
    plan = describe(asked, made)
    assert f"memory at the peak: {sum(needed.values()) / 2**20:.0f} MiB" in as_text(plan)
    assert "does not fit" in as_text(replace(plan, room=10**6))
    assert "does not fit" not in as_text(replace(plan, room=None))


def test_what_takes_no_part_needs_no_room():
    """Faint splats are in nobody's memory; of a crop nobody knows yet; what stands still is drawn,
    and its motion not kept.
    """
    asked, things = scene(), (ball(500),)
    (thing,) = asked.objects
    whole = at_least(asked, things)

    def of(**changes):
        return at_least(replace(asked, objects=(replace(thing, **changes),)), things)

    assert whole["motion"] > 0 and of(opacity_threshold=0.99)["splats"] == 0
    assert of(crop=True)["motion"] == of(crop=True)["splats"] == 0
    half = replace(asked, objects=(replace(thing, area=(-1.0, 1.0, -1.0, 1.0, 0.0, 1.0)),))
    assert at_least(half, things)["motion"] == 0
    assert at_least(half, things)["splats"] == whole["splats"]
    made = build(half, *things)
    needed = expected(half, made)
    assert needed["splats"] == whole["splats"] and needed["motion"] == whole["motion"] / 2


PEAK = """
import json, resource, sys
from pathlib import Path
from jaxphys.pipeline.animate import animate
from jaxphys.pipeline.memory import expected
from jaxphys.pipeline.plan import ball
from jaxphys.scene.build import build
from tests.pipeline.test_memory import scene
count, frames, width, height = map(int, sys.argv[1:5])
asked = scene(frames=frames, width=width, height=height).filmed()
animate(asked, Path(sys.argv[5]) / "run", objects=(ball(count),))
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
print(json.dumps([peak, sum(expected(asked, build(asked, ball(count))).values())]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("size", [(4_000, 3, 160, 90), (100_000, 3, 640, 360)])
def test_a_fresh_process_takes_about_what_is_expected(tmp_path, size):
    command = [sys.executable, "-c", PEAK, *map(str, size), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    peak, told = json.loads(done.stdout.splitlines()[-1])
    assert 0.7 * peak < told < 1.4 * peak

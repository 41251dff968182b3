from dataclasses import replace

import numpy as np
import pytest

from experiments.events import EVENTS, toothpaste
from jaxphys.scene import scene_from_json, to_json
from jaxphys.scene.build import place_objects


@pytest.mark.parametrize("name", EVENTS)
def test_an_event_shows_the_material_as_it_is_anywhere_else(name):
    event = EVENTS[name]()
    assert scene_from_json(to_json(event.scene)) == event.scene
    shown = event.scene.objects[0]
    assert (shown.material, shown.parameters) == (name, {})
    assert len(event.makers) == len(event.scene.objects)


def test_all_of_the_strand_is_carried_out_of_the_nozzle_in_time():
    scene, makers = toothpaste()
    alone = replace(scene, objects=scene.objects[:1])
    strand = place_objects(alone, (makers[0](),))
    means = np.asarray(strand[0].moving.means)
    slices = [one for one in scene.boundaries if one.type == "translate"]
    within = [np.all(np.abs(means - one.centre) < one.half_size, axis=1) for one in slices]
    assert np.all(np.any(within, axis=0))
    assert max(one.end for one in slices) < scene.frames / scene.fps

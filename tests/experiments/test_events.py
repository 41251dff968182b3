import numpy as np
import pytest

from experiments.events import EVENTS
from jaxphys.scene import scene_from_json, to_json
from jaxphys.scene.build import place_objects


@pytest.mark.parametrize("name", EVENTS)
def test_an_event_shows_the_material_as_it_is_anywhere_else(name):
    scene, objects = EVENTS[name]()
    assert scene_from_json(to_json(scene)) == scene
    shown = scene.objects[0]
    assert (shown.material, shown.parameters) == (name, {})
    placed = place_objects(scene, objects)
    # Nothing starts below the floor that it is seen to stand on.
    low = min(float(np.min(one.moving.means[:, 2])) for one in placed)
    assert low > scene.ground.height - scene.domain.spacing
    if name == "toothpaste":
        # Every part of the strand is carried out of the nozzle, and leaves it in time.
        means = np.asarray(placed[0].moving.means)
        slices = [one for one in scene.boundaries if one.type == "translate"]
        within = [np.all(np.abs(means - one.centre) < one.half_size, axis=1) for one in slices]
        assert np.all(np.any(within, axis=0))
        assert max(one.end for one in slices) < scene.frames / scene.fps

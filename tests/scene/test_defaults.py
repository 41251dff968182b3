import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials import MATERIALS, get_material, material_values
from jaxphys.scene import scene_from_json, to_json
from jaxphys.scene.defaults import default_scene


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_has_a_scene_that_is_valid(name):
    scene = default_scene(name)
    assert scene_from_json(to_json(scene)) == scene
    thing = scene.objects[0]
    assert thing.material == name
    material_values(get_material(name), thing.parameters)
    low, high = thing.centre[2] - thing.size / 2, thing.centre[2] + thing.size / 2
    assert scene.ground.height < low and high < scene.domain.size[2] - 4 * scene.domain.spacing


def test_unknown_material():
    with pytest.raises(InputError, match="'sand'"):
        default_scene("snad")


def test_spacing_is_taken():
    assert default_scene("jelly", spacing=0.1).domain.spacing == 0.1

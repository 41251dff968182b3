import dataclasses
import json
import typing

import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.stepping import Adaptive, Fixed, Implicit
from jaxphys.scene import (
    Box,
    Cut,
    Filling,
    Impulse,
    Meeting,
    Object,
    Plane,
    Region,
    Release,
    Rotate,
    Rotation,
    Scene,
    Translate,
    View,
    Walls,
    read_scene,
    scene_from_json,
    to_json,
    write_scene,
)

UNIT = (1.0, 1.0, 1.0)
FULL = Scene(
    objects=(
        Object(
            source="a.ply",
            material="metal",
            parameters={"youngs_modulus": 1e6},
            regions=(Region(UNIT, UNIT, {"density": 3.0}),),
            rotation=(Rotation((0.0, 0.0, 1.0), 30.0),),
            filling=None,
        ),
        Object(area=(0.0, 1.0, 0.0, 1.0, 0.0, 1.0), filling=Filling(spacing=0.1)),
    ),
    boundaries=(
        Walls("slip"),
        Plane(friction=0.2),
        Box(UNIT, UNIT),
        Impulse(UNIT, UNIT, UNIT),
        Translate(UNIT, UNIT),
        Rotate(UNIT, UNIT, 0.1, 0.2),
        Release(UNIT, 0.0, 1.0),
        Cut(UNIT, UNIT),
    ),
    contact=Meeting(friction=0.4),
    camera=View(target=UNIT, distance=3.0),
    stepping=Fixed(),
    substep=1e-3,
)


def test_round_trip_is_exact_and_deterministic(tmp_path):
    write_scene(tmp_path / "a.json", FULL)
    again = read_scene(tmp_path / "a.json").scene
    assert again == FULL
    write_scene(tmp_path / "b.json", again)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_every_field_is_written_and_defaults_are_read():
    written = to_json(Scene())
    assert set(written) == {entry.name for entry in dataclasses.fields(Scene)}
    assert scene_from_json({}) == Scene() == scene_from_json(written)


def test_a_stepping_is_read_by_its_type():
    read = scene_from_json({"stepping": {"type": "adaptive", "every": 4, "safety": 0.7}})
    assert read.stepping == Adaptive(every=4, safety=0.7)
    assert scene_from_json(to_json(read)) == read
    assert scene_from_json({"stepping": {"type": "fixed"}}).stepping == Fixed()
    midpoint = scene_from_json({"stepping": {"type": "implicit", "theta": 0.5}})
    assert midpoint.stepping == Implicit(theta=0.5)
    assert scene_from_json(to_json(midpoint)) == midpoint


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"stepping": {"type": "adaptiv"}}, ["scene.stepping.type", "did you mean 'adaptive'"]),
        ({"stepping": {"type": "fixed", "every": 2}}, ["scene.stepping", "'every'"]),
        ({"stepping": {"type": "adaptive", "safety": 0}}, ["safety", "above 0"]),
        ({"stepping": {"type": "implicit", "theta": 0.3}}, ["theta", "at least 0.5"]),
        ({"gravty": [0, 0, 0]}, ["scene", "'gravty'", "did you mean 'gravity'"]),
        ({"gravity": [0, 0]}, ["scene.gravity", "3 values"]),
        ({"gravity": "down"}, ["scene.gravity", "list"]),
        ({"frames": 2.5}, ["scene.frames", "whole number"]),
        ({"frames": 0}, ["scene.frames", "at least 1"]),
        ({"frames": True}, ["scene.frames", "whole number"]),
        ({"objects": []}, ["scene.objects", "at least one"]),
        ({"objects": [{"size": -1}]}, ["scene.objects[0].size", "above 0"]),
        ({"objects": [{"parameters": {"density": "x"}}]}, ["objects[0].parameters.density"]),
        ({"boundaries": [{"type": "wals"}]}, ["boundaries[0].type", "'walls'"]),
        ({"boundaries": [{}]}, ["boundaries[0]", "'type'"]),
        ({"boundaries": [{"type": "box"}]}, ["boundaries[0]", "'centre'"]),
        ({"boundaries": [{"type": "plane", "surface": "slippy"}]}, ["surface", "'slip'"]),
        ({"domain": {"spacing": 1}}, ["scene.domain", "fewer than 8"]),
        ({"domain": {"spacing": 1e-5}}, ["scene.domain", "512"]),
        ({"camera": None}, ["scene.camera", "object"]),
    ],
)
def test_wrong_values_name_the_field(value, words):
    with pytest.raises(InputError) as error:
        scene_from_json(value)
    message = str(error.value)
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[1, 2]", b"\xff\xfe", b'{"fps": NaN}', b"[" * 100_000, b'{"fps": 1e999}'],
)
def test_broken_files_are_one_line_with_the_name(tmp_path, content):
    path = tmp_path / "scene.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_scene(path)
    assert "scene.json" in str(error.value) and "\n" not in str(error.value)


def test_missing_and_enormous_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_scene(tmp_path / "none.json")
    with open(tmp_path / "big.json", "wb") as file:
        file.truncate(64 * 1024 * 1024)
    with pytest.raises(InputError, match="MiB"):
        read_scene(tmp_path / "big.json")


def test_written_file_is_plain_json(tmp_path):
    write_scene(tmp_path / "a.json", FULL)
    assert json.loads((tmp_path / "a.json").read_text())["objects"][0]["material"] == "metal"


def numbers_of(kind):
    """The plain types that a field's type is made of, without those of dataclasses."""
    parts = typing.get_args(kind)
    if typing.get_origin(kind) is typing.Literal:
        return []
    return [leaf for part in parts for leaf in numbers_of(part)] if parts else [kind]


def declared(cls, seen):
    """(class, field, its plain types) of all that a scene is made of."""
    for entry in dataclasses.fields(cls):
        leaves = numbers_of(typing.get_type_hints(cls)[entry.name])
        yield cls, entry, leaves
        for leaf in leaves:
            if dataclasses.is_dataclass(leaf) and leaf not in seen:
                seen.add(leaf)
                yield from declared(leaf, seen)


def test_every_number_of_a_scene_has_a_range():
    for cls, entry, leaves in declared(Scene, set()):
        # What parameters may be is for the material to say.
        if {int, float} & set(leaves) and entry.name != "parameters":
            rules = entry.metadata
            assert rules["most"] <= 1e15, (cls, entry.name)
            assert max(rules.get("least", -1e99), rules.get("above", -1e99)) >= -1e15


@pytest.mark.parametrize(
    "value",
    [
        {"frame_time": 5e-324},
        {"frame_time": 1e300},
        {"domain": {"size": [1e300, 1, 1], "spacing": 5e-324}},
        {"domain": {"size": [1e6, 1e6, 1e6], "spacing": 1e-9}},
        {"seed": 10**400},
        {"frames": 10**5000},
        {"objects": [{"splats": 10**30}]},
        {"objects": [{"centre": [1e155, 0, 0]}]},
        {"objects": [{"filling": {"per_cell": 10**9}}]},
    ],
)
def test_numbers_are_held_against_their_range_before_any_arithmetic(value):
    with pytest.raises(InputError):
        scene_from_json(value)

import json
import math

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Setting
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.materials.catalogue import get_material
from jaxphys.scene import Box, Impulse, Plane, Release, Rotate, Translate, Walls, read_scene
from jaxphys.scene.physgaussian import from_physgaussian

FICUS = {
    "opacity_threshold": 0.02,
    "rotation_degree": [90.0, 10.0],
    "rotation_axis": [0, 2],
    "substep_dt": 1e-4,
    "frame_dt": 4e-2,
    "frame_num": 125,
    "nu": 0.4,
    "E": 2e6,
    "material": "jelly",
    "density": 200,
    "g": [0.0, 0.0, 0.0],
    "grid_v_damping_scale": 0.9999,
    "rpic_damping": 0.0,
    "additional_material_params": [
        {"point": [1, 1, 1.5], "size": [0.5, 0.5, 0.5], "E": 1e6, "nu": 0.4, "density": 70}
    ],
    "boundary_conditions": [
        {"type": "cuboid", "point": [1, 1, 0.5], "size": [0.5, 0.5, 0.28], "velocity": [0, 0, 0],
         "start_time": 0, "end_time": 1e3, "reset": 1},
        {"type": "particle_impulse", "force": [-0.18, 0, 0], "num_dt": 1},
    ],
    "mpm_space_viewpoint_center": [1.0, 1.0, 1.0],
    "mpm_space_vertical_upward_axis": [0, 0, 1],
    "default_camera_index": -1,
    "show_hint": False,
    "init_azimuthm": 10.0,
    "init_elevation": 5.0,
    "init_radius": 4.0,
    "move_camera": True,
    "delta_a": 0.5,
    "delta_e": 0.0,
    "delta_r": 0.0,
    "particle_filling": {
        "n_grid": 128, "density_threshold": 5.0, "search_threshold": 0.5,
        "max_partciels_per_cell": 4, "boundary": [0, 2, 0, 2, 0, 1],
    },
}  # fmt: skip

SPAN = {"start_time": 0.0, "end_time": 2.0}
ALL = [
    ({"type": "bounding_box"}, Walls),
    ({"type": "cuboid", "point": [1, 1, 1], "size": [1, 1, 1], "velocity": [0, 0, 1]}, Box),
    ({"type": "particle_impulse", "force": [0, 0, 1]}, Impulse),
    (
        {"type": "enforce_particle_translation", "point": [1, 1, 1], "size": [1, 1, 1],
         "velocity": [0, 0, 1]} | SPAN,
        Translate,
    ),
    (
        {"type": "surface_collider", "point": [1, 1, 0], "normal": [0, 0, 1], "surface": "slip",
         "friction": 0.1} | SPAN,
        Plane,
    ),
    (
        {"type": "release_particles_sequentially", "normal": [1, 0, 0], "start_position": 1.5,
         "end_position": 0.5, "num_layers": 20} | SPAN,
        Release,
    ),
    (
        {"type": "enforce_particle_velocity_rotation", "normal": [1, 0, 0], "point": [1, 1, 1],
         "half_height_and_radius": [0.1, 0.6], "rotation_scale": 1.9, "translation_scale": 0.0}
        | SPAN,
        Rotate,
    ),
]  # fmt: skip


def test_ficus_loads_with_its_meaning_and_notes():
    scene, notes = (loaded := from_physgaussian(FICUS)).scene, loaded.notes
    thing = scene.objects[0]
    assert scene.domain.spacing == pytest.approx(2 / 50)
    assert thing.parameters == {"youngs_modulus": 2e6, "poisson_ratio": 0.4, "density": 200.0}
    assert thing.regions[0].parameters["density"] == 70
    assert [turn.axis for turn in thing.rotation] == [(1, 0, 0), (0, 0, 1)]
    assert thing.filling.spacing == pytest.approx(2 / 128) and thing.filling.per_cell == 4
    assert thing.filling.search_threshold == 0.5
    assert (scene.frames, scene.fps, scene.frame_time) == (125, 25, 0.04)
    # One substep's factor applied for a second.
    assert scene.damping == pytest.approx(-math.log(0.9999) / 1e-4)
    assert scene.camera.azimuth == pytest.approx(35)
    assert scene.camera.turn == pytest.approx(-0.5 / 0.04)
    assert scene.boundaries[0].rest_after == pytest.approx(15e-4)
    assert scene.boundaries[1].duration == pytest.approx(1e-4)
    assert scene.boundaries[1].per_particle
    text = "\n".join(notes)
    for word in ("cuboid reset", "particle_impulse", "particle_filling", "cameras.json", "bounds"):
        assert word in text


def test_walls_and_surfaces_hold_the_nodes_that_theirs_hold():
    """As many nodes as theirs, and what stands on a node plane leaves the plane's nodes free."""
    conditions = [ALL[0][0], ALL[4][0] | {"surface": "sticky", "friction": 0}]
    scene = from_physgaussian({"g": [0, 0, 0], "boundary_conditions": conditions}).scene
    assert scene.domain.shape == (50, 50, 50)
    assert [boundary.acts_on for boundary in scene.boundaries] == ["nodes", "nodes"]
    assert scene.boundaries[0].inset is None  # three cells


def test_nodes_that_walls_and_a_floor_on_a_node_hold():
    """Nodes 0 to 2 and n - 3 to n - 1, and below the floor strictly: theirs stops dot < 0."""
    conditions = [
        ALL[0][0],
        ALL[4][0] | {"surface": "sticky", "friction": 0, "point": [0, 0, 0.48]},
    ]
    config = {"g": [0, 0, 0], "grid_lim": 1, "n_grid": 25, "boundary_conditions": conditions}
    scene = from_physgaussian(config).scene
    grid = Grid(scene.domain.shape, scene.domain.spacing)
    assert 0.48 / grid.spacing == pytest.approx(12)
    rest = np.full((1, 3), 0.6)
    walls, floor = (
        one.prepared(Setting(grid, rest, np.ones(1), np.float32)) for one in scene.boundaries
    )
    nodes = np.arange(25, dtype=np.float32) * np.float32(grid.spacing)
    where = (nodes[:, None, None], nodes[None, :, None], nodes[None, None, :])
    for sign in (-1, 1):
        moved = jnp.full((3, 25, 25, 25), float(sign))
        left = np.asarray(walls.on_grid(moved, where, grid, 0.0, 1e-3))
        for axis in range(3):
            line = np.moveaxis(left[axis], axis, -1)[12, 12]
            assert list(np.flatnonzero(line == 0)) == ([0, 1, 2] if sign < 0 else [22, 23, 24])
    held = np.asarray(floor.on_grid(jnp.ones((3, 25, 25, 25)), where, grid, 0.0, 1e-3))
    assert list(np.flatnonzero(held[0, 12, 12] == 0)) == list(range(12))


def test_rotation_turns_the_way_of_theirs():
    """Theirs is v = -scale n x r."""
    scene = from_physgaussian({"g": [0, 0, 0], "boundary_conditions": [ALL[6][0]]}).scene
    assert scene.boundaries[0].angular_velocity == -1.9


@pytest.mark.parametrize(("condition", "kind"), ALL)
def test_every_boundary_type(condition, kind):
    loaded = from_physgaussian({"g": [0, 0, -9.8], "boundary_conditions": [condition]})
    assert isinstance(loaded.scene.boundaries[0], kind)


def test_cut_has_the_layer_that_their_code_fixes():
    condition = ALL[4][0] | {"surface": "cut"}
    found = from_physgaussian({"g": [0, 0, 0], "boundary_conditions": [condition]}).scene
    assert (found.boundaries[0].lower, found.boundaries[0].upper) == (0.40, 0.53)


def test_surfaces_are_honoured_not_copied():
    slip = from_physgaussian({"g": [0, 0, 0], "boundary_conditions": [ALL[4][0]]})
    assert slip.scene.boundaries[0].surface == "slip"
    assert any("sticks whatever" in note for note in slip.notes)
    release = from_physgaussian({"g": [0, 0, 0], "boundary_conditions": [ALL[5][0]]})
    assert release.scene.boundaries[0].begin == 1.5
    assert any("50 layers" in note for note in release.notes)


@pytest.mark.parametrize(
    ("material", "ours"), [("jelly", "jelly"), ("metal", "metal"), ("sand", "sand"),
                           ("foam", "plasticine"), ("plasticine", "plasticine"), ("snow", "snow")]
)  # fmt: skip
def test_materials(material, ours):
    loaded = from_physgaussian({"material": material, "g": [0, 0, 0], "yield_stress": 1e4})
    assert loaded.scene.objects[0].material == ours
    # Its snow has no stress at all, and its foam is what is called plasticine here.
    noted = any(note.startswith("material:") for note in loaded.notes)
    assert noted == (material in ("foam", "snow"))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"materiel": "jelly"}, ["'materiel'", "'material'"]),
        ({"material": "jello"}, ["config.material", "'jelly'"]),
        ({"E": "stiff"}, ["config.E", "number"]),
        ({"g": 9.8}, ["config.g", "list"]),
        ({"rotation_degree": [1], "rotation_axis": []}, ["rotation_axis", "1 angles"]),
        ({"rotation_degree": [1], "rotation_axis": [3]}, ["rotation_axis"]),
        (
            {"boundary_conditions": [{"type": "cubiod"}]},
            ["boundary_conditions[0].type", "'cuboid'"],
        ),
        ({"boundary_conditions": [{"type": "cuboid"}]}, ["boundary_conditions[0]", "'point'"]),
        ({"frame_num": 0}, ["frame_num"]),
        ({"substep_dt": 1.0}, ["substep_dt"]),
        ({"n_grid": 0}, ["n_grid"]),
        ({"grid_v_damping_scale": 0}, ["grid_v_damping_scale"]),
    ],
)
def test_wrong_values_name_the_field(value, words):
    with pytest.raises(InputError) as error:
        from_physgaussian({"g": [0, 0, 0], "frame_dt": 0.04} | value)
    message = str(error.value)
    assert message.startswith("config") and "\n" not in message
    for word in words:
        assert word in message


def test_file_is_recognised(tmp_path):
    (tmp_path / "ficus.json").write_text(json.dumps(FICUS))
    loaded = read_scene(tmp_path / "ficus.json")
    assert loaded.notes and loaded.scene.frames == 125


def test_foam_is_their_viscoplastic_law():
    """Theirs: |s| = |s_tr| - (|s_tr| - sqrt(2/3) yield) / (1 + plastic_viscosity / (2 mu dt))."""
    theirs = {"material": "foam", "g": [0, 0, 0], "E": 2.6e5, "nu": 0.3}
    theirs |= {"yield_stress": 1e3, "plastic_viscosity": 40.0}
    loaded = from_physgaussian(theirs)
    thing = loaded.scene.objects[0]
    mu, dt, e = 1e5, 1e-4, 0.05
    law = get_material(thing.material).law
    values = law.prepare({name: jnp.full(1, thing.parameters[name]) for name in law.parameters})
    F = jnp.asarray(np.diag([np.exp(e), np.exp(-e), 1.0]))[..., None]
    _, tau, _ = law.update(values, F, jnp.zeros((0, 1)), dt)
    trial = 2 * mu * e * np.sqrt(2)
    expected = trial - (trial - np.sqrt(2 / 3) * 1e3) / (1 + 40.0 / (2 * mu * dt))
    assert float(jnp.sqrt(jnp.sum(tau**2))) == pytest.approx(expected, rel=1e-9)
    assert not any("plastic_viscosity" in note for note in loaded.notes)


def test_plasticine_is_perfectly_plastic_and_says_what_is_left_out():
    theirs = {"material": "plasticine", "g": [0, 0, 0], "yield_stress": 1e3}
    loaded = from_physgaussian(theirs | {"plastic_viscosity": 5.0, "softening": 3.0})
    parameters = loaded.scene.objects[0].parameters
    assert parameters["yield_stress"] == pytest.approx(1e3 * 1.5**0.5)
    assert parameters["plastic_viscosity"] == 0
    text = "\n".join(loaded.notes)
    assert "plastic_viscosity: left out" in text and "softening: left out" in text


def test_their_yield_stress_is_a_radius_and_their_hardening_grows_it():
    """Theirs yields at |dev tau| = yield_stress, which then grows by 2 mu xi times the plastic
    strain; ours take the stress of a uniaxial test, sqrt(3/2) |dev tau|, and its plastic strain,
    sqrt(2/3) times that.
    """
    theirs = {"material": "metal", "g": [0, 0, 0], "E": 1e5, "nu": 0.25}
    theirs |= {"yield_stress": 1e3, "hardening": 1, "xi": 0.1}
    ours = from_physgaussian(theirs).scene.objects[0].parameters
    assert ours["yield_stress"] == pytest.approx(1e3 * 1.5**0.5)
    growth = 2 * (1e5 / 2.5) * 0.1
    assert ours["hardening"] == pytest.approx(growth * 1.5)
    soft = from_physgaussian(theirs | {"hardening": 0}).scene.objects[0].parameters
    assert "hardening" not in soft


@pytest.mark.parametrize(
    "change",
    [
        {"n_grid": 0},
        {"n_grid": 1e300},
        {"frame_dt": 5e-324, "substep_dt": 5e-324},
        {"frame_dt": 1e300},
        {"substep_dt": 0},
        {"grid_lim": 1e300},
        {"grid_lim": 10**400},
        {"grid_v_damping_scale": 0},
        {"particle_filling": {"n_grid": 0}},
        {"frame_num": 1e300},
        {"init_azimuthm": 1e300},
    ],
)
def test_numbers_are_held_against_their_range_before_any_arithmetic(change):
    with pytest.raises(InputError, match=rf"^there.*{next(iter(change))}|^there\..*") as error:
        from_physgaussian(FICUS | change, "there")
    assert str(error.value).isprintable()

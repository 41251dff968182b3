"""What an object may be made of, from JSON to the program."""

import dataclasses

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.mpm.materials.plasticity import (
    PERFECT_VON_MISES,
    UNCORRECTED_DRUCKER_PRAGER,
    VON_MISES,
    triaxial_friction_angle,
)
from jaxphys.mpm.stepping import Implicit
from jaxphys.scene import Domain, Object, Region, Scene, scene_from_json, to_json
from jaxphys.scene.build import build

POINTS = np.random.default_rng(0).uniform(-1, 1, (30, 3)).astype(np.float32)
GAUSSIANS = from_points(POINTS, np.full((30, 3), 0.5), 0.2)


def made_of(material, **fields):
    thing = Object(material=material, size=0.4, centre=(0.5, 0.5, 0.5), filling=None, **fields)
    scene = Scene(objects=(thing,), domain=Domain((1.0, 1.0, 1.0), 1 / 12), frame_time=0.01)
    return scene_from_json(to_json(scene))


def simulated(scene):
    """The physics that a scene of the little cloud becomes."""
    return build(scene, GAUSSIANS).simulation


def test_sand_without_volume_correction():
    scene = made_of("sand", law="Drucker-Prager without volume correction")
    simulation = simulated(scene)
    assert [law for law, _, _ in simulation.config.segments] == [UNCORRECTED_DRUCKER_PRAGER]
    assert simulation.state.history is None


def test_a_law_that_the_material_cannot_have():
    with pytest.raises(InputError, match=r"objects\[0\].law: sand cannot have the law 'Hencky'"):
        simulated(made_of("sand", law="Hencky"))


def test_stress_at_the_mean_volume():
    law = "neo-Hookean"
    simulation = simulated(made_of("jelly", law=law, mean_volume=True))
    ((found, _, _),) = simulation.config.segments
    assert found is at_mean_volume(NEO_HOOKEAN) and simulation.config.columns == 8
    np.testing.assert_array_equal(simulation.state.history, np.zeros((1, 30)))
    assert simulated(made_of("jelly", law=law)).config.columns == 4
    with pytest.raises(InputError, match=r"objects\[0\].mean_volume: the law 'von Mises' flows"):
        simulated(made_of("metal", mean_volume=True))
    implicit = dataclasses.replace(made_of("jelly", mean_volume=True), stepping=Implicit())
    with pytest.raises(InputError, match="at the mean volume' has a stress that no energy gives"):
        simulated(implicit)


@pytest.mark.parametrize(("hardening", "law"), [(0.0, PERFECT_VON_MISES), (1e3, VON_MISES)])
def test_hardening_of_zero_is_left_out(hardening, law):
    simulation = simulated(made_of("metal", parameters={"hardening": hardening}))
    assert [one for one, _, _ in simulation.config.segments] == [law]
    assert ("hardening" in simulation.model.parameters) == (hardening > 0)
    assert (simulation.state.history is None) == (hardening == 0)
    if hardening:
        changed = simulation.with_(hardening=7.0).model.parameters["hardening"]
        np.testing.assert_array_equal(changed, 7.0)
    else:
        with pytest.raises(InputError, match="hardening was built as 0"):
            simulation.with_(hardening=7.0)


def test_a_region_whose_angle_is_that_of_plane_strain():
    region = Region((0.75, 0.5, 0.5), (0.25, 1.0, 1.0), {"plane_strain_friction_angle": 30.0})
    simulation = simulated(made_of("sand", regions=(region,)))
    right = np.asarray(simulation.state.position)[0] > 0.5
    matched = float(triaxial_friction_angle(30.0))
    found = np.asarray(simulation.model.parameters["friction_angle"])
    np.testing.assert_allclose(found, np.where(right, matched, 35.0), rtol=1e-6)


@pytest.mark.parametrize("side", [1.0, 2.5])
@pytest.mark.parametrize("spacing", [1 / 24, 1 / 12, 0.1, 0.05])
def test_a_grid_covers_a_domain_of_whole_cells_exactly(side, spacing):
    shape = Domain((side,) * 3, spacing).shape
    assert (shape[0] - 1) * spacing == pytest.approx(side, rel=1e-12)


def test_a_grid_covers_a_domain_that_is_no_multiple_of_the_spacing():
    domain = Domain((1.0, 1.04, 1.06), 0.1)
    assert domain.shape == (11, 12, 12)
    assert dataclasses.replace(domain, spacing=0.08).shape == (14, 14, 15)

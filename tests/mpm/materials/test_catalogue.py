import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.catalogue import (
    MATERIALS,
    assemble_parameters,
    declared_parameters,
    get_material,
    material_values,
    overridden,
)
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN
from jaxphys.mpm.materials.fracture import FRACTURE
from jaxphys.mpm.materials.parameters import check_parameter
from jaxphys.mpm.materials.plasticity import (
    DRUCKER_PRAGER,
    PERFECT_VON_MISES,
    UNCORRECTED_DRUCKER_PRAGER,
    VON_MISES,
    friction_coefficient,
)

PAPER = {"elastic", "jelly", "metal", "sand", "fracture"}
OTHERS = {"water", "cream", "toothpaste", "plasticine", "snow", "wet-sand", "memory-foam", "muscle"}


def test_the_materials_have_usable_defaults():
    assert set(MATERIALS) == PAPER | OTHERS
    for name, material in MATERIALS.items():
        assert get_material(name) is material and material.name == name
        for law in (material.law, *material.others):
            assert set(material.defaults) >= {*law.parameters, "density"}
        assert set(material.defaults) == {*material.law.parameters, "density"}
        assert material.description
        for parameter, value in material.defaults.items():
            check_parameter(material.declared[parameter], value, name)
    stiff, soft = MATERIALS["elastic"].defaults, MATERIALS["jelly"].defaults
    assert stiff["youngs_modulus"] > 5 * soft["youngs_modulus"]


@pytest.mark.parametrize(
    ("name", "wrong", "right", "message"),
    [
        ("youngs_modulus", 0.0, 1e-3, "> 0"),
        ("youngs_modulus", float("nan"), 1e9, "> 0"),
        ("youngs_modulus", float("inf"), 1e9, "> 0"),
        ("poisson_ratio", 0.5, 0.499, "between -1 and 0.5"),
        ("poisson_ratio", -1.0, -0.999, "between -1 and 0.5"),
        ("density", -1.0, 1e-3, "> 0"),
        ("yield_stress", 0.0, 1.0, "> 0"),
        ("hardening", -1.0, 0.0, ">= 0"),
        ("friction_angle", 90.0, 89.9, r"in \[0, 90\)"),
        ("friction_angle", -0.1, 0.0, r"in \[0, 90\)"),
        ("plane_strain_friction_angle", 90.0, 89.9, r"in \[0, 90\)"),
        ("fracture_strain", 0.0, 0.1, "> 0"),
        ("softening_strain", 0.0, 0.1, "> 0"),
    ],
)
def test_ranges_are_refused_at_their_ends_and_told(name, wrong, right, message):
    parameter = declared_parameters()[name]
    check_parameter(parameter, right, "test")
    with pytest.raises(InputError, match=message) as error:
        check_parameter(parameter, wrong, "here")
    assert "here" in str(error.value) and name in str(error.value)
    assert "\n" not in str(error.value)


def test_an_array_is_checked_entry_by_entry():
    with pytest.raises(InputError, match=r"density\[2\] is -5"):
        material_values(MATERIALS["sand"], {"density": np.array([1.0, 2.0, -5.0])})


def test_a_name_means_one_thing_wherever_it_stands():
    for material in MATERIALS.values():
        for law in (material.law, *material.others):
            for one in law.declared:
                assert declared_parameters()[one.name] == one and one.meaning


def test_the_angle_of_plane_strain_stands_for_the_other_one():
    """Of the cone itself, which is sqrt(2) sin(phi) / 3 there; see test_plasticity.py for why."""
    for name in ("sand", "fracture"):
        material = MATERIALS[name]
        values = material_values(material, {"plane_strain_friction_angle": 40.0})
        assert set(values) == set(material.defaults)
        alpha = float(friction_coefficient(values["friction_angle"]))
        assert alpha == pytest.approx(np.sqrt(2) / 3 * np.sin(np.radians(40.0)), rel=1e-6)
    both = {"friction_angle": 30.0, "plane_strain_friction_angle": 40.0}
    with pytest.raises(InputError, match="not both"):
        material_values(MATERIALS["sand"], both)
    with pytest.raises(InputError, match="unknown parameter"):
        material_values(MATERIALS["metal"], {"plane_strain_friction_angle": 40.0})
    assert overridden(MATERIALS["sand"], {"density": 7.0}) == {"density": 7.0}


def test_a_material_may_have_another_law():
    assert get_material("sand").law is DRUCKER_PRAGER
    chosen = get_material("sand", "Drucker-Prager without volume correction")
    assert chosen.law is UNCORRECTED_DRUCKER_PRAGER
    assert chosen.defaults == MATERIALS["sand"].defaults
    assert get_material("jelly", "neo-Hookean").law is NEO_HOOKEAN
    with pytest.raises(InputError, match=r"jelly cannot have.*did you mean 'neo-Hookean'"):
        get_material("jelly", "neohookean")


def test_a_metal_without_hardening_traces_none():
    metal = MATERIALS["metal"]
    hard = np.array([0.0, 1e4])
    parameters, _, segments = assemble_parameters(
        [
            (metal, material_values(metal), 2),
            (metal, material_values(metal, {"hardening": hard}), 2),
        ]
    )
    assert segments == ((PERFECT_VON_MISES, 0, 2), (VON_MISES, 2, 4))
    np.testing.assert_allclose(parameters["hardening"], [0, 0, 0, 1e4])
    parameters, _, _ = assemble_parameters([(metal, material_values(metal), 2)])
    assert "hardening" not in parameters
    assert PERFECT_VON_MISES.omits == ("hardening",) and not PERFECT_VON_MISES.history


DT = 1e-3
LAWS = (
    FIXED_COROTATED,
    NEO_HOOKEAN,
    HENCKY,
    VON_MISES,
    PERFECT_VON_MISES,
    DRUCKER_PRAGER,
    UNCORRECTED_DRUCKER_PRAGER,
    FRACTURE,
    *(MATERIALS[name].law for name in sorted(OTHERS)),
)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_what_a_law_says_of_itself_is_what_its_program_holds(law):
    # Of the first material that has all of them.
    defaults = next(
        m.defaults for m in MATERIALS.values() if set(law.parameters) <= set(m.defaults)
    )
    values = dict(defaults) | {"hardening": 0.2}
    values = {name: jnp.asarray(values[name]) for name in law.parameters}
    F = jnp.asarray(np.exp(0.5) * np.eye(3)[:, :, None]).at[0, 1].set(0.7)
    history = jnp.zeros((len(law.history), 1))
    assert len(law.history_names) == len(law.history)
    program = str(jax.make_jaxpr(law.update)(values, F, history, DT))
    assert law.spectral == ("left_isotropic" in program or "eigen_symmetric" in program)
    update = jax.jit(law.update)
    kept, stress, _ = update(values, F, history, DT)
    assert law.plastic == bool((kept != F).any())
    assert jax.eval_shape(law.energy, values, kept, history).shape == (1,)
    if law.breaks:
        # Pulled far, it bears nothing, and nothing again when the strain is small.
        _, _, history = update(values, F, history, DT)
        _, again, _ = update(values, jnp.asarray(1.01 * np.eye(3)[:, :, None]), history, DT)
        assert not stress.any() and not again.any()


def test_unknown_names_get_the_nearest():
    with pytest.raises(InputError, match="did you mean 'jelly'"):
        get_material("jely")
    with pytest.raises(InputError, match="did you mean 'youngs_modulus'"):
        material_values(MATERIALS["jelly"], {"young_modulus": 1.0})
    with pytest.raises(InputError, match="unknown parameter 'friction_angle'"):
        material_values(MATERIALS["jelly"], {"friction_angle": 30.0})


def test_parameters_of_several_parts():
    stiff, jelly, sand = MATERIALS["elastic"], MATERIALS["jelly"], MATERIALS["sand"]
    moduli = np.array([1.0, 2.0, 3.0])
    parameters, density, segments = assemble_parameters(
        [
            (stiff, material_values(stiff), 2),
            (jelly, material_values(jelly, {"youngs_modulus": moduli}), 3),
            (sand, material_values(sand, {"density": 7.0}), 1),
        ]
    )
    assert segments == ((FIXED_COROTATED, 0, 5), (DRUCKER_PRAGER, 5, 6))
    assert set(parameters) == {"youngs_modulus", "poisson_ratio", "friction_angle"}
    E = [material.defaults["youngs_modulus"] for material in (stiff, stiff, sand)]
    np.testing.assert_allclose(parameters["youngs_modulus"], [*E[:2], 1, 2, 3, E[2]])
    np.testing.assert_allclose(parameters["friction_angle"], [0, 0, 0, 0, 0, 35])
    np.testing.assert_allclose(density, [400] * 2 + [300] * 3 + [7])
    assert density.dtype == jnp.float32
    with pytest.raises(InputError, match="youngs_modulus has shape"):
        assemble_parameters([(jelly, material_values(jelly, {"youngs_modulus": moduli}), 2)])

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.elasticity import FIXED_COROTATED
from jaxphys.mpm.materials import (
    MATERIALS,
    RANGES,
    assemble_parameters,
    check_parameter,
    get_material,
    material_values,
)
from jaxphys.mpm.plasticity import DRUCKER_PRAGER


def test_the_five_materials_of_the_paper_with_usable_defaults():
    assert set(MATERIALS) == {"elastic", "jelly", "metal", "sand", "fracture"}
    for name, material in MATERIALS.items():
        assert get_material(name) is material and material.name == name
        assert set(material.defaults) == {*material.law.parameters, "density"}
        assert material.description
        for parameter, value in material.defaults.items():
            check_parameter(parameter, value, name)
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
        ("fracture_strain", 0.0, 0.1, "> 0"),
        ("softening_strain", 0.0, 0.1, "> 0"),
    ],
)
def test_ranges_are_refused_at_their_ends_and_told(name, wrong, right, message):
    check_parameter(name, right, "test")
    with pytest.raises(InputError, match=message) as error:
        check_parameter(name, wrong, "here")
    assert "here" in str(error.value) and name in str(error.value)
    assert "\n" not in str(error.value)


def test_an_array_is_checked_entry_by_entry():
    with pytest.raises(InputError, match=r"density\[2\] is -5"):
        material_values(MATERIALS["sand"], {"density": np.array([1.0, 2.0, -5.0])})


def test_every_range_belongs_to_a_parameter():
    used = {name for material in MATERIALS.values() for name in material.defaults}
    assert used == set(RANGES)


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
    np.testing.assert_allclose(parameters["youngs_modulus"], [1e6, 1e6, 1, 2, 3, 1e6])
    np.testing.assert_allclose(parameters["friction_angle"], [0, 0, 0, 0, 0, 35])
    np.testing.assert_allclose(density, [1000] * 5 + [7])
    assert density.dtype == jnp.float32
    with pytest.raises(InputError, match="youngs_modulus has shape"):
        assemble_parameters([(jelly, material_values(jelly, {"youngs_modulus": moduli}), 2)])

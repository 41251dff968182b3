import json

from jaxphys.cli.listing import materials_text
from jaxphys.cli.main import run
from jaxphys.mpm.materials.catalogue import MATERIALS, declared_parameters


def test_every_parameter_is_explained_where_it_is_listed():
    """As JSON each material is complete by itself; as text each meaning stands there once."""
    listed = json.loads(materials_text(as_json=True))
    assert set(listed) == set(MATERIALS)
    text = " ".join(materials_text().split())
    for name, material in MATERIALS.items():
        assert f"{name}: {material.description}" in text
        told = listed[name]["parameters"]
        for key, value in material.defaults.items():
            allowed = material.declared[key]
            assert told[key] == {
                "default": value,
                "meaning": allowed.meaning,
                "unit": allowed.unit,
                "range": allowed.text,
            }
            assert f"{key} {value:g} {allowed.unit}".strip() in text
    for key, allowed in declared_parameters().items():
        assert text.count(allowed.meaning) == 1 and f"{allowed.text}" in text, key


def test_what_may_be_given_instead_is_listed():
    sand = json.loads(materials_text(as_json=True))["sand"]
    assert sand["parameters"]["plane_strain_friction_angle"]["instead_of"] == "friction_angle"
    assert sand["law"] == "Drucker-Prager"
    assert sand["other_laws"] == ["Drucker-Prager without volume correction"]
    assert "law: Drucker-Prager; or Drucker-Prager without volume correction" in materials_text()


def test_no_line_is_too_long_for_a_terminal():
    assert max(len(line) for line in materials_text().splitlines()) <= 100


def test_two_forms_at_once_are_refused(capsys):
    assert run(["materials", "--json", "--markdown"]) == 2
    told = capsys.readouterr()
    assert not told.out and told.err.startswith("jaxphys: --json, --markdown: ask for one")

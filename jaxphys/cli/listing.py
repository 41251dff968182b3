"""The materials as a table."""

import json
import textwrap

from jaxphys.mpm.materials.catalogue import MATERIALS, Material, declared_parameters
from jaxphys.mpm.materials.parameters import Parameter


def _explained(one: Parameter) -> dict:
    return {"meaning": one.meaning, "unit": one.unit, "range": one.text}


def _as_json(material: Material) -> dict:
    parameters = {
        name: {"default": value} | _explained(material.declared[name])
        for name, value in material.defaults.items()
    }
    return {
        "description": material.description,
        "law": material.law.name,
        "other_laws": [law.name for law in material.others],
        "parameters": parameters
        | {
            name: {"instead_of": other.instead_of} | _explained(other.parameter)
            for name, other in material.alternatives.items()
        },
    }


def _material_lines(material: Material) -> list[str]:
    lines = [f"{material.name}: {material.description}"]
    for name, value in material.defaults.items():
        lines.append(f"  {name:17} {value:<9g} {material.declared[name].unit}".rstrip())
    others = ", ".join(law.name for law in material.others)
    return [*lines, f"  law: {material.law.name}" + (f"; or {others}" if others else "")]


def _meaning_lines(one: Parameter, instead_of: dict[str, str]) -> list[str]:
    instead = f" (in place of {instead_of[one.name]})" if one.name in instead_of else ""
    unit = f" {one.unit}" if one.unit else ""
    text = f"{one.name}{instead}, {one.text}{unit}: {one.meaning}"
    return textwrap.wrap(text, 96, initial_indent="  ", subsequent_indent="    ")


def materials_markdown() -> str:
    """The two tables of docs/materials.md: the materials, and what their parameters mean."""
    lines = ["| material | what it is | law; others | defaults |", "|---|---|---|---|"]
    for material in MATERIALS.values():
        laws = "; ".join([f"**{material.law.name}**", *(law.name for law in material.others)])
        defaults = ", ".join(
            f"`{name}` {value:g} {material.declared[name].unit}".rstrip()
            for name, value in material.defaults.items()
        )
        lines.append(f"| `{material.name}` | {material.description} | {laws} | {defaults} |")
    lines += ["", "| parameter | unit | range | meaning |", "|---|---|---|---|"]
    for one in declared_parameters().values():
        lines.append(f"| `{one.name}` | {one.unit} | {one.text} | {one.meaning} |")
    return "\n".join(lines)


def materials_text(as_json: bool = False) -> str:
    """Every material with its laws and defaults, and every parameter with its meaning, unit and
    range.
    """
    if as_json:
        listed = {name: _as_json(material) for name, material in MATERIALS.items()}
        return json.dumps(listed, indent=2)
    lines = [line for material in MATERIALS.values() for line in _material_lines(material)]
    lines.append("what they mean:")
    instead_of = {
        name: other.instead_of
        for material in MATERIALS.values()
        for name, other in material.alternatives.items()
    }
    for one in declared_parameters().values():
        lines += _meaning_lines(one, instead_of)
    return "\n".join(lines)

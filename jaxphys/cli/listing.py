"""The materials as a table."""

import json
import textwrap

from jaxphys.mpm.materials.catalogue import MATERIALS, Material
from jaxphys.mpm.materials.parameters import ALTERNATIVES, RANGES


def _explained(name: str) -> dict:
    allowed = RANGES[name]
    return {"meaning": allowed.meaning, "unit": allowed.unit, "range": allowed.text}


def _as_json(material: Material) -> dict:
    parameters = {
        name: {"default": value} | _explained(name) for name, value in material.defaults.items()
    }
    return {
        "description": material.description,
        "law": material.law.name,
        "other_laws": [law.name for law in material.others],
        "parameters": parameters
        | {
            name: {"instead_of": ALTERNATIVES[name].name} | _explained(name)
            for name in material.alternatives
        },
    }


def _material_lines(material: Material) -> list[str]:
    lines = [f"{material.name}: {material.description}"]
    for name, value in material.defaults.items():
        lines.append(f"  {name:17} {value:<9g} {RANGES[name].unit}".rstrip())
    others = ", ".join(law.name for law in material.others)
    return [*lines, f"  law: {material.law.name}" + (f"; or {others}" if others else "")]


def _meaning_lines(name: str) -> list[str]:
    allowed = RANGES[name]
    instead = f" (in place of {ALTERNATIVES[name].name})" if name in ALTERNATIVES else ""
    unit = f" {allowed.unit}" if allowed.unit else ""
    text = f"{name}{instead}, {allowed.text}{unit}: {allowed.meaning}"
    return textwrap.wrap(text, 96, initial_indent="  ", subsequent_indent="    ")


def materials_text(as_json: bool = False) -> str:
    """Every material with its laws and defaults, and every parameter with its meaning, unit and
    range.
    """
    if as_json:
        listed = {name: _as_json(material) for name, material in MATERIALS.items()}
        return json.dumps(listed, indent=2)
    lines = [line for material in MATERIALS.values() for line in _material_lines(material)]
    lines.append("what they mean:")
    return "\n".join(lines + [line for name in RANGES for line in _meaning_lines(name)])

"""The materials as a table."""

import json

from jaxphys.mpm.materials import MATERIALS, RANGES


def materials_text(as_json: bool = False) -> str:
    """Every material with its parameters, defaults, units and ranges."""
    if as_json:
        listed = {
            name: {"description": material.description, "parameters": dict(material.defaults)}
            for name, material in MATERIALS.items()
        }
        return json.dumps(listed, indent=2)
    lines = []
    for name, material in MATERIALS.items():
        lines.append(f"{name}: {material.description}")
        for key, value in material.defaults.items():
            allowed = RANGES[key]
            lines.append(f"  {key:17} {value:<9g} {allowed.unit:11} {allowed.text}")
    return "\n".join(lines)

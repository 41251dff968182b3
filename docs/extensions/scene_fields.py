"""The page of all fields of a scene, made from the classes that read them, before the build."""

import dataclasses
import inspect
import re
import types
import typing
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

from jaxphys.core.errors import InputError
from jaxphys.core.fields import LARGEST
from jaxphys.scene.scene import Scene

HEAD = """# Fields of a scene

A scene is a JSON object with these fields; each may be left out where it has a default.
`jaxphys animate OBJECT --material jelly` writes the scene that it runs to `config.json`, which is a
good start; `--set name=value` changes a field without a file ([command line](command_line.md)).
What is not listed here is refused by name. Lengths are in metres, times in seconds. This page is
made from the classes that read scenes.
"""


def page() -> str:
    """The page's source."""
    found: list[type] = []
    _collect(Scene, found)
    return HEAD + "".join(f"\n## {one.__name__}\n\n{_section(one)}" for one in found)


def _collect(one: type, found: list[type]) -> None:
    if one in found:
        return
    found.append(one)
    for kind in typing.get_type_hints(one).values():
        for inner in _classes(kind):
            _collect(inner, found)


def _classes(kind: Any) -> list[type]:
    if dataclasses.is_dataclass(kind):
        return [typing.cast(type, kind)]
    return [inner for part in typing.get_args(kind) for inner in _classes(part)]


def _section(one: type) -> str:
    text = inspect.getdoc(one) or ""
    meanings: dict[str, str] = {}
    for base in reversed(one.__mro__):
        own = _meanings(inspect.cleandoc(base.__doc__ or ""))
        meanings |= {n: m for n, m in own.items() if not m.startswith("as for any")}
    summary = text.split("Attributes:")[0].strip()
    hints = typing.get_type_hints(one)
    fields = [f for f in dataclasses.fields(one) if f.metadata.get("keys", (f.name,))]
    lacking = [f.name for f in fields if f.name not in meanings]
    if lacking:
        raise ExtensionError(f"{one.__name__} does not say what these mean: {', '.join(lacking)}")
    kind = f'`"type": "{one.type}"`\n\n' if hasattr(one, "type") else ""
    if not fields:
        return f"{kind}{summary}\n"
    rows = [
        "| field | what may stand there | default | meaning |",
        "|---|---|---|---|",
        *(_row(f, hints[f.name], meanings[f.name]) for f in fields),
    ]
    return f"{kind}{summary}\n\n" + "\n".join(rows) + "\n"


def _row(field: dataclasses.Field, kind: Any, meaning: str) -> str:
    name = field.metadata.get("keys", (field.name,))[0]
    cells = (f"`{name}`", _allowed(kind, field.metadata), _default(field), meaning)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _meanings(text: str) -> dict[str, str]:
    """name -> what the docstring's list of attributes says of it."""
    if "Attributes:" not in text:
        return {}
    body = inspect.cleandoc(text.split("Attributes:")[1])
    found, names = {}, []
    for line in body.splitlines():
        head = re.match(r"(\w+(?:, \w+)*): (.*)", line)
        if head and not line.startswith(" "):
            names = head[1].split(", ")
            found.update(dict.fromkeys(names, head[2]))
        elif not line.startswith(" ") and line:
            names = []
        else:
            found.update({name: f"{found[name]} {line.strip()}" for name in names})
    return found


def _allowed(kind: Any, rules: Any) -> str:
    plain = {float: "number", int: "whole number", bool: "true, false", str: "text"}
    if kind is type(None):
        return "null"
    if kind in (float, int):
        return f"{plain[kind]}{_range(rules)}"
    if kind in plain:
        return ", ".join(f'"{x}"' for x in rules["one_of"]) if "one_of" in rules else plain[kind]
    if dataclasses.is_dataclass(kind):
        name = typing.cast(type, kind).__name__
        return f"[{name}](#{name.lower()})"
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        return ", ".join(f'"{part}"' for part in parts)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_allowed(part, rules) for part in parts)
    if origin is tuple:
        if parts[-1] is Ellipsis:
            return f"list of {_allowed(parts[0], rules)}"
        if len(set(parts)) == 1:
            return f"{len(parts)} of: {_allowed(parts[0], rules)}"
        return "[" + ", ".join(_allowed(part, rules) for part in parts) + "]"
    if origin is dict:
        return f"object: name to {_allowed(parts[1], rules)}"
    raise ExtensionError(f"the page of fields does not know how to tell of {kind}")


def _range(rules: Any) -> str:
    low = f" above {rules['above']:g}" if "above" in rules else ""
    if not low and "least" in rules:
        low = f" from {rules['least']:g}"
    bounded = rules.get("most", LARGEST) < LARGEST
    return f"{low} to {rules['most']:g}" if bounded else low


def _default(field: dataclasses.Field) -> str:
    if field.default_factory is not dataclasses.MISSING:
        try:
            return f"`{_json(field.default_factory())}`"
        except InputError:
            return "see there"
    return "must be given" if field.default is dataclasses.MISSING else f"`{_json(field.default)}`"


def _json(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return f"[{', '.join(map(_json, value))}]"
    if dataclasses.is_dataclass(value):  # all of it its own defaults
        return f'{{"type": "{value.type}"}}' if hasattr(value, "type") else "{}"
    return "{}" if value == {} else f"{value:g}"


def _write(app: Sphinx) -> None:
    path, text = Path(app.srcdir) / "scene_fields.md", page()
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("builder-inited", _write)
    return {"parallel_read_safe": True}

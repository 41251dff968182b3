"""A page for each package's public names, made before the build, and counted after it.

A package's public names are those that its `__init__` passes on; where it passes nothing on, those
of its modules. What has no docstring, or is not on its built page, ends the build.
"""

import importlib
import inspect
import pkgutil
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

PACKAGES = {
    "jaxphys": "The names that `import jaxphys` gives",
    "jaxphys.scene": "Scenes, boundaries, cameras",
    "jaxphys.mpm": "The material point method",
    "jaxphys.mpm.boundaries": "Boundaries and obstacles",
    "jaxphys.mpm.stepping": "Time steps",
    "jaxphys.mpm.transfer": "Transfer",
    "jaxphys.gaussians": "Gaussians and their files",
    "jaxphys.render": "The renderer",
    "jaxphys.fitting": "Fitting",
    "jaxphys.export": "Formats of other programs",
    "jaxphys.problems": "Problems with known answers",
    "jaxphys.reconstruction": "Photographs to Gaussians",
    "jaxphys.accuracy": "How right a motion is",
    "jaxphys.pipeline": "Whole runs",
    "jaxphys.evaluate": "Scores",
    "jaxphys.guidance.diffusion": "Diffusion",
    "jaxphys.core": "Algebra and rules of differentiation",
}
FOLDER = "api"


@cache
def public_names(package: str) -> dict[str, Any]:
    """Home ("module.name") -> object, of all that a package passes on."""
    module = importlib.import_module(package)
    if package == "jaxphys":
        homes = vars(module)["_HOMES"]
        return {
            f"jaxphys.{home}.{name}": _at(f"jaxphys.{home}", name) for name, home in homes.items()
        }
    passed = {n: getattr(module, n) for n in _shown(vars(module)) if _is_ours(vars(module)[n])}
    found = {_home(x, n): x for n, x in passed.items() if _documented(x)}
    return found or _of_modules(module)


def _at(module: str, name: str) -> Any:
    return getattr(importlib.import_module(module), name)


def _of_modules(package: ModuleType) -> dict[str, Any]:
    found = {}
    for info in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        module = importlib.import_module(info.name)
        own = {n: x for n, x in vars(module).items() if getattr(x, "__module__", "") == info.name}
        found |= {f"{info.name}.{n}": own[n] for n in _shown(own) if _documented(own[n])}
    return found


def _shown(names: Any) -> list[str]:
    return [name for name in names if not name.startswith("_")]


def _is_ours(x: Any) -> bool:
    return getattr(x, "__module__", "").startswith("jaxphys")


def _documented(x: Any) -> bool:
    """Functions and classes. Constants and aliases of types are told of by what they belong to."""
    return inspect.isclass(x) or inspect.isroutine(x)


def _home(x: Any, name: str) -> str:
    return f"{x.__module__}.{name}"


def owner(home: str) -> str:
    """The package on whose page a public name is told of: the nearest one that passes it on."""
    around = [p for p in PACKAGES if home.startswith(f"{p}.") and home in public_names(p)]
    return max(around, key=len) if around else _first(home)


def _first(home: str) -> str:
    return next(package for package in PACKAGES if home in public_names(package))


def page(package: str, title: str) -> str:
    """The source of a package's page: its own names in full, others by links to theirs."""
    described = inspect.getdoc(importlib.import_module(package)) or ""
    names = public_names(package)
    own = [home for home in names if owner(home) == package]
    lines = [f"# `{package}`", "", f"{title}.", "", "```{eval-rst}"]
    if package != "jaxphys" and described:
        lines += ["::", "", *(f"    {line}" for line in described.splitlines()), ""]
    for home in sorted(set(names) - set(own), key=_last):
        role = "class" if inspect.isclass(names[home]) else "func"
        lines.append(f"- :py:{role}:`{_last(home)} <{home}>`")
    lines.append("")
    for home in sorted(own, key=_last):
        if inspect.isclass(names[home]):
            lines += [f".. autoclass:: {home}", "   :members:", ""]
        else:
            lines += [f".. autofunction:: {home}", ""]
    return "\n".join([*lines, "```", ""])


def _last(home: str) -> str:
    return home.rsplit(".", 1)[1]


def _plain_bars(app: Sphinx, what: str, name: str, x: Any, options: Any, lines: list[str]) -> None:
    """|x| is a size, no substitution."""
    for index, line in enumerate(lines):
        pieces = line.split("`")
        pieces[::2] = [piece.replace("|", "\\|") for piece in pieces[::2]]
        lines[index] = "`".join(pieces)


def undocumented() -> list[str]:
    """Homes of public names without a docstring of their own."""
    homes = {h: x for package in PACKAGES for h, x in public_names(package).items()}
    return sorted(h for h, x in homes.items() if not _own_docstring(x))


def _own_docstring(x: Any) -> bool:
    text = inspect.getdoc(x) if not inspect.isclass(x) else x.__dict__.get("__doc__")
    made = f"{getattr(x, '__name__', '')}("  # what dataclasses and tuples write by themselves
    return bool(text) and not text.startswith(made)


def _write(app: Sphinx) -> None:
    lacking = undocumented()
    if lacking:
        raise ExtensionError(f"public names without a docstring: {', '.join(lacking)}")
    folder = Path(app.srcdir) / FOLDER
    folder.mkdir(exist_ok=True)
    pages = {f"{package}.md": page(package, title) for package, title in PACKAGES.items()}
    listed = "\n".join(name.removesuffix(".md") for name in pages)
    rows = "\n".join(f"- [`{p}`]({p}.md): {title}." for p, title in PACKAGES.items())
    pages["index.md"] = (
        "# API\n\nEvery public name, with shapes, units, ranges and the errors that it raises.\n\n"
        f"{rows}\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"
    )
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def _count(app: Sphinx, failed: Exception | None) -> None:
    if failed or app.builder.name != "html":
        return
    for package in PACKAGES:
        built = (Path(app.outdir) / FOLDER / f"{package}.html").read_text()
        for home in public_names(package):
            shown = f'id="{home}"' if owner(home) == package else f'#{home}"'
            if shown not in built:
                raise ExtensionError(f"the page of {package} does not show {home}")


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("builder-inited", _write)
    app.connect("autodoc-process-docstring", _plain_bars)
    app.connect("build-finished", _count)
    return {"parallel_read_safe": True}

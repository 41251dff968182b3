"""Documents of HTML whose policy lets nothing in or out but what is named."""

import base64
import hashlib
import html
import json
from collections.abc import Mapping
from importlib.resources import files
from string import Template
from typing import Any

SCREEN = "width=device-width, initial-scale=1"
DOCUMENT = Template(
    """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="$policy">
<meta name="referrer" content="no-referrer">
<meta name="viewport" content="$screen">
<title>$title</title>
<style>$style</style>
</head>
<body>
$body
$script</body>
</html>
"""
)


def bundled(name: str, package: str = "jaxphys.page") -> str:
    """The text of a file that comes with a package."""
    return files(package).joinpath(name).read_text(encoding="utf-8")


def escaped(value: object) -> str:
    """A value as text of an element or of a quoted attribute."""
    return html.escape(str(value), quote=True)


def as_data(value: Any) -> str:
    """JSON that may stand in a script element of data: no character of it can end the element."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def data_element(name: str, kind: str, content: str) -> str:
    """A script element that is not run, with content of `as_data` or in base64.

    Args:
        name: its id.
        kind: "application/json" or "application/octet-stream".
        content: without a "<".
    """
    if "<" in content:
        raise ValueError(f"{name}: holds a '<', which could end its element")
    return f'<script type="{escaped(kind)}" id="{escaped(name)}">{content}</script>\n'


def document(
    title: str,
    body: str,
    *,
    style: str = "",
    script: str = "",
    allowed: Mapping[str, str] | None = None,
) -> str:
    """A document in which only this style and this script count, and `allowed` is loaded.

    Args:
        title: plain text.
        body: HTML.
        style, script: the whole of both; run by their SHA-256, so that nothing that got into the
            body by mistake is.
        allowed: sources by directive of the Content Security Policy, such as {"img-src": "data:"}.
    """
    if "</script" in script or "</style" in style:
        raise ValueError("a script or a style would end its own element")
    policy = {"default-src": "'none'", "base-uri": "'none'", "form-action": "'none'"}
    if style:
        policy["style-src"] = _hashed(style)
    if script:
        policy["script-src"] = _hashed(script)
    policy.update(allowed or {})
    return DOCUMENT.substitute(
        policy=escaped("; ".join(f"{name} {source}" for name, source in policy.items())),
        screen=SCREEN,
        title=escaped(title),
        style=style,
        body=body,
        script=f"<script>{script}</script>\n" if script else "",
    )


def _hashed(source: str) -> str:
    digest = hashlib.sha256(source.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"

"""Links from a page to files of the repository that are no pages become their paths."""

import re
from pathlib import Path

from sphinx.application import Sphinx

LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(((?!https?:|#)[^)#\s]+)(#[^)]*)?\)")


def _shorten(app: Sphinx, document: str, source: list[str]) -> None:
    here = Path(app.env.doc2path(document)).parent
    root = Path(app.srcdir)

    def replaced(match: re.Match) -> str:
        text, target = match[1], (here / match[2]).resolve()
        if target.is_relative_to(root) and target.suffix in (".md", ".py", ".png", ".jpg", ".svg"):
            return match[0]
        if not target.exists():
            return match[0]  # left to Sphinx, which warns
        return f"{text} (`{target.relative_to(root.parent)}`)"

    source[0] = LINK.sub(replaced, source[0])


def setup(app: Sphinx) -> dict:
    """Called by Sphinx."""
    app.connect("source-read", _shorten)
    return {"parallel_read_safe": True}

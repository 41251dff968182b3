"""Paths of code that documents name are there: in the repository or in the package."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_paths_of_code_are_there(document):
    named = set(re.findall(r"`((?:[a-z_]+/)+[a-z_0-9]+\.py)`", document.read_text()))
    missing = [
        path for path in named if not any((r / path).exists() for r in (ROOT, ROOT / "jaxphys"))
    ]
    assert not missing


def test_some_paths_are_found():
    assert "`mpm/loop/one_pass.py`" in (ROOT / "docs" / "paper.md").read_text()

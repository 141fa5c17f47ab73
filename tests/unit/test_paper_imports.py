"""What is about the paper alone uses what the package offers, and nothing inside its rooms."""

import ast
from importlib import import_module
from pathlib import Path

import pytest

PAPER = Path(__file__).parents[2] / "studies" / "paper"


@pytest.mark.parametrize("path", sorted(PAPER.glob("*.py")), ids=lambda path: path.stem)
def test_paper_imports_public_names_only(path):
    found = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.ImportFrom)]
    for node in found:
        if node.module and node.module.split(".")[0] == "cellmech":
            assert {alias.name for alias in node.names} <= set(import_module(node.module).__all__), node.module

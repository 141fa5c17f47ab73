"""What a number depends on: the modules that solving a case imports, and no others."""

import ast

import pytest

from cellmech import sources
from cellmech.results.archive import SOLVER, source_hash
from cellmech.sources import PACKAGE, hash_behind, modules_behind

FILES = {
    "__init__.py": "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from house.talk import say\n\nx = 1\n",
    "solver.py": "from house.rooms import (\n    equations,  # a comment, with a comma\n    numbers as n,\n)\n",
    "rooms/__init__.py": '"""A room."""\n',
    "rooms/equations.py": "def f():\n    from house.rooms.deep.constants import g\n",
    "rooms/numbers.py": "import house.limits, math\n",
    "rooms/deep/__init__.py": "",
    "rooms/deep/constants.py": "g = 9.81\n",
    "rooms/unused.py": "g = 10\n",
    "limits.py": "from house.solver import f\n",
    "talk.py": "from house.solver import f\n\nHELP = 'be quiet'\n",
}
BEHIND = [
    "",
    ".limits",
    ".rooms",
    ".rooms.deep",
    ".rooms.deep.constants",
    ".rooms.equations",
    ".rooms.numbers",
    ".solver",
]


@pytest.fixture
def house(tmp_path):
    for name, text in FILES.items():
        path = tmp_path / "house" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "house"


def test_modules_behind_one_are_what_it_imports_in_any_way_and_folder(house):
    assert list(modules_behind("house.solver", house)) == [f"house{name}" for name in BEHIND]
    assert list(modules_behind("house.talk", house)) == sorted([f"house{name}" for name in [*BEHIND, ".talk"]])


@pytest.mark.parametrize(
    ("changed", "matters"),
    [
        ("rooms/deep/constants.py", True),
        ("rooms/__init__.py", True),
        ("limits.py", True),
        ("talk.py", False),
        ("rooms/unused.py", False),
    ],
)
def test_hash_follows_what_numbers_depend_on_alone(house, monkeypatch, changed, matters):
    monkeypatch.setattr(sources, "PACKAGE", house)
    monkeypatch.setattr(modules_behind, "__defaults__", (house,))
    before = hash_behind.__wrapped__("house.solver")
    with open(house / changed, "a") as stream:
        stream.write("# another word\n")
    assert (hash_behind.__wrapped__("house.solver") != before) is matters


def test_folder_made_tomorrow_is_followed(house):
    (house / "attic").mkdir()
    (house / "attic" / "springs.py").write_text("k = 2\n")
    with open(house / "limits.py", "a") as stream:
        stream.write("from house.attic import springs\n")
    assert "house.attic.springs" in modules_behind("house.solver", house)


def test_words_of_the_command_line_and_figures_do_not_bring_a_result_to_be_solved_again():
    behind = modules_behind(SOLVER)
    told = {"command", "progress", "plots", "study", "sweep", "display"}
    assert not [name for name in behind if name.rpartition(".")[2] in told]
    assert not [name for name in behind if name.startswith(("cellmech.figures", "studies"))]
    for needed in (
        "kinematics",
        "laws",
        "contact",
        "balance",
        "newton",
        "time_steps",
        "observables",
        "geometry",
        "bdf",
    ):
        assert [name for name in behind if name.rpartition(".")[2] == needed], needed
    assert len(source_hash()) == 64


def test_modules_are_those_that_python_itself_finds():
    """The text is searched for imports; Python's own parser finds the same ones."""
    behind = modules_behind(SOLVER)
    for name, path in behind.items():
        text = path.read_text()
        found, unread = set(), set()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                unread |= {id(inner) for statement in node.body for inner in ast.walk(statement)}
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cellmech"):
                found |= {f"{node.module}.{alias.name}" for alias in node.names if id(node) not in unread}
            elif isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names if alias.name.startswith("cellmech")}
        assert found <= set(sources._imports(text, PACKAGE.name)), name

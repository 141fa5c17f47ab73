"""What the pages say is there is there: links, commands, options, scenes, code, keys, columns and messages."""

from __future__ import annotations

import argparse
import ast
import json
import math
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any

import pytest
from pages import PAGES, ROOT, Page

import cellmech
from cellmech.errors import InputError
from cellmech.figures import commands, plots
from cellmech.figures.reference import read_references
from cellmech.results.records import flatten
from cellmech.runs import fit_command, new
from cellmech.runs.command import parser
from cellmech.scene.files import read_scene
from cellmech.scene.keys import KNOWN, LISTS, STUDY_TABLES, is_known
from cellmech.scene.studies import load_study

sys.path.insert(0, str(ROOT / "tools"))
import scene_reference

COARSE = 'time={"history": False}, mesh={"size_um": 8.0}'
OF_OPEN_MPI = {"--allow-run-as-root", "--oversubscribe"}
VARIABLES = {"N", "RESULTS", "SETTINGS", "ARGS"}
REGIONS = ("nucleus", "nucleoplasm", "lamina", "cytosol", "membrane", "cell")
pages = pytest.mark.parametrize("page", [Page(name) for name in PAGES], ids=PAGES)


@pages
def test_links_and_anchors_lead_somewhere(page):
    for target in page.targets():
        if re.match(r"https?://", target):
            continue
        name, _, anchor = target.partition("#")
        path = (page.path.parent / name).resolve() if name else page.path
        assert path.is_file(), target
        assert not anchor or anchor in Page(path.relative_to(ROOT).as_posix()).anchors(), target


@pages
def test_included_parts_are_found(page):
    for token in page.tokens():
        if token.type == "fence" and token.info.startswith("{include}"):
            text = (page.path.parent / token.info.split()[1]).read_text(encoding="utf-8")
            marks = re.findall(r':(?:start-after|end-before): "(.*)"', token.content)
            assert marks and all(text.count(f"{mark}\n") + text.count(f"{mark}:") == 1 for mark in marks), marks
            assert text.index(marks[0]) <= text.index(marks[-1])


@pages
def test_every_scene_is_read(page, tmp_path):
    around = (2 * math.pi * k / 40 for k in range(40))
    (tmp_path / "nucleus.csv").write_text("".join(f"{5 * math.cos(a)},{4 * math.sin(a)}\n" for a in around))
    for number, block in enumerate(page.blocks("toml")):
        path = tmp_path / f"block{number}.toml"
        path.write_text(block, encoding="utf-8")
        of_references = "[case." in block  # a study has [[case]]
        assert read_references(path).numbers if of_references else load_study(path).cases


@cache
def make_targets() -> set[str]:
    lines = (ROOT / "Makefile").read_text(encoding="utf-8").splitlines()
    return {word for line in lines if (found := re.match(r"([a-z0-9 -]+):(?!=)", line)) for word in found[1].split()}


@pages
def test_commands_name_what_there_is(page):
    for command in page.commands():
        check_command(command, page)


def check_command(words: list[str], page: Page) -> None:
    """Targets, modules, options, keys and files of a command exist."""
    if words[0] == "mpirun":
        words = words[words.index("-n") + 2 :] if "-n" in words else words[2:]
    if not words:
        return
    if words[0] == "make":
        goals = [word for word in words[1:] if "=" not in word]
        assert set(goals) <= make_targets(), words
        assert {word.partition("=")[0] for word in words[1:] if "=" in word} <= VARIABLES, words
        return
    if words[0] == "sbatch":
        assert (ROOT / words[1]).is_file() and (ROOT / words[2]).is_file(), words
        return
    if words[1:3] == ["-m", "cellmech"]:
        words = ["cellmech", *words[3:]]
    if words[0] in (".venv/bin/cellmech", "cellmech"):
        if words[1:2] in ([], ["COMMAND"]):
            return
        words = ["python", "-m", f"cellmech {words[1]}", *words[2:]]
    assert words[0] in (".venv/bin/python", "python"), words
    if words[1] != "-m":
        assert words[1] == "-c" or (ROOT / words[1]).is_file(), words
        return
    module, arguments = words[2], words[3:]
    readers = {
        "cellmech.study": lambda: parser().parse_intermixed_args(arguments),
        "cellmech.plots": lambda: plots._parser().parse_args(arguments),
        "cellmech.report": lambda: commands.report_parser().parse_args(arguments),
        "cellmech.compare": lambda: commands.compare_parser().parse_args(arguments),
        "cellmech new": lambda: new.parser().parse_args(arguments),
        "cellmech fit": lambda: fit_command.parser().parse_intermixed_args(arguments),
        "studies.paper": lambda: import_module("studies.paper.__main__")._parser().parse_args(arguments),
    }
    same = {"check": "study", "run": "study", "plot": "plots", "report": "report", "compare": "compare"}
    readers |= {f"cellmech {name}": readers[f"cellmech.{other}"] for name, other in same.items()}
    try:
        options = readers[module]()
    except (SystemExit, InputError) as error:
        raise AssertionError(f"{page.name}: {words}: {error}") from None
    check_files_and_keys(options, page)


def check_files_and_keys(options: argparse.Namespace, page: Page) -> None:
    sets = [many if isinstance(many, list) else [many] for many in getattr(options, "set", [])]
    keys = [text.partition("=")[0] for many in [*sets, getattr(options, "free", [])] for text in many if "=" in text]
    shown_as_wrong = {key for key in keys if f"--set: {key}: unknown key" in page.text}
    assert all(is_known(key) for key in set(keys) - shown_as_wrong), keys
    named = [*getattr(options, "study", [])] if isinstance(getattr(options, "study", []), list) else [options.study]
    for path in map(str, [*named, *filter(None, [getattr(options, "scene", None)])]):
        assert (ROOT / path).is_file() or f"`{path}`" in page.text, path


@pages
def test_options_exist(page):
    parsers = (parser(), commands.report_parser(), new.parser(), fit_command.parser())
    actions = [action for one in parsers for action in one._actions]
    known = {option for action in actions for option in action.option_strings} | OF_OPEN_MPI
    known |= {"--stem", "--case", "--field", "--magnify", "--ladder", "--keep-going"}
    for span in page.spans():
        for option in re.findall(r"(?<!\S)--[a-z][a-z-]*", span):
            if span.startswith("--"):
                assert option in known, span


@pages
def test_files_and_names_of_the_program_exist(page):
    modules = {path.name for path in (ROOT / "cellmech").rglob("*.py")}
    for span in page.spans():
        if re.fullmatch(r"(benchmarks|studies|tests|tools|docs|cellmech|meshes)/[\w/.-]*", span):
            assert (ROOT / span).exists(), span
        elif re.fullmatch(r"\w+\.py", span):
            assert span in modules or (page.path.parent / span).is_file(), span
        elif re.fullmatch(r"cellmech(\.\w+)+", span):
            assert resolved(span) is not None, span


def resolved(dotted: str) -> object:
    """What a dotted name stands for."""
    module, *names = dotted.split(".")
    found: object = import_module(module)
    for name in names:
        try:
            found = getattr(found, name)
        except AttributeError:
            assert hasattr(found, "__path__"), f"{dotted}: no {name}"
            found = import_module(f"{found.__name__}.{name}")
    return found


RUN_ELSEWHERE = "docs/adding.md"  # in test_library
WITH_CODE = [name for name in PAGES if Page(name).blocks("python") and name != RUN_ELSEWHERE]


def test_pages_with_code_are_those_we_know():
    assert WITH_CODE == ["docs/array.md", "docs/library.md", "docs/tutorial.md"]


@pytest.mark.parametrize("name", WITH_CODE)
def test_code_runs(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in Page(name).blocks("python"):
        code = block.replace('time={"history": False}', COARSE)
        assert COARSE in code
        exec(compile(code, name, "exec"), names)
    assert float(capsys.readouterr().out.split()[0]) > 0


def test_tutorial_shows_what_the_program_answers(tmp_path):
    """Its checks and refusals; the numbers may be those of another mesh generator."""
    page, compared = Page("docs/tutorial.md"), 0
    for file, text in zip(("my.toml", "measured.toml", "sweep.toml"), page.blocks("toml"), strict=True):
        (tmp_path / file).write_text(text, encoding="utf-8")
    for block in page.blocks("console"):
        for command, shown in re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", block, flags=re.MULTILINE):
            if "--check" in command or "cellmech: error" in shown:
                words = [sys.executable, *command.split()[1:]]
                done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
                answer = iter(masked(done.stdout + done.stderr).splitlines())
                assert all(line in answer for line in masked(shown).splitlines() if line.strip() != "…"), done
                compared += 1
    assert compared == 2


def masked(text: str) -> str:
    return re.sub(r"\d[\d,.]*", "#", text)


def test_scene_page_is_up_to_date():
    text = scene_reference.PAGE.read_text(encoding="utf-8")
    assert scene_reference.page(text) == text, "python tools/scene_reference.py writes it anew"


def rows_of_scene_page() -> Iterator[tuple[str, list[str]]]:
    """Dotted key and cells of every row, of an array of tables with the number 0, a layer's once for each layer."""
    tables: list[str] = []
    keys = scene_reference.reference().partition("## Constants of the laws")[0]
    for line in keys.splitlines():
        if line.startswith("## "):
            tables = [""] if line == "## At the top" else re.findall(r"`\[+([\w.]+)\]+`", line)
        elif line.startswith("| `"):
            cells = [cell.strip() for cell in line.strip("|").split(" | ")]
            for table in tables:
                number = "0." if table in LISTS else ""
                yield f"{table}.{number}".lstrip(".") + cells[0].strip("`"), cells


def test_scene_page_has_every_key_with_a_meaning():
    rows = dict(rows_of_scene_page())
    tables = {known.rpartition(".")[0] for known in KNOWN} | {"layer"} - {""}
    constants = {known for known in KNOWN if known.rpartition(".")[0].endswith("constants")}
    tables = {table for table in tables if not table.endswith("constants")}
    assert rows.keys() | constants == {key for key in KNOWN if key not in tables or key == "flat"} - set(
        STUDY_TABLES
    ) | set(LISTS)
    assert all(len(cells) == 6 and all(cells) for cells in rows.values())
    assert not [key for key, cells in rows.items() if not cells[-1].endswith(".")]


def test_scene_page_states_the_rules_that_are_applied():
    checked = 0
    for key, (_, kind, unit, allowed, _, _) in rows_of_scene_page():
        if kind not in ("number", "whole number", "text"):
            continue
        data: object = object()
        for part in reversed(key.split(".")):
            data = [data] if part == "0" else {part: data}
        with pytest.raises(InputError) as refused:
            read_scene(data, "scene")
        for word in re.findall(r"[\w.+-]+", allowed.replace("`", "").replace('"', "")):
            assert re.search(rf"(?<![\w.]){re.escape(word)}(?![\w])", refused.value.rule), (key, word)
        assert unit == "–" or f" {unit} " in f"{refused.value.rule} ", key
        checked += 1
    assert checked > 50


def test_every_column_of_a_result_is_explained(tmp_path):
    explained = set()
    for geometry in ("plane", "axisymmetric"):
        driven = {"adhesion": {"work_uJ_m2": 0.01}, "actin": ({"stress_Pa": 0.1},)}
        tables = {"cell": {"geometry": geometry}, "mesh": {"size_um": 8.0}, "time": {"history": False}, **driven}
        scene = cellmech.Scene(**tables)
        explained |= explained_names(cellmech.solve(scene, tmp_path / geometry).result)
    later = {"error", "accuracy", "own", "energy.kinetic", "energy.drag_work", "contact.area_um2"}  # of other runs
    tables = r"(contact|energy|shape_index|nucleus_shape|share\w+|stability)\."
    in_space = {"nucleus_shape.depth_um", "contact.slide_z_um"}
    assert {span for span in names_of_numbers() if re.match(tables, span)} - later <= explained | in_space


def explained_names(result):
    """The names in a result, each of which the page must explain."""
    spans = names_of_numbers()
    patterns = [re.compile(re.escape(span).replace("…", r"\w+")) for span in spans]
    numbers = {key.removesuffix(".x").removesuffix(".y") for key in flatten(result)}
    named = numbers | {key for key in result if key not in REGIONS} | {f"model.{key}" for key in result["model"]}
    known = set()
    for key in sorted(named):
        region, _, rest = key.partition(".")
        name = rest if rest and region in (*REGIONS, "model", "mesh_quality") else key
        name = re.sub(r"^cells_\w+", "cells_<layer>", name)
        if isinstance(result.get(name), dict) and f"`{name}." in Page("docs/files.md").text:
            continue  # its numbers have rows of their own
        assert any(pattern.fullmatch(name) for pattern in patterns), key
        known.add(name)
    known |= {f"nucleus_shape.{key}" for key in result["nucleus_shape"]}
    known |= {f"stability.{key}" for key in result["stability"]}
    return known | {f"stability.in_space.{key}" for key in result["stability"]["in_space"]}


def names_of_numbers() -> list[str]:
    """The names in the first column of the tables about result.json; `.J2` goes on from the name before it."""
    text = Page("docs/files.md").text
    part = text[text.index("## Numbers of result.json") : text.index("## Fields")]
    found: list[str] = []
    for line in part.splitlines():
        if line.startswith("| `"):
            first, *others = line.strip("|").split(" | ")
            for name in re.findall(r"`([^`]+)`", first):
                found.append(found[-1].rpartition(".")[0] + name if name.startswith(".") else name)
            found += re.findall(r"`([^`]+)`", others[-1])
    return found


@cache
def texts_of_the_program() -> str:
    """All texts in the source, an f-string's up to its next value, and what the set-up says."""
    found = [(ROOT / "tools" / "setup.sh").read_text(encoding="utf-8")]
    for path in (ROOT / "cellmech").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found += [
            node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)
        ]
    return "\n".join(found)


def test_failure_messages_are_the_programs():
    messages = [found[1] for heading in Page("docs/faq.md").headings() if (found := re.fullmatch(r"`(.*)`", heading))]
    assert len(messages) > 35
    for message in messages:
        if message.startswith(("mpirun has", "There are not enough", "The application appears")):
            continue  # Open MPI's
        for piece in message.split("…"):
            assert piece.strip(" :;()") in texts_of_the_program(), message


def test_citation_and_changelog_know_the_version():
    assert cited("version") == project()["version"] == cellmech.__version__
    heading = f"## {cellmech.__version__} - {cited('date-released')}"
    assert heading in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()


def cited(key: str) -> str | None:
    """A field of CITATION.cff on its top level; None if it has none."""
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    found = re.search(rf'^{key}: *"?([^"\n]+?)"?$', text, re.MULTILINE)
    return found and found[1]


def project() -> dict[str, Any]:
    """The table of that name in pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_address_of_the_project_is_the_same_wherever_it_is_told():
    """`Repository` of [project.urls] in pyproject.toml; there is none yet, and then none is told anywhere."""
    address = project().get("urls", {}).get("Repository")
    assert cited("repository-code") == address
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        told = re.findall(r"git clone (\S+)", page.read_text(encoding="utf-8"))
        assert all(one == address for one in told), f"{page.name}: {told}"


def test_example_notebook_runs(tmp_path, monkeypatch, capsys):
    """Cell by cell; it keeps no results, which `make docs` computes anew."""
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((ROOT / "docs/example.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    codes = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(codes) >= 4 and not any(cell["outputs"] or cell["execution_count"] for cell in codes)
    for cell in codes:
        exec(compile("".join(cell["source"]).replace('"size_um": 4.0', '"size_um": 8.0'), "example", "exec"), names)
    assert "Did you mean nucleus.J1_max" in capsys.readouterr().out
    assert len(names["stresses"]) == 3 and len(set(names["stresses"].values())) == 3

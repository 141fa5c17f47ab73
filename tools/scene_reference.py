"""The reference of the scene file's keys, `docs/scene.md`, from the schema: what is allowed, the default, the meaning.

    python tools/scene_reference.py

rewrites the part of the page between its two marks; `make docs` does so, and a test fails where it is out of date.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args, get_origin

from cellmech.mechanics.laws import LAWS
from cellmech.scene.keys import LISTS
from cellmech.scene.parts import LAYER_NAMES, Layers, Table
from cellmech.scene.scene import Scene
from cellmech.scene.value_types import Choice, Constants, Flag, Line, Number, Pair, Whole

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scene.md"
BEGIN, END = "<!-- keys: from the schema -->", "<!-- keys: end -->"
HEAD = ("key", "type", "unit", "allowed", "default", "meaning")
NONE = "–"


def reference() -> str:
    """All tables of the scene file as Markdown, the keys at its top first."""
    tree = Scene.model_fields
    inner = {name: table_in(field.annotation) for name, field in tree.items()}
    top = [name for name, table in inner.items() if table is None or name in (*LISTS, "flat")]
    parts = [section("At the top", [rows([Scene], name) for name in top])]
    for name, table in inner.items():
        if table is None:
            continue
        if table is Layers:
            layers = [type(getattr(Layers(), layer)) for layer in LAYER_NAMES]
            heading = ", ".join(f"`[layer.{layer}]`" for layer in LAYER_NAMES)
            keys = [rows(layers, key) for key in layers[0].model_fields]
            parts.append(section(heading, keys, "Defaults that differ are in the order of the heading."))
        else:
            heading = f"`[[{name}]]`" if name in LISTS else f"`[{name}]`"
            parts.append(section(heading, [rows([table], key) for key in table.model_fields]))
    return "\n".join([*parts, laws()])


def laws() -> str:
    """The laws and the constants that each has besides its moduli."""
    lines = ["| law | constant | default | allowed | meaning |", "|---|---|---|---|---|"]
    for name, law in LAWS.items():
        if not law.constants:
            lines.append(f"| `{name}` | {NONE} | | | |")
        for constant in law.constants.values():
            allowed = constant.allowed.replace(">=", "≥").replace("<=", "≤")
            default = f"`cell.{constant.cell_key}`" if constant.cell_key else f"`{constant.default:g}`"
            lines.append(f"| `{name}` | `{constant.key}` | {default} | {allowed} | {constant.meaning} |")
    text = "Set in `[cell.constants]` for all layers, or in `[layer.<name>.constants]` for one.\n"
    return "\n".join(["## Constants of the laws\n", text, *lines, ""])


def section(heading: str, cells: Sequence[Sequence[str]], note: str = "") -> str:
    """A heading and its table, padded so that it reads well as text."""
    lines = [HEAD, *cells]
    widths = [max(len(line[k]) for line in lines) for k in range(len(HEAD))]
    table = ["| " + " | ".join(text.ljust(w) for text, w in zip(line, widths, strict=True)) + " |" for line in lines]
    table.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
    return "\n".join([f"## {heading}\n", *([f"{note}\n"] if note else []), *table, ""])


def rows(tables: Sequence[type[Table]], key: str) -> tuple[str, ...]:
    """The cells of a key that one table has, or several with other defaults."""
    field = tables[0].model_fields[key]
    kind, unit, allowed = rule(field)
    defaults = [shown(table.model_fields[key].default) for table in tables]
    default = " / ".join(defaults if len(set(defaults)) > 1 else defaults[:1])
    return f"`{field.alias or key}`", kind, unit, allowed, default, meanings(tables[0])[key]


def rule(field: Any) -> tuple[str, str, str]:
    """Type, unit and what is allowed, from the check that the schema applies."""
    check = next(checks(field.metadata, field.annotation), None)
    if isinstance(check, Number | Pair):
        pair, check = isinstance(check, Pair), check.number if isinstance(check, Pair) else check
        words = check.rule.removeprefix("must be a finite number ").replace(check.unit or "\0", "")
        numbers = "list of numbers" if get_origin(field.annotation) is tuple else "number"
        numbers = "two numbers" if pair else numbers
        words = " ".join(words.split()).replace(">=", "≥").replace("<=", "≤")
        return numbers, NONE if check.unit in ("", "(no unit)") else check.unit, words
    if isinstance(check, Whole):
        only = check.least == check.most
        words = "".join(f', `"{word}"`' for word in check.words)
        return "whole number", NONE, f"{check.least}" if only else f"{check.least} to {check.most}{words}"
    if isinstance(check, Flag):
        return "switch", NONE, ", ".join(["`true`", "`false`", *(f'`"{word}"`' for word in check.words)])
    if isinstance(check, Choice):
        kind = "list of words" if get_origin(field.annotation) is tuple else "text"
        return kind, NONE, ", ".join(f'`"{word}"`' for word in words_of(field.annotation))
    if isinstance(check, Line):
        return "text", NONE, f"one line, at most {check.most} characters"
    if isinstance(check, Constants):
        return "table", NONE, "constants of the law (below)"
    if get_origin(field.annotation) is tuple:
        return "tables", NONE, "any number"
    return "table", NONE, "a table, or `false`"


def checks(metadata: Sequence[Any], annotation: Any) -> Iterator[Any]:
    """The checks of a key, which stand beside its type or beside a member of it."""
    yield from (one for one in metadata if isinstance(one, Number | Pair | Whole | Flag | Choice | Line | Constants))
    for member in get_args(annotation):
        yield from checks(getattr(member, "__metadata__", ()), member)


def words_of(annotation: Any) -> tuple[str, ...]:
    """The strings of the `Literal` in a type."""
    members = get_args(annotation)
    words = tuple(member for member in members if isinstance(member, str))
    return words or next((found for member in members if (found := words_of(member))), ())


def shown(default: Any) -> str:
    """A default as one would write it in the file."""
    if default is None:
        return NONE
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, Table) or (isinstance(default, tuple) and any(isinstance(one, Table) for one in default)):
        return "Table 1's"
    if isinstance(default, tuple):
        return f"`{list(default)}`"
    return f'`"{default}"`' if isinstance(default, str) else f"`{default!r}`"


@cache
def meanings(table: type[Table]) -> dict[str, str]:
    """Key -> the text below it in the source, its own or that of the class it comes from."""
    found: dict[str, str] = {}
    for kind in reversed([one for one in table.__mro__ if issubclass(one, Table) and one is not Table]):
        body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # type: ignore[attr-defined]
        for line, below in pairwise(body):
            if isinstance(line, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(line.target, ast.Name):
                found[line.target.id] = ast.literal_eval(below.value)
    return found


def table_in(annotation: Any) -> type[Table] | None:
    """The table that a type is made of, None for a plain value."""
    if inspect.isclass(annotation) and issubclass(annotation, Table):
        return annotation
    return next((found for member in get_args(annotation) if (found := table_in(member))), None)


def page(text: str) -> str:
    """The page with the part between its marks made anew."""
    before, _, rest = text.partition(BEGIN)
    _, mark, after = rest.partition(END)
    if not mark:
        raise ValueError(f"{PAGE.name} must have {BEGIN} and, below it, {END}")
    return f"{before}{BEGIN}\n\n{reference()}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

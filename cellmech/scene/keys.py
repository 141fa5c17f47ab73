"""The known dotted keys of a scene file: looking one up, setting one, naming the nearest to a wrong one."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from inspect import isclass
from typing import Any, get_args

from cellmech.errors import InputError, cut
from cellmech.mechanics.laws import LAWS
from cellmech.scene.parts import Table
from cellmech.scene.scene import Scene

CONSTANTS: dict[str, Any] = {constant.key: {} for law in LAWS.values() for constant in law.constants.values()}
LISTS = ("pillar", "actin")  # arrays of tables, with an index in their dotted keys
STUDY_TABLES = ("sweep", "case", "accuracy")  # keys of a study file that are no part of a scene


def _tree(table: type[Table]) -> dict[str, Any]:
    """Key -> tree of the table it holds, {} for a plain value."""
    tree = {}
    for name, field in table.model_fields.items():
        inner = _table_in(field.annotation)
        tree[field.alias or name] = _tree(inner) if inner else dict(CONSTANTS) if name == "constants" else {}
    return tree


def _table_in(annotation: object) -> type[Table] | None:
    if isclass(annotation) and issubclass(annotation, Table):
        return annotation
    return next((found for arg in get_args(annotation) if (found := _table_in(arg))), None)


KEYS = _tree(Scene)


def _dotted(tree: Mapping[str, Any], start: str = "") -> Iterator[str]:
    for key, inner in tree.items():
        yield start + key
        yield from _dotted(inner, start + key + (".0." if start + key in LISTS else "."))


KNOWN = (*_dotted(KEYS), *STUDY_TABLES)


def is_known(key: str) -> bool:
    """True if a dotted key is one of a scene's, a pillar's or actin's with its index."""
    parts = key.split(".")
    if parts[0] in LISTS and len(parts) > 1:
        if not (parts[1].isascii() and parts[1].isdigit()):
            return False
        parts[1] = "0"
    return ".".join(parts) in KNOWN and parts[0] not in STUDY_TABLES


def nearest(key: str) -> str:
    """A sentence that names the known key closest to a wrong one, "" when none is close."""
    parts = key.split(".")
    if len(key) > 200:
        return ""
    if is_known(key):
        return f"The dot must be outside the quotes: [{'.'.join(parts[:-1])}] {parts[-1]} = …"
    index = parts[1] if parts[0] in LISTS and len(parts) > 2 and parts[1].isdigit() else "0"
    known = [found for name in KNOWN if (found := name.replace(f"{parts[0]}.0.", f"{parts[0]}.{index}.")) != key]
    score = {name: likeness(key, name) for name in known}
    best = max(score.values())
    if best < 0.6:
        table = key.rpartition(".")[0]
        members = [name.removeprefix(f"{table}.") for name in known if name.rpartition(".")[0] == table and table]
        return f"[{table}] has {', '.join(members)}." if members else ""
    return f"Did you mean {' or '.join(name for name in known if score[name] > best - 0.02)}?"


def likeness(wrong: str, known: str) -> float:
    """1 for equal last words; then the tables decide, with less weight."""
    (wrong_table, _, wrong_word), (table, _, word) = wrong.lower().rpartition("."), known.lower().rpartition(".")
    words = difflib.SequenceMatcher(None, wrong_word, word).ratio()
    # a key that names no table is only a little more likely one of the top
    tables = difflib.SequenceMatcher(None, wrong_table, table).ratio() if wrong_table else 1.0 - 0.2 * bool(table)
    return words + 0.4 * (tables - 1.0)


def check_tables(data: Mapping[str, Any], where: str) -> None:
    """Refuse a plain value where a table belongs, so that keys can be set below it.

    Raises:
        InputError: naming the key that must be a table.
    """
    for key, tree in KEYS.items():
        if key not in data or not tree or (key == "flat" and not isinstance(data[key], dict)):
            continue
        if key in LISTS:
            if not isinstance(data[key], list) or not all(isinstance(entry, dict) for entry in data[key]):
                hint = f"Write [[{key}]] for each, or {key} = [] for none."
                raise InputError(where, key, "must be an array of tables", brief(data[key]), hint)
            continue
        _check_table(data[key], tree, key, where)


def _check_table(value: object, tree: Mapping[str, Any], key: str, where: str) -> None:
    if not isinstance(value, dict):
        hint = f"Write [{key}] and below it its keys: {', '.join(tree)}."
        raise InputError(where, key, "must be a table", brief(value), hint)
    for name in tree:
        if tree[name] and name in value:
            _check_table(value[name], tree[name], f"{key}.{name}", where)


def put(data: dict[str, Any], key: str, value: object, where: str) -> None:
    """Set a dotted key in the data of a file whose tables are sound (`check_tables`).

    Pillars are counted from 0; a file that names none has Table 1's, or none beside an array. Setting flat.y_um
    brings a flat back.

    Raises:
        InputError: for an unknown key, a pillar that is not there, a plain value in place of a table.
    """
    if not is_known(key):
        raise unknown(where, key, value)
    target, parts = data, key.split(".")
    if parts[0] in LISTS and len(parts) > 1:
        target, parts = _listed(data, parts, where), parts[2:]
    for part in parts[:-1]:
        if not isinstance(target.get(part), dict):
            target[part] = {}
        target = target[part]
    target[parts[-1]] = value
    if any(known.startswith(f"{key}.") for known in KNOWN):
        check_tables(data, where)  # the next key may be set below this one


def _listed(data: dict[str, Any], parts: list[str], where: str) -> dict[str, Any]:
    """The table of that index in an array of tables."""
    name, index = parts[:2]
    first: list[dict[str, Any]] = [{}] if name == "pillar" and "array" not in data else []
    tables = data.setdefault(name, first)
    if len(index) > 9 or int(index) >= len(tables):
        what = "pillar" if name == "pillar" else f"[[{name}]]"
        many = "are no pillars" if name == "pillar" else f"is no [[{name}]]"
        number = many if not tables else f"is no {what} {index[:9]}, only 0 to {len(tables) - 1}"
        raise InputError(where, cut(".".join(parts)), f"there {number}", None, f"Write [[{name}]] to add one.")
    entry: dict[str, Any] = tables[int(index)]
    return entry


def unknown(where: str, key: str, value: object) -> InputError:
    """The error for a key that no scene has, with the nearest one that exists."""
    return InputError(where, cut(key), "unknown key", brief(value), nearest(key))


def brief(value: object) -> object:
    """The value for a message, cut short when it would fill the screen."""
    text = repr(value)
    return value if text == cut(text) else cut(text)

"""A scene in and out: from the data of a TOML file with one clear error, to TOML that runs again, to a hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import tomli_w
from pydantic import ValidationError
from pydantic_core import ErrorDetails

from cellmech.errors import InputError
from cellmech.scene.driver_parts import Medium
from cellmech.scene.keys import brief, check_tables, unknown
from cellmech.scene.outline_points import with_points
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.scene import Scene


def read_scene(data: Mapping[str, Any], where: str) -> Scene:
    """The scene that the data of a TOML file describe; what they leave out is Table 1's.

    Args:
        data: the file's content without its `sweep` and `case`.
        where: the file's name as the user typed it, for messages.

    Raises:
        InputError: for the first rule that is broken, a misspelt key before anything else.
    """
    check_tables(data, where)
    try:
        return Scene.model_validate(with_points(data, where))
    except ValidationError as error:
        details = error.errors(include_url=False)
        misspelt = [detail for detail in details if detail["type"] == "extra_forbidden"]
        raise _input_error((misspelt or details)[0], where) from None


def _input_error(detail: ErrorDetails, where: str) -> InputError:
    key = ".".join(map(str, detail["loc"]))
    if detail["type"] == "extra_forbidden":
        return unknown(where, key, detail["input"])
    if detail["type"] == "tuple_type":
        kind, such = ("words", '["pillar"]') if key == "adhesion.on" else ("numbers", "[100.0]")
        return InputError(where, key, f"must be a list of {kind}", brief(detail["input"]), f"Such as {key} = {such}.")
    context = detail.get("ctx", {})
    got = context.get("got", detail["input"])
    return InputError(where, context.get("key", key), context["rule"], brief(got), context["hint"])


def scene_to_toml(scene: Scene) -> str:
    """The complete resolved scene as TOML; reading it gives an equal scene."""
    data = _data(scene)
    # tomli_w would squeeze these into one line each at the top
    tables = {name: data.pop(name) for name in ("pillar", "actin") if data.get(name)}
    written = (f"\n[[{name}]]\n{tomli_w.dumps(one)}" for name, many in tables.items() for one in many)
    return tomli_w.dumps(data) + "".join(written)


def scene_hash(scene: Scene) -> str:
    """SHA-256 of all that bears on the result: not the title, nor pictures; a layer's law and poisson resolved."""
    data = _data(scene)
    del data["title"], data["output"]["pictures"]
    for name in LAYER_NAMES:
        data["layer"][name] |= {"law": scene.layer_law(name), "poisson": scene.layer_poisson(name)}
    return hashlib.sha256(json.dumps(data, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _data(scene: Scene) -> dict[str, Any]:
    data = scene.model_dump(by_alias=True, exclude_none=True)
    if scene.flat is None:
        data["flat"] = False  # absent would mean Table 1's
    for name, absent in (("actin", ()), ("medium", Medium())):
        if getattr(scene, name) == absent:
            del data[name]
    return data

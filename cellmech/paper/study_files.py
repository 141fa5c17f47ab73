"""Study files that this package writes: cases by dotted keys, end states only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def study_text(title: str, head: str, cases: Mapping[str, Mapping[str, Any]]) -> str:
    """A study file.

    Args:
        title: of the study.
        head: its comment: what it is, how it was made, what it must show.
        cases: name -> settings by dotted key.
    """
    lines = [*(f"# {line}".rstrip() for line in head.splitlines()), "schema = 1", f"title = {_toml(title)}", ""]
    lines += ["[time]", "history = false  # the state at the end is static: how it was reached does not matter", ""]
    lines += ["[[pillar]]", ""]
    for name, settings in cases.items():
        lines += ["[[case]]", f"name = {_toml(name)}", *(f"{_toml(k)} = {_toml(v)}" for k, v in settings.items()), ""]
    return "\n".join(lines).rstrip("\n") + "\n"


def _toml(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)

"""A rule that is broken."""

from __future__ import annotations

from typing import NamedTuple


class Breach(NamedTuple):
    """A rule that is broken: dotted key, rule with its unit, value got, what to do."""

    key: str
    rule: str
    got: object
    hint: str = ""

"""Causes of failure: each is told of in the FAQ, and is not lost on its way between ranks and files."""

import pickle
import re
from pathlib import Path

import pytest

from cellmech.causes import Cause, Reason
from cellmech.errors import CompilerError, MeshError, SolveError

FAQ = Path(__file__).parents[2] / "docs" / "faq.md"
HEADINGS = re.findall(r"^### `(.*)`$", FAQ.read_text(encoding="utf-8"), re.MULTILINE)
OF_ADDITIONS_OR_BARE = (Cause.OBSERVABLE, Cause.OTHER, Cause.MESH, Cause.UNSOLVED, Cause.NEARLY_SINGULAR)


@pytest.mark.parametrize("cause", [cause for cause in Cause if cause not in OF_ADDITIONS_OR_BARE])
def test_every_cause_stands_in_the_faq(cause):
    """Its message, up to the first of its fields, begins a heading there, or what follows a heading's first "…"."""
    start = cause.text.split("{")[0].strip(" :;()").removeprefix("round-off ")
    assert start and any(start in heading for heading in HEADINGS)


def test_causes_differ_and_each_has_advice():
    assert len({cause.value for cause in Cause}) == len({cause.name for cause in Cause}) == len(list(Cause))
    assert all(cause.advice.endswith(".") for cause in Cause)
    assert {cause for cause in Cause if cause.passing} == {Cause.COMPILER, Cause.DISK, Cause.MEMORY, Cause.INTERNAL}


def test_fields_are_filled_in_and_may_hold_braces():
    reason = Cause.INTERNAL.reason(told="KeyError: '{x}'")
    assert reason == Reason(Cause.INTERNAL, "internal error: KeyError: '{x}'")
    assert reason.as_record() == {"status": "failed", "reason": str(reason), "cause": "internal"}


def test_name_that_no_cause_has_is_another_programs():
    assert Cause.named("turns") is Cause.TURNS
    assert Cause.named(None) is Cause.named("of next year") is Cause.OTHER


def test_error_keeps_its_cause_on_the_way_to_other_ranks():
    error = pickle.loads(pickle.dumps(SolveError(Cause.SLIDES.reason(told="downhill"))))
    assert (str(error), error.cause) == ("slides: no equilibrium; downhill", Cause.SLIDES)
    assert [pickle.loads(pickle.dumps(kind("x"))).cause for kind in (MeshError, CompilerError, SolveError)] == [
        Cause.MESH,
        Cause.COMPILER,
        Cause.OTHER,
    ]

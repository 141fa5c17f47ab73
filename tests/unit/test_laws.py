"""The table of laws: what is to be said of one is said once, and no two are taken for each other."""

from laws_by_hand import BY_HAND
from pages import Page
from problems import TRIED

from cellmech.mechanics.laws import LAWS


def test_every_law_is_written_by_hand_too():
    """Tests that go through all laws judge each by what stands there: stress, digits, waves, convergence."""
    assert set(BY_HAND) == set(LAWS)


def test_laws_are_told_apart_in_figures():
    for looks in ("label", "colour"):
        assert len({getattr(law, looks) for law in LAWS.values()}) == len(LAWS), looks


def test_key_of_a_constant_means_the_same_in_every_law():
    """`cell.constants` is for all layers, whatever their laws, and a value is judged by one rule."""
    known = {constant.key: constant for law in LAWS.values() for constant in law.constants.values()}
    for name, law in LAWS.items():
        for constant in law.constants.values():
            assert constant == known[constant.key], name


def test_no_constant_is_tried_at_1():
    """Where a factor that is left out, or stands twice, would not show."""
    for name, law in LAWS.items():
        for constant in law.constants.values():
            assert TRIED.get(constant.key, constant.default) not in (0.0, 1.0), (
                f"{name}: {constant.key} in problems.TRIED"
            )


def test_theory_has_every_law():
    named = Page("docs/theory.md").spans()
    assert [name for name, law in LAWS.items() if f"cellmech.mechanics.laws.{law.__name__}" not in named] == []

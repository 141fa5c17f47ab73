"""The three kinds of error a user can meet: bad input, a bad mesh, a failed solve."""

from __future__ import annotations

from cellmech.causes import Cause, Reason

MOST_OF_A_PART = 400  # characters of where, rule and hint in a message
MOST_OF_A_VALUE = 100


def cut(text: str, most: int = MOST_OF_A_VALUE) -> str:
    """The text for a message, cut short when it would fill the screen."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _shown(text: str) -> str:
    """The text as part of one line: a name may hold line ends, and what moves a terminal's cursor."""
    printable = (sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)
    return cut("".join(printable), MOST_OF_A_PART)


class CellmechError(Exception):
    """Base of every error this package raises on purpose."""

    cause = Cause.OTHER


class InputError(CellmechError):
    """A scene, study or command line that breaks a rule (exit status 2); the message is one line.

    Args:
        where: the file or command-line option at fault.
        key: dotted key inside it, "" when the file as a whole is meant.
        rule: the rule that is broken, with its unit.
        got: the value found; None when there is none to show.
        hint: what to do about it.
    """

    def __init__(self, where: str, key: str, rule: str, got: object = None, hint: str = "") -> None:
        self.where, self.key, self.rule, self.got, self.hint = where, key, rule, got, hint
        text = ": ".join(_shown(part) for part in (where, key, rule) if part)
        if got is not None:
            text += f"; got {cut(repr(got))}"
        super().__init__(f"{text}. {_shown(hint)}".rstrip() if hint else text)

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str, object, str]]:
        """Pickle by arguments, so that the error can be broadcast to every rank."""
        return InputError, (self.where, self.key, self.rule, self.got, self.hint)


class MeshError(CellmechError):
    """A mesh that cannot carry a computation: inverted elements, missing groups."""

    cause = Cause.MESH


class CompilerError(CellmechError):
    """A compilation that failed for want of a compiler; the text says what to install."""

    cause = Cause.COMPILER


class SolveError(CellmechError):
    """A nonlinear solve or a time loop that stopped; the text gives the physical reason."""

    def __init__(self, reason: Reason | str) -> None:
        super().__init__(reason)
        if isinstance(reason, Reason):
            self.cause = reason.cause

"""Why a case fails: each cause with the message that tells of it and with what to do about it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

GENTLER = "Compare with Table 1, one key at a time: an input is extreme, or the load more than the cell can bear."


class Cause(Enum):
    """A kind of failure. Its value is `cause` in result.json.

    Args:
        value: the name in files.
        text: the message, with fields in braces for what differs from case to case.
        advice: what to do.
        passing: whether the machine is why, so that the same input may be solved another time.
    """

    SLIDES = "slides", "slides: no equilibrium; {told}", "Centre the cell on its pillars, or set cell.inertia = true."
    TURNS = "turns", "turns: no equilibrium; {told}", "Raise contact.penalty_Pa_per_um."
    TOO_COARSE = (
        "too-coarse",
        "the mesh is too coarse to tell whether the cell {way}: {told}, and {unseen_percent:.2g} % of their force "
        "lie between the points at which it is integrated; set mesh.size_um lower",
        "Set mesh.size_um lower.",
    )
    COMES_OFF = (
        "comes-off",
        "the cell comes off the substrate: the lift exceeds what adhesion holds at t = {t_s:.6g} s, "
        "{share:.4g} of the load",
        "Lower the lift or raise adhesion.work_uJ_m2; what adhesion held is contact.force_* of the last state.",
    )
    ELLIPTICITY = (
        "ellipticity",
        "ellipticity is lost at t = {t_s:.6g} s, load amplitude {amplitude:.6g}: {found}: from there on "
        "the material can fail in bands as thin as the mesh allows, and states depend on the mesh",
        'Use cell.law = "neo-hookean" or a smaller load; stability = "warn" follows the cell further.',
    )
    SELF_CONTACT = (
        "self-contact",
        "the cell comes into contact with itself (at {where} um), which is not modelled",
        "Lower adhesion.work_uJ_m2 or the actin's stress; the state before is saved.",
    )
    NOT_SOLVED = (
        "linear-solver",
        "the linear solver stops: {left:.2g} of the residual is left after {made} iterations",
        "Set mesh.size_um larger, so that the tangent can be factorised, or raise the moduli that lie far apart.",
    )
    ROUND_OFF = (
        "round-off",
        "round-off keeps forces of {force:.2g} {unit} out of balance beside a load of {load:.2g} {unit}{remedy}",
        "Raise the load, or lower moduli and penalty; ask for no state at which hardly any load acts.",
    )
    NO_CONVERGENCE = "no-convergence", "no equilibrium found in {most} Newton iterations", GENTLER
    NONE_NEARBY = "none-nearby", "no equilibrium nearby: the out-of-balance force cannot be reduced further", GENTLER
    INSIDE_OUT = "inside-out", "material turns inside out on the way ({where})", GENTLER
    CRUSHED = (
        "crushed",
        "material is crushed to nothing ({where})",
        'Give the place more solid, or a law that resists, such as cell.law = "neo-hookean".',
    )
    SINGULAR = (
        "singular",
        "the tangent is singular: nothing resists some motion of the body",
        "Look for a layer without solid and without viscosity, or a cell without contact.",
    )
    NEARLY_SINGULAR = (
        "nearly-singular",
        "the tangent is nearly singular: pivoting outgrows the room foreseen for it (MUMPS error {code})",
        "Look for layers with hardly any stiffness beside others.",
    )
    UNSOLVED = "unsolved", "the nonlinear solve stopped: {told}", GENTLER
    RESTLESS = "restless", "the error of ever smaller steps stays large", "Raise time.rtol."
    OBSERVABLE = "observable", "the observable {name} is no finite number ({told})", "Mend the observable's function."
    MESH = "mesh", "{told}", "Set mesh.size_um smaller."
    COMPILER = "compiler", "the compiler fails: {told}", "Install what the message names (make setup).", True
    DISK = "disk", "the disk refuses: {told}", "Make room, then start the same command again: it goes on.", True
    MEMORY = (
        "memory",
        "memory does not suffice: {told}",
        "Set mesh.size_um larger, or give a case more ranks on further nodes.",
        True,
    )
    INTERNAL = "internal", "internal error: {told}", "Report it with scene.toml and run.log.", True
    OTHER = "other", "{told}", "The message says what to do."

    def __new__(cls, value: str, text: str, advice: str, passing: bool = False) -> Cause:
        """A member that is found by its name in files."""
        made = object.__new__(cls)
        made._value_, made.text, made.advice, made.passing = value, text, advice, passing
        return made

    text: str
    advice: str
    passing: bool

    @classmethod
    def named(cls, value: object) -> Cause:
        """The cause of that name in a file; `OTHER` where it names none, or one of another version."""
        return next((cause for cause in cls if cause.value == value), cls.OTHER)

    def reason(self, **fields: Any) -> Reason:
        """The message with its fields filled in."""
        return Reason(self, self.text.format(**fields))


@dataclass(frozen=True)
class Reason:
    """Why something failed: the cause, and the message as it is told."""

    cause: Cause
    text: str

    def __str__(self) -> str:
        return self.text

    def as_record(self) -> dict[str, str]:
        """The part of result.json that tells of a failure for this reason."""
        return {"status": "failed", "reason": self.text, "cause": self.cause.value}

"""The strain energies of the solid phase W(E) [Pa] (eqs 17-20), each with all that is to be said of it.

A law is a function of the invariants of C (`cellmech.mechanics.invariants.Invariants`) and of named constants; its
stress follows by differentiation (`cellmech.mechanics.stress`). To add one: write the function below and state its
name, label, colour, volume measure and constants; scene files, `--check`, figures and the reference of keys follow.
Small-strain moduli: mu = 2 (alpha + beta) for every law, lambda as given (Yeoh: lambda + 4 alpha_Y1).

Nothing is imported here that computes: scene files are read by it, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeAlias

Law: TypeAlias = Callable[..., Any]


class Volume(Enum):
    """The measure g of volume change that a law's lambda goes with: W(lmbda) = W(lmbda = 0) + lmbda/2 g^2."""

    LN_J = "ln J"
    TRACE = "tr E"


@dataclass(frozen=True)
class Constant:
    """A constant of a law besides its moduli.

    Args:
        key: in scene files, below `constants` of the cell or of a layer.
        default: where nothing is written.
        meaning: for people.
        above, least, most: bounds, the first exclusive.
        times_mu: whether the law's argument is the number times mu [Pa].
        cell_key: of the cell's table, which has the default where the constant has an older key of its own.
        words: what stands for numbers there.
    """

    key: str
    default: float
    meaning: str
    above: float = -math.inf
    least: float = -math.inf
    most: float = 1e6
    times_mu: bool = False
    cell_key: str = ""
    words: Mapping[str, float] = field(default_factory=dict)

    @property
    def allowed(self) -> str:
        """The bounds in words."""
        lower = f"> {self.above:g}" if math.isfinite(self.above) else f">= {self.least:g}"
        return f"{lower} and <= {self.most:g}"


@dataclass(frozen=True, eq=False)
class SolidLaw:
    """A law that scene files can name.

    Args:
        energy: W [Pa] as a function of (Invariants, **constants).
        name: in scene files.
        label, colour: in figures.
        volume: the measure its lambda goes with, without which it has no mixed form.
        constants: argument -> what is to be said of it.
        in_plane: what it becomes with the in-plane tr C of eqs 19 and 20, itself if None.
    """

    energy: Law
    name: str
    label: str
    colour: str
    volume: Volume | None
    constants: Mapping[str, Constant] = field(default_factory=dict)
    in_plane: Law | None = None

    def __call__(self, C: Any, **constants: Any) -> Any:
        """W [Pa]."""
        return self.energy(C, **constants)

    @property
    def __name__(self) -> str:
        """As a function has one."""
        return self.energy.__name__


LAWS: dict[str, SolidLaw] = {}
"""By the names that scene files use."""


def solid_law(
    name: str, label: str, colour: str, volume: Volume, in_plane: Law | None = None, **constants: Constant
) -> Callable[[Law], SolidLaw]:
    """State all that there is to say of a law; see `SolidLaw`."""

    def stated(energy: Law) -> SolidLaw:
        LAWS[name] = SolidLaw(energy, name, label, colour, volume, constants, in_plane)
        return LAWS[name]

    return stated


def volumetric(measure: Volume) -> Callable[[Law], Law]:
    """State the volume measure of a law of one's own, which its mixed form is made of."""

    def stated(law: Law) -> Law:
        setattr(law, "volume", measure)  # noqa: B010
        return law

    return stated


def volume_of(law: Law) -> Volume | None:
    """The measure that a law states, None if it states none."""
    return getattr(law, "volume", None)


BETA = Constant("beta_over_mu", 2.5, "β/µ (eq. 19)", least=0.0, most=1e3, times_mu=True, cell_key="beta_over_mu")
WORDS = {"stress-free": 3.0, "printed": 0.0}
I1_REST = Constant(
    "i1_rest", 3.0, "I₁ from which eq. 20 counts", least=0.0, most=3.0, cell_key="yeoh_reference", words=WORDS
)


def _mooney_rivlin(C, second, lmbda, mu, beta):
    """Eq. 19 with `second` for I2 - 3 I3^(2/3) [Pa]."""
    alpha = mu / 2 - beta
    return alpha * C.I1_less_root + beta * second + (lmbda + 2 * mu / 3) / 2 * C.ln_J**2


def _yeoh(W, i1, mu, beta):
    """Eq. 20 from eq. 19's energy W [Pa] and I1 less its reference."""
    alpha = mu / 2 - beta
    return W - 0.5 * alpha / 2 * i1**2 + 0.1 * alpha / 3 * i1**3


@volumetric(Volume.LN_J)
def mooney_rivlin_in_plane(C, *, lmbda, mu, beta):
    """Eq. 19 with the in-plane tr C in its stress [Pa], whose stress at rest is -2 beta I.

    There tr C I - C = det C C^-1, so that I3 stands for I2 = I1 - 1 + I3.
    """
    return _mooney_rivlin(C, C.I3_gap - 3 * ((1 + C.I3_gap) ** (2 / 3) - 1), lmbda, mu, beta)


@volumetric(Volume.LN_J)
def yeoh_in_plane(C, *, lmbda, mu, beta, i1_rest):
    """Likewise, and with the in-plane tr C = I1 - 1 in eq. 20, of which i1_rest is taken off all the same [Pa]."""
    return _yeoh(mooney_rivlin_in_plane(C, lmbda=lmbda, mu=mu, beta=beta), C.I1_gap + (2 - i1_rest), mu, beta)


@solid_law("saint-venant", "Saint-Venant", "#d5312b", Volume.TRACE)
def saint_venant(C, *, lmbda, mu):
    """lambda/2 (tr E)^2 + mu tr E^2 [Pa] (eq. 17)."""
    return lmbda / 2 * C.trace**2 + mu * C.square


@solid_law("neo-hookean", "neo-Hookean", "#3a9d45", Volume.LN_J)
def neo_hookean(C, *, lmbda, mu):
    """mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 [Pa] (eq. 18)."""
    return mu / 2 * C.I1_less_ln_I3 + lmbda / 2 * C.ln_J**2


@solid_law("mooney-rivlin", "Mooney–Rivlin", "#f5921e", Volume.LN_J, mooney_rivlin_in_plane, beta=BETA)
def mooney_rivlin(C, *, lmbda, mu, beta):
    """alpha (I1 - 3 I3^(1/3)) + beta (I2 - 3 I3^(2/3)) + lambda_MR/2 (ln J)^2 [Pa] (eq. 19).

    alpha = mu/2 - beta and lambda_MR = lambda + 2 mu/3; alpha < 0 at the printed beta = mu/0.4.
    """
    return _mooney_rivlin(C, C.I2_less_root, lmbda, mu, beta)


@solid_law("yeoh", "Yeoh", "#2f6fc4", Volume.LN_J, yeoh_in_plane, beta=BETA, i1_rest=I1_REST)
def yeoh(C, *, lmbda, mu, beta, i1_rest):
    """W_MR + alpha_Y1/2 (I1 - i1_rest)^2 + alpha_Y2/3 (I1 - i1_rest)^3 [Pa] (eq. 20).

    alpha_Y1 = -0.5 alpha, alpha_Y2 = 0.1 alpha. i1_rest = 3 is free of stress at rest; i1_rest = 0 is eq. 20 as
    printed, whose stress at rest is -1.2 alpha I.
    """
    return _yeoh(mooney_rivlin(C, lmbda=lmbda, mu=mu, beta=beta), C.I1_gap + (3 - i1_rest), mu, beta)


I1_LIMIT = Constant("i1_limit", 1.0, "I₁ − 3 at which it is infinitely stiff, J_m", above=0.0)


@solid_law("gent", "Gent", "#7d4fa3", Volume.LN_J, i1_limit=I1_LIMIT)
def gent(C, *, lmbda, mu, i1_limit):
    """-mu J_m/2 ln(1 - (I1 - 3 - 2 ln J)/J_m) + lambda/2 (ln J)^2 [Pa], J_m = i1_limit.

    Gent's law where the volume is kept. With I1 - 3 alone lambda would be shifted by 2 mu/J_m, and the shift taken off
    again makes the law lose ellipticity under slight compression for J_m < 2 mu/lambda; 2 ln J leaves both as given.
    Source: Gent, Rubber Chem. Technol. 69 (1996) 59-61.
    """
    t = C.I1_less_ln_I3
    return mu / 2 * (t + i1_limit * C.excess(-t / i1_limit)) + lmbda / 2 * C.ln_J**2

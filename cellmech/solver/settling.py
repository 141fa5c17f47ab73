"""The translation along the load that balances it with the contact: where Newton's method begins."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

NEARLY = 1.0  # share of the load by which contact may miss it before Newton's method begins: it finds the rest
FIRST_MOVE = 1e-12  # of the reach
CLOSE_ENOUGH = 1e-9  # of the move


def settle(imbalance: Callable[[float], float], load: float, reach_um: float, nearly: float = NEARLY) -> float | None:
    """Way along the load to where contact balances it [µm]; 0 where it nearly does, None where it cannot.

    Internal forces add up to nothing, so in equilibrium the contact's force is the load, however the body is deformed.
    The tangent knows little of that: contact that sets in with the square of the depth makes Newton's method overshoot
    and then halve its error only, and without contact the tangent is singular.

    Args:
        imbalance: load less the contact's force against it [Pa µm] after a move [µm]; falls with it.
        load: > 0 [Pa µm].
        reach_um: farther is not looked.
        nearly: share of the load by which contact may miss it.
    """
    here = imbalance(0.0)
    if load / (1 + nearly) <= load - here <= load * (1 + nearly):
        return 0.0
    sign = 1.0 if here > 0 else -1.0
    near, far = 0.0, sign * FIRST_MOVE * reach_um
    while sign * imbalance(far) > 0:
        near, far = far, 2 * far
        if abs(far) > reach_um:
            return None
    return float(brentq(imbalance, near, far, xtol=float(np.spacing(reach_um)), rtol=CLOSE_ENOUGH))

"""What an obstacle does to a surface along its normal, as numbers: push by depth, pull by gap."""

from __future__ import annotations


def push_at(d: float, kappa: float, width: float, on_surface: bool = True) -> float:
    """Pressure of the penalty at the depth d [Pa]; of a force in the volume, its sum over the depth.

    Args:
        d: depth [µm].
        kappa: penalty [Pa/µm].
        width: over which it sets in [µm].
        on_surface: whether it is a pressure on the outline.
    """
    if on_surface:
        return 0.0 if d <= 0 else kappa * (d * d / (2 * width) if d < width else d - width / 2)
    s = min(max((d / width + 1) / 2, 0.0), 1.0)
    return kappa * (2 * width * s**4 * (2.5 - 3 * s + s * s) + max(d - width, 0.0))


def pull_at(d: float, work: float, reach: float) -> float:
    """Pull of adhesion at the depth d [Pa]: (w/delta) 30 t^2 (1 - t)^2 at t = -d/delta in 0 … 1.

    Args:
        d: depth [µm]; minus the gap.
        work: of adhesion, w [Pa µm].
        reach: range delta [µm].
    """
    t = min(max(-d / reach, 0.0), 1.0)
    return work / reach * 30.0 * t**2 * (1.0 - t) ** 2

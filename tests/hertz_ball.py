"""Hertz's ball on a rigid flat: its numbers, and the rows of a body that is pressed by two loads."""

import numpy as np

RADIUS, YOUNG, POISSON = 8.0, 200.0, 0.3  # µm, Pa


def hertz(load):
    """Contact radius a [µm], a^3 = 3 F R/(4 E*), and largest pressure p0 = 3 F/(2 pi a^2) [Pa]."""
    a = np.cbrt(0.75 * load * RADIUS * (1 - POISSON**2) / YOUNG)
    return a, 1.5 * load / (np.pi * a**2)


def penalty(load):
    """Penalty [Pa/µm] and smoothing [µm] by which the ball sinks into the flat by a 300th of its approach, a^2/R."""
    a, p0 = hertz(load)
    return 300 * p0 * RADIUS / a**2, 1e-3 * a**2 / RADIUS / 300


def misfits_fall_with_the_load(ladder, name, pressed):
    """Strain is of the order of a/R, which goes like the cube root of the load: an eighth of it halves the misfit.

    Args:
        ladder: takes the rows.
        name: of the ball in them.
        pressed: misfits of the contact's radius and of the largest pressure [-] under a load [pN].
    """
    (wide, p_wide), (narrow, p_narrow) = (pressed(load) for load in (5.0, 0.625))
    ladder(f"Hertz, {name}: contact radius", ours=1 + narrow, reference=1.0, abs=0.015)
    ladder(f"Hertz, {name}: largest pressure", ours=1 + p_narrow, reference=1.0, abs=0.03)
    misfit = f"Hertz, {name}: misfit of {{}} at an eighth of the load, over that before"
    ladder(misfit.format("p0"), ours=p_narrow / p_wide, reference=0.5, abs=0.15)
    ladder(misfit.format("a"), ours=narrow / wide, reference=0.5, abs=0.15)

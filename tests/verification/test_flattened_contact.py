"""A flattened cell of equal layers on a flat: Hertz's contact of the curvature at its bottom, turned and in space."""

import math

import pytest

from cellmech.runs.library import solve
from cellmech.scene.files import read_scene

YOUNG, POISSON, ASPECT = 1000.0, 0.3, 0.5


def solved(folder, **tables):
    found = solve(read_scene({"time": {"history": False}, **tables}, "flattened"), folder)
    assert not found.failure, found.failure
    return found.result


def on_a_flat(folder, geometry, factor):
    """The contact of a cell under so many times its weight, on a stiff flat."""
    layers = ("membrane", "cytosol", "lamina", "nucleoplasm")
    return solved(
        folder,
        cell={"geometry": geometry, "aspect": ASPECT, "poisson": POISSON},
        layer={name: {"young_Pa": YOUNG, "fluid_fraction": 0.0} for name in layers},
        pillar=[],
        load={"factor": factor},
        contact={"penalty_Pa_per_um": 2e6, "smoothing_um": 1e-5},
    )["contact"]


def hertz_um(geometry, contact):
    """Half-width of the contact with a plane of a body whose radius of curvature is a^2/b there (Johnson 1985, 4.2)."""
    modulus = YOUNG / (1 - POISSON**2)
    if geometry == "plane":
        return 2 * math.sqrt(contact["force_Pa_x_um"] * 10.0 * ASPECT**-1.5 / (math.pi * modulus))
    return (0.75 * contact["force_pN"] * 10.0 * ASPECT ** (-4 / 3) / modulus) ** (1 / 3)


@pytest.mark.parametrize(("geometry", "factor"), [("plane", 300.0), ("axisymmetric", 75.0)])
def test_flattened_cell_touches_as_hertz_says_the_better_the_lighter_it_is(tmp_path, ladder, geometry, factor):
    misfits = []
    for k, load in enumerate((factor, factor / 16)):
        contact = on_a_flat(tmp_path / str(k), geometry, load)
        misfits.append(1 - contact["half_width_um"] / hertz_um(geometry, contact))
    ladder(f"flattened cell, {geometry}: half-width over Hertz's", ours=1 - misfits[1], reference=1.0, rel=0.025)
    assert 1.7 < misfits[0] / misfits[1] < 6.0


@pytest.mark.by_hand
def test_flattened_cell_in_space_is_the_one_that_is_turned(tmp_path, ladder):
    """Table 1's layers on its round pillar under five times the weight, on few elements of second order."""
    turned, space = (
        solved(
            tmp_path / geometry,
            cell={"geometry": geometry, "aspect": ASPECT},
            load={"factor": 5.0},
            mesh={"order": 2, "size_um": size, "thin_layers": 1},
        )
        for geometry, size in (("axisymmetric", 1.2), ("3d", 6.0))
    )
    for table, key, rel in (
        ("cell", "sigma_mises_mean_Pa", 0.02),
        ("nucleus", "sigma_mises_mean_Pa", 0.02),
        ("contact", "half_width_um", 0.04),
        ("nucleus_shape", "height_um", 2e-3),
        ("nucleus_shape", "width_um", 2e-3),
    ):
        ours, reference = space[table][key], turned[table][key]
        ladder(f"flattened cell, 3-D beside turned: {table}.{key}", ours=ours, reference=reference, rel=rel)

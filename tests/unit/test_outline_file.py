"""Outlines as points: in order around the whole body, with the area and perimeter that result.json has."""

import numpy as np
import pytest

import cellmech
from cellmech.errors import InputError
from cellmech.results.outline_file import around

COARSE = {"mesh": {"size_um": 6.0}, "time": {"history": False}}


def area(points):
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def perimeter(points):
    return float(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum())


@pytest.mark.parametrize("cell", [{}, {"shape": "full"}, {"geometry": "axisymmetric"}], ids=["half", "full", "turned"])
def test_outlines_have_the_area_and_perimeter_of_the_result(cell):
    result = cellmech.solve({"title": "outline", "cell": cell, "load": {"factor": 5.0}, **COARSE})
    shape = result.result["nucleus_shape"]
    now, rest = result.outline(), result.outline(state="reference")
    assert area(now) == pytest.approx(shape["area_um2"], rel=2e-3)
    assert perimeter(now) == pytest.approx(shape["perimeter_um"], rel=2e-3)
    assert area(rest) == pytest.approx(25 * np.pi, rel=2e-3) and now.shape == rest.shape
    assert now[:, 1].min() == pytest.approx(shape["lowest_um"], abs=0.01)
    assert area(result.outline("cell", "reference")) == pytest.approx(100 * np.pi, rel=2e-3)
    assert np.abs(rest - now).max() > 0.1
    with pytest.raises(InputError, match="there is no such outline"):
        result.outline("lamina")


def test_ball_has_a_section_and_a_view_from_above():
    scene = {"title": "ball", "cell": {"geometry": "3d"}, "mesh": {"size_um": 9.0, "order": 2}}
    result = cellmech.solve({**scene, "time": {"history": False}})
    shape = result.result["nucleus_shape"]
    assert area(result.outline()) == pytest.approx(shape["area_um2"], rel=5e-3)
    assert abs(area(result.outline(view="above"))) == pytest.approx(shape["projection_area_um2"], rel=5e-3)
    assert perimeter(result.outline()) == pytest.approx(shape["perimeter_um"], rel=5e-3)


def test_edges_in_any_order_are_put_in_order():
    angle = np.linspace(-0.5, 0.5, 12) * np.pi
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    edges = np.stack([circle[:-1], circle[1:]], axis=1)[np.random.default_rng(0).permutation(11)]
    points = around(edges, half=True)
    assert area(points) == pytest.approx(np.pi, rel=0.05) and len(points) == 22
    assert perimeter(points) == pytest.approx(2 * np.pi, rel=0.01)

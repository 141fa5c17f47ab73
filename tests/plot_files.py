"""Result folders as a study leaves them, made up: what figures are drawn from."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.scene.files import scene_to_toml
from cellmech.scene.scene import Scene
from cellmech.scene.studies import Study

LAWS = ("saint-venant", "neo-hookean", "mooney-rivlin", "yeoh")
TIMES = np.array([0.0, 100.0, 1000.0, 5000.0, 10000.0, 18000.0])
RADII = (0.0, 4.9, 5.0, 9.5, 10.0)  # of Table 1; ring k carries the layer code k
CENTRE = np.array([0.0, 9.5])
VTK_QUADRATIC_TRIANGLE, VTK_QUADRATIC_TETRAHEDRON = 22, 24
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # of a tetrahedron, as VTK has their middles

Field = Callable[[np.ndarray], np.ndarray]


def peaks(index: int) -> dict[str, float]:
    """The largest values in the nucleus of the index-th law at the end."""
    return {
        "sigma_mises_max_Pa": 5.0 + index,
        "J1_max": 2.005 + 1e-3 * index,
        "J2_max": 2.01 + 1e-3 * index,
        "J3_max": 1.005 + 1e-3 * index,
    }


def write_study(folder: Path, laws: tuple[str, ...] = LAWS, field: Field | None = None) -> Path:
    """A finished study of the given laws."""
    for index, law in enumerate(laws):
        write_case(folder / law, law, index, field or sag)
    return folder


def write_sweep(folder: Path, study: Study, values: Callable[[int], Mapping[str, float]]) -> Path:
    """Scenes and results of a study's cases, no more; `values` gives the nucleus's of the index-th case."""
    for index, case in enumerate(study.cases):
        (folder / case.name).mkdir(parents=True)
        (folder / case.name / "scene.toml").write_text(scene_to_toml(case.scene))
        result = numbers(case.name, 0)
        result["nucleus"] |= values(index)
        (folder / case.name / "result.json").write_text(json.dumps(result))
    return folder


def write_named(folder: Path, study: Study, field: Field | None = None) -> Path:
    """A finished study with all its files."""
    for index, case in enumerate(study.cases):
        write_case(folder / case.name, case.scene.cell.law, index, field or sag)
        (folder / case.name / "scene.toml").write_text(scene_to_toml(case.scene))
    return folder


def change(path: Path, **entries: Any) -> None:
    """Other entries of a case's result.json."""
    path /= "result.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))


def write_case(folder: Path, law: str, index: int, field: Field, half: bool = True, **result: Any) -> None:
    """One case's scene.toml, result.json, history.csv, fields.pvd and its field file."""
    folder.mkdir(parents=True)
    cell = {"law": law, "shape": "half" if half else "full"}
    (folder / "scene.toml").write_text(scene_to_toml(Scene.model_validate({"cell": cell})))
    ramp = TIMES / TIMES[-1]
    rest = {"sigma_mises_max_Pa": 0.0, "J1_max": 2.0, "J2_max": 2.0, "J3_max": 1.0}
    columns = {"t_s": TIMES, "empty": [""] * len(TIMES), "lamina_pillar_distance_um": 5.0 - 0.4 * ramp}
    columns |= {f"nucleus.{key}": rest[key] + (end - rest[key]) * ramp for key, end in peaks(index).items()}
    with open(folder / "history.csv", "w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(columns)
        table.writerows(zip(*columns.values(), strict=True))
    (folder / "result.json").write_text(json.dumps(numbers(law, index) | result))
    write_fields(folder / "fields_0000.vtu", field, half)
    entry = f'<DataSet timestep="{TIMES[-1]}" file="fields_0000.vtu"/>'
    (folder / "fields.pvd").write_text(f'<VTKFile type="Collection"><Collection>{entry}</Collection></VTKFile>')


def numbers(law: str, index: int) -> dict[str, Any]:
    """The part of result.json that figures and tables read."""
    nucleus: dict[str, Any] = {"area_um2": 25 * np.pi} | peaks(index)
    for key, end in peaks(index).items():
        name, unit = (key[:-7], "_Pa") if key.endswith("_Pa") else (key[:-4], "")
        nucleus |= {f"{name}_max_over_time{unit}": end, f"{name}_max_time_s": 10000.0, f"{name}_mean{unit}": end / 2}
    return {
        "case": law,
        "status": "solved",
        "reason": "",
        "t_s": 18000.0,
        "mesh_cells": 1230,
        "versions": {"cellmech": "0.1.0", "dolfinx": "0.5.2"},
        "source_hash": "0123456789abcdef",
        "nucleus": nucleus,
        "cell": {"area_um2": 100 * np.pi},
        "share_of_area_percent": {"J1": 50.0, "J2": 49.5, "J3": None},
        "share_of_max": {"J1": 0.3, "J2": 0.2, "J3": 0.8},
        "share_of_integral": {"J1": 0.25, "J2": 0.35, "J3": 0.25},
        "shape_index": {"full": 0.98, "half_outline": 0.76, "half_area_full_perimeter": 0.49},
        "lamina_pillar_distance_um": 4.6,
        "nucleus_obstacle_distance_um": 3.2,
        "nucleus_obstacle": "pillar 1",
    }


def sag(x: np.ndarray) -> np.ndarray:
    """A displacement [µm] like that of a cell under its weight: 0 at the bottom, 0.6 down at the top."""
    up = (x[..., 1] + 0.5) / 20.0
    return np.stack([0.01 * x[..., 0], -0.6 * up], axis=-1)


def write_fields(path: Path, field: Field, half: bool = True, sectors: int = 12) -> None:
    """A disc of quadratic triangles in the layers of Table 1, each element with nodes of its own."""
    import pyvista

    start, stop = (-np.pi / 2, np.pi / 2) if half else (-np.pi / 2, 3 * np.pi / 2)
    angles = np.linspace(start, stop, sectors * (1 if half else 2) + 1)
    elements, layers = [], []
    for code, (inner, outer) in enumerate(pairwise(RADII)):
        for a, b in pairwise(angles):
            m, middle = (a + b) / 2, (inner + outer) / 2
            # corners, then the middles of their edges 01, 12, 20, as VTK has them; (radius, angle)
            if inner:
                elements.append([(outer, a), (outer, b), (inner, b), (outer, m), (middle, b), (middle, m)])
                elements.append([(outer, a), (inner, b), (inner, a), (middle, m), (inner, m), (middle, a)])
                layers += [code, code]
            else:
                elements.append([(outer, a), (outer, b), (0.0, m), (outer, m), (middle, b), (middle, a)])
                layers.append(code)
    polar = np.array(elements)
    r, angle = polar[..., 0], polar[..., 1]
    position = CENTRE + np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    count = len(elements)
    cells = np.column_stack([np.full(count, 6), np.arange(6 * count).reshape(count, 6)])
    flat = position.reshape(-1, 2)
    grid = pyvista.UnstructuredGrid(
        cells.ravel(), np.full(count, VTK_QUADRATIC_TRIANGLE), np.column_stack([flat, np.zeros(len(flat))])
    )
    grid.point_data["displacement_um"] = np.column_stack([field(flat), np.zeros(len(flat))])
    grid.point_data["sigma_mises_Pa"] = 10.0 ** (flat[:, 1] / 10.0)
    grid.cell_data["layer"] = np.array(layers, dtype=np.int32)
    grid.save(path)


def write_ball(folder: Path, field: Field, **tables: Any) -> Path:
    """A case in space: scene.toml, result.json, fields.pvd and the field file of a quarter of a ball."""
    folder.mkdir(parents=True)
    scene = Scene.model_validate({"cell": {"geometry": "3d", "shape": "quarter"}, **tables})
    (folder / "scene.toml").write_text(scene_to_toml(scene))
    strains = {"J1_mean": 3.25, "J1_max": 3.5}
    shape = {"indentation_um": -4.5, "aspect": 0.96}
    (folder / "result.json").write_text(
        json.dumps(numbers(folder.name, 0) | {"nucleus": strains, "nucleus_shape": shape})
    )
    write_quarter(folder / "fields_0000.vtu", field)
    entry = f'<DataSet timestep="{TIMES[-1]}" file="fields_0000.vtu"/>'
    (folder / "fields.pvd").write_text(f'<VTKFile type="Collection"><Collection>{entry}</Collection></VTKFile>')
    return folder


def write_quarter(path: Path, field: Field, cuts: int = 3) -> None:
    """A quarter of a ball, x >= 0 and z >= 0, of quadratic tetrahedra in the layers of Table 1, its spheres round.

    A face of the octahedron falls into cuts² triangles, above each of which every layer is a prism, or at the middle a
    tetrahedron.
    """
    import pyvista

    elements, layers = [], []
    for side in (1.0, -1.0):
        for corners in _facets(cuts):
            ordered = sorted(corners, key=tuple)  # as the neighbours have them, which so split faces in one way
            a, b, c = (corner * [1.0, side, 1.0] / np.linalg.norm(corner) for corner in ordered)
            for code, (inner, outer) in enumerate(pairwise(RADII)):
                tops = [outer * a, outer * b, outer * c]
                bottoms = [inner * a, inner * b, inner * c]
                split = [[*tops, bottoms[0]], [tops[1], tops[2], *bottoms[:1], bottoms[1]], [tops[2], *bottoms]]
                elements += split if inner else split[:1]
                layers += [code] * (3 if inner else 1)
    vertices = np.array(elements)
    middles = np.stack([_between(vertices[:, i], vertices[:, j]) for i, j in EDGES], axis=1)
    flat = np.concatenate([vertices, middles], axis=1).reshape(-1, 3) + np.array([0.0, CENTRE[1], 0.0])
    cells = np.column_stack([np.full(len(elements), 10), np.arange(len(flat)).reshape(-1, 10)])
    grid = pyvista.UnstructuredGrid(cells.ravel(), np.full(len(elements), VTK_QUADRATIC_TETRAHEDRON), flat)
    grid.point_data["displacement_um"] = field(flat)
    grid.point_data["sigma_mises_Pa"] = 10.0 ** (flat[:, 1] / 10.0)
    grid.cell_data["layer"] = np.array(layers, dtype=np.int32)
    grid.save(path)


def _facets(cuts: int) -> list[list[np.ndarray]]:
    """Triangles of the face between the three axes, each as its corners."""

    def at(i: int, j: int) -> np.ndarray:
        return np.array([i, j, cuts - i - j]) / cuts

    up = [[at(i, j), at(i + 1, j), at(i, j + 1)] for i in range(cuts) for j in range(cuts - i)]
    down = [[at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(cuts) for j in range(cuts - i - 1)]
    return up + down


def _between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Middles of edges, as far from the centre as their ends are on the mean."""
    middle = (a + b) / 2
    radii = (np.linalg.norm(a, axis=-1) + np.linalg.norm(b, axis=-1)) / 2
    return middle * (radii / np.linalg.norm(middle, axis=-1))[:, None]

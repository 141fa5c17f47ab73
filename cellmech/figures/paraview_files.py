"""Files for ParaView of what is not in the field files: the whole cell where it is now, by layer, and its substrate."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.errors import InputError
from cellmech.figures.ground import FLAT, PILLAR, Ground
from cellmech.figures.render import surface_of
from cellmech.figures.style import LAYER_COLOURS
from cellmech.figures.substrate import polygons
from cellmech.results.records import PARTIAL, write_whole
from cellmech.results.result import Result
from cellmech.scene.placement import placement
from cellmech.scene.scene import Scene

MIRRORED = {3: (0, 2, 1), 6: (0, 2, 1, 5, 4, 3), 4: (0, 2, 1, 3), 10: (0, 2, 1, 3, 6, 5, 4, 7, 9, 8)}  # keeps the sense
FARTHEST = 3.0  # radii from the cell's axis to the last pillar, and the flat's rim
THICK = 0.25  # radii of the flat that is drawn in a section
POINTS = 50  # as `cellmech.figures.ground.GRID`


def write_paraview(case: Result, out: Path, stem: str) -> int:
    """Write `<stem>.pvd`, and into a folder of that name a `.vtm` for each time; nothing else need be opened.

    Blocks are the four layers, each with the fields of the field files, `pillars` and `flat`. Points are where they are
    at that time.

    Returns:
        The number of times.

    Raises:
        InputError: for field files that are missing or broken, or when the folder cannot be written to.
    """
    folder, names, times = out / stem, list(LAYER_COLOURS), []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        ground = _ground(case.scene)
        for name, surface in ground.items():
            _save(surface, folder / f"{name}.vtp")
        for index, (t_s, file) in enumerate(case.series()):
            cell = whole(case.fields(file), case.scene.mirrors)
            blocks = {name: f"{name}_{index:04d}.vtu" for name in names}
            for code, name in enumerate(names):
                mine = np.flatnonzero(cell.cell_data["layer"] == code)
                part = cell.extract_cells(mine, pass_cell_ids=False, pass_point_ids=False)
                _save(part, folder / blocks[name])
            blocks |= {name: f"{name}.vtp" for name in ground}
            entries = [f'index="{at}" name="{name}" file="{blocks[name]}"' for at, name in enumerate(blocks)]
            write_whole(folder / f"{index:04d}.vtm", _listed("vtkMultiBlockDataSet", entries))
            times.append(f'timestep="{t_s!r}" file="{stem}/{index:04d}.vtm"')
        write_whole(out / f"{stem}.pvd", _listed("Collection", times))
    except OSError as error:
        raise InputError("--out", str(out), f"cannot be written to ({error.strerror or error})") from None
    return len(times)


def whole(grid: Any, mirrors: str) -> Any:
    """A field file's cell, displaced, with its images at x = 0 and z = 0.

    Args:
        grid: of a field file.
        mirrors: axes along which it is mirrored.
    """
    import pyvista

    (kind, cells), *_ = grid.cells_dict.items()
    moved = np.asarray(grid.points) + np.asarray(grid.point_data["displacement_um"])
    points, layer = moved.astype(np.float32), np.asarray(grid.cell_data["layer"])
    data = {name: np.asarray(of, dtype=np.float32) for name, of in grid.point_data.items()}  # half the bytes
    for axis in mirrors:
        sign = np.where(np.arange(3) == "xyz".index(axis), -1, 1).astype(np.float32)
        cells = np.concatenate([cells, cells[:, MIRRORED[cells.shape[1]]] + len(points)])
        points, layer = np.concatenate([points, points * sign]), np.tile(layer, 2)
        data = {name: np.concatenate([of, of * sign if of.ndim == 2 else of]) for name, of in data.items()}
    found = pyvista.UnstructuredGrid({kind: cells}, points)
    found.point_data.update(data)
    found.cell_data["layer"] = layer
    found.field_data.update(dict(grid.field_data.items()))
    return found


def _ground(scene: Scene) -> dict[str, Any]:
    """Surfaces of all pillars and of the flat, what there is of them; in the plane of a section one of both."""
    import pyvista

    x, y, *z = placement(scene).centre
    rim = FARTHEST * scene.radius_um
    if z:
        found = Ground(scene, np.array([x, y, *z]), rim).surfaces(points=POINTS)
        parts = {
            f"{PILLAR}s": [of for kind, of in found if kind == PILLAR],
            FLAT: [of for kind, of in found if kind == FLAT],
        }
        return {name: pyvista.merge(surfaces) for name, surfaces in parts.items() if surfaces}
    bottom = -np.inf if scene.flat is None else scene.flat.y_um - THICK * scene.radius_um
    triangles = polygons(scene, (x - rim, x + rim, bottom, y))
    if not triangles:
        return {}
    corners = np.pad(np.concatenate(triangles), ((0, 0), (0, 0), (0, 1)))
    return {"substrate": surface_of(np.maximum(corners, [-np.inf, bottom, 0.0]))}


def _save(dataset: Any, path: Path) -> None:
    partial = path.with_name(f"{PARTIAL}{os.getpid()}-{path.name}")
    try:
        dataset.save(partial)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _listed(kind: str, entries: list[str]) -> str:
    """A file that names others, which it has the attributes of."""
    rows = "".join(f"<DataSet {entry}/>\n" for entry in entries)
    head = f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian">'
    return f"{head}<{kind}>\n{rows}</{kind}></VTKFile>\n"

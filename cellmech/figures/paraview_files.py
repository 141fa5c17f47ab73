"""Files for ParaView of the whole cell where it is now, layer by layer, and of its substrate."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.errors import InputError
from cellmech.figures.render import surface_of
from cellmech.figures.style import LAYER_COLOURS
from cellmech.results.records import PARTIAL, write_whole
from cellmech.results.result import Result
from cellmech.results.substrate_file import substrate_triangles
from cellmech.results.vtu import IMAGE, MIRRORED
from cellmech.scene.scene import Scene


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
    """A field file's cell, displaced, with its images at x = 0 and z = 0, which are made where the file has none.

    Args:
        grid: of a field file.
        mirrors: axes along which it is mirrored.
    """
    import pyvista

    (kind, cells), *_ = grid.cells_dict.items()
    moved = np.asarray(grid.points) + np.asarray(grid.point_data["displacement_um"])
    points, layer = moved.astype(np.float32), np.asarray(grid.cell_data["layer"])
    data = {name: np.asarray(of, dtype=np.float32) for name, of in grid.point_data.items()}  # half the bytes
    images = IMAGE in grid.cell_data and np.any(grid.cell_data[IMAGE])
    for axis in "" if images else mirrors:
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
    """Surfaces, in the plane sections, of the flat and of all pillars, what there is of them."""
    triangles = substrate_triangles(scene)
    parts = {"flat": [triangles.pop(0)] if 0 in triangles else [], "pillars": list(triangles.values())}
    return {name: surface_of(np.concatenate(corners)) for name, corners in parts.items() if corners}


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

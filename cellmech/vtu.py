"""Field files for ParaView: every triangle with its own points, so that nothing is averaged between neighbours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cellmech.observables import Observer, point_fields
from cellmech.records import CaseFolder

LAYER_CODES = {"nucleoplasm": 0, "lamina": 1, "cytosol": 2, "membrane": 3}


def write_fields(folder: CaseFolder, observer: Observer, t_s: float, series: list[tuple[float, str]]) -> None:
    """Write the last observed state to `fields_<n>.vtu` and list all files so far in `fields.pvd`.

    Point data displacement_um, sigma_mises_Pa, J1, J2, J3, det_F, pressure_Pa, pressure_gradient_Pa_per_um on the
    reference positions; cell data layer (`LAYER_CODES`). Collective on the run's communicator.

    Args:
        folder: of the case.
        observer: has observed the state.
        t_s: its time [s].
        series: (time, file) of what was written before; extended.
    """
    parts = observer.comm.gather(point_fields(observer), root=0)
    name = f"fields_{len(series):04d}.vtu"
    series.append((t_s, name))
    if parts is None:
        return
    data = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    data["layer"] = _layers(observer, data["position"])
    with folder.replace_with(name) as path:
        _write_vtu(path, data)
    rows = "".join(f'<DataSet timestep="{t!r}" file="{file}"/>' for t, file in series)
    header = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    folder.write_text("fields.pvd", f'<?xml version="1.0"?>\n{header}<Collection>{rows}</Collection></VTKFile>\n')


def _layers(observer: Observer, nodes: np.ndarray) -> np.ndarray:
    """By the mean radius of a triangle's points: the centroid of a long curved one lies below its own layer."""
    r = np.linalg.norm(nodes - np.array(observer.layout.centre), axis=-1).mean(axis=1)
    codes = np.full(len(r), LAYER_CODES["membrane"], dtype=np.int32)
    for name in ("cytosol", "lamina", "nucleoplasm"):
        codes[r < observer.layout.regions[name].outer_um] = LAYER_CODES[name]
    return codes


def _write_vtu(path: Path, data: dict[str, np.ndarray]) -> None:
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import VTK_QUADRATIC_TRIANGLE, VTK_TRIANGLE, vtkCellArray, vtkUnstructuredGrid
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    def three(vectors: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(np.pad(vectors.reshape(-1, 2), ((0, 0), (0, 1))))

    n_cells, n_nodes = data["position"].shape[:2]
    grid, points, cells = vtkUnstructuredGrid(), vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(three(data["position"]), deep=True))
    grid.SetPoints(points)
    offsets, nodes = np.arange(0, n_cells * n_nodes + 1, n_nodes), np.arange(n_cells * n_nodes)
    cells.SetData(*(numpy_to_vtkIdTypeArray(ids.astype(np.int64), deep=True) for ids in (offsets, nodes)))
    grid.SetCells(VTK_QUADRATIC_TRIANGLE if n_nodes == 6 else VTK_TRIANGLE, cells)
    for key, values in data.items():
        if key in ("position", "layer"):
            continue
        array = three(values) if values.ndim == 3 else np.ascontiguousarray(values.ravel())
        _add(grid.GetPointData(), key, numpy_to_vtk(array, deep=True))
    _add(grid.GetCellData(), "layer", numpy_to_vtk(data["layer"], deep=True))
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetCompressionLevel(1)  # more takes twice the time and saves 2 %
    writer.EncodeAppendedDataOff()
    if writer.Write() != 1:
        raise OSError(f"VTK could not write {path}")


def _add(attributes: Any, name: str, array: Any) -> None:
    array.SetName(name)
    attributes.AddArray(array)

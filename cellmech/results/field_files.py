"""Field files for ParaView: every element with its own points, so that nothing is averaged between neighbours."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from cellmech.cell.observables import Observer, point_fields
from cellmech.results.records import CaseFolder

VTK_KINDS = {(2, 3): 5, (2, 6): 22, (3, 4): 10, (3, 10): 24}  # by dimension and points of a piece
VTK_TYPES = {"float64": "Float64", "int64": "Int64", "int32": "Int32", "uint8": "UInt8"}
BEYOND = "beyond_ellipticity"
LAYER_CODES = {"nucleoplasm": 0, "lamina": 1, "cytosol": 2, "membrane": 3}


def write_fields(
    folder: CaseFolder, observer: Observer, t_s: float, series: list[tuple[float, str]], beyond: bool = False
) -> None:
    """Write the last observed state to `fields_<n>.vtu` and list all files so far in `fields.pvd`.

    Point data displacement_um, sigma_mises_Pa, J1, J2, J3, det_F, pressure_Pa, pressure_gradient_Pa_per_um on the
    reference positions; cell data layer (`LAYER_CODES`). Collective on the run's communicator.

    Args:
        folder: of the case.
        observer: has observed the state.
        t_s: its time [s].
        series: (time, file) of what was written before; extended.
        beyond: whether the state is beyond the loss of ellipticity; the file then says so (`BEYOND`).
    """
    parts = observer.comm.gather(point_fields(observer), root=0)
    name = f"fields_{len(series):04d}.vtu"
    series.append((t_s, name))
    if parts is None:
        return
    data = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    data["layer"] = _layers(observer, data["position"])
    with folder.replace_with(name) as path:
        _write_vtu(path, data, (BEYOND,) if beyond else ())
    rows = "".join(f'<DataSet timestep="{t!r}" file="{file}"/>' for t, file in series)
    header = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    folder.write_text("fields.pvd", f'<?xml version="1.0"?>\n{header}<Collection>{rows}</Collection></VTKFile>\n')


def _layers(observer: Observer, nodes: np.ndarray) -> np.ndarray:
    """By the mean radius of a piece's points: the centroid of a long curved one lies below its own layer."""
    r = np.linalg.norm(nodes - np.array(observer.layout.centre), axis=-1).mean(axis=1)
    codes = np.full(len(r), LAYER_CODES["membrane"], dtype=np.int32)
    for name in ("cytosol", "lamina", "nucleoplasm"):
        codes[r < observer.layout.regions[name].outer_um] = LAYER_CODES[name]
    return codes


def _write_vtu(path: Path, data: dict[str, np.ndarray], marks: tuple[str, ...] = ()) -> None:
    """Write triangles or tetrahedra as an unstructured grid; without VTK, whose loading takes ten times as long.

    Marks are names of field data of one number, 1.

    Source: VTK file formats, "XML" (docs.vtk.org): appended raw data, each array one block that zlib has compressed.
    """
    n_cells, n_nodes, dim = data["position"].shape
    blocks: list[bytes] = []

    def array(name: str, values: np.ndarray) -> str:
        """The element that announces an array, which is appended."""
        offset = sum(map(len, blocks))
        kind = VTK_TYPES[values.dtype.name]
        raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
        packed = zlib.compress(raw, 1)  # more takes twice the time and saves 2 %
        blocks.append(struct.pack("<4Q", 1, len(raw), 0, len(packed)) + packed)
        parts = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        return f'<DataArray type="{kind}" Name="{name}"{parts} format="appended" offset="{offset}"/>'

    def three(vectors: np.ndarray) -> np.ndarray:
        return np.pad(vectors.reshape(-1, dim), ((0, 0), (0, 3 - dim)))

    fields = {name: values for name, values in data.items() if name not in ("position", "layer")}
    kinds = np.full(n_cells, VTK_KINDS[dim, n_nodes], dtype=np.uint8)
    sections = {
        "PointData": [array(name, three(v) if v.ndim == 3 else v.ravel()) for name, v in fields.items()],
        "CellData": [array("layer", data["layer"])],
        "Points": [array("Points", three(data["position"]))],
        "Cells": [
            array("connectivity", np.arange(n_cells * n_nodes)),
            array("offsets", np.arange(1, n_cells + 1) * n_nodes),
            array("types", kinds),
        ],
    }
    flags = "".join(
        f'<DataArray type="UInt8" Name="{mark}" NumberOfTuples="1" format="ascii">1</DataArray>' for mark in marks
    )
    body = "".join(f"<{name}>{''.join(arrays)}</{name}>\n" for name, arrays in sections.items())
    field_data = f"<FieldData>{flags}</FieldData>" if flags else ""
    head = '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
    head += f'compressor="vtkZLibDataCompressor"><UnstructuredGrid>{field_data}'
    head += f'<Piece NumberOfPoints="{n_cells * n_nodes}" '
    head += f'NumberOfCells="{n_cells}">\n{body}</Piece></UnstructuredGrid>\n<AppendedData encoding="raw">_'
    tail = "</AppendedData></VTKFile>\n"
    path.write_bytes(b"".join([b'<?xml version="1.0"?>\n', head.encode(), *blocks, tail.encode()]))

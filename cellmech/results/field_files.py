"""Field files for ParaView: every element with its own points, so that nothing is averaged between neighbours."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI

from cellmech.cell.observables import Observer, point_fields
from cellmech.fem.domain import whole
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
    comm, data = observer.comm, point_fields(observer)
    data["layer"] = _layers(observer, data["position"])
    name = f"fields_{len(series):04d}.vtu"
    series.append((t_s, name))
    piece, blocks = packed(data)
    pieces = comm.gather(piece, root=0)
    if pieces is None:
        for block in blocks:
            comm.send(block, 0)
        return
    with closing(_in_turn(comm, blocks, pieces)) as all_blocks, folder.replace_with(name) as path:
        write_vtu(path, pieces, all_blocks, (BEYOND,) if beyond else ())
    rows = "".join(f'<DataSet timestep="{t!r}" file="{file}"/>' for t, file in series)
    header = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    folder.write_text("fields.pvd", f'<?xml version="1.0"?>\n{header}<Collection>{rows}</Collection></VTKFile>\n')


def _layers(observer: Observer, nodes: np.ndarray) -> np.ndarray:
    """By its element's group; of smeared layers by its points' mean radius: the centroid of a long one lies below."""
    groups = {number: LAYER_CODES.get(whole(name)) for name, number in observer.run.body.domain.cells.items()}
    if None not in groups.values():
        codes = np.array([groups.get(number, 0) for number in range(max(groups) + 1)], dtype=np.int32)
        elements = observer.samples.groups
        return np.repeat(codes[elements], len(nodes) // max(len(elements), 1))
    r = np.linalg.norm(nodes - np.array(observer.layout.centre), axis=-1).mean(axis=1)
    codes = np.full(len(r), LAYER_CODES["membrane"], dtype=np.int32)
    for name in ("cytosol", "lamina", "nucleoplasm"):
        codes[r < observer.layout.regions[name].outer_um] = LAYER_CODES[name]
    return codes


@dataclass(frozen=True)
class Piece:
    """A rank's part of a file: all but the numbers.

    Args:
        n_points, n_cells: how many.
        arrays: by section, the attributes of each array and the length of its block [bytes].
    """

    n_points: int
    n_cells: int
    arrays: dict[str, list[tuple[str, int]]]

    @property
    def n_blocks(self) -> int:
        """How many blocks it has in the file."""
        return sum(map(len, self.arrays.values()))

    def element(self, offset: int) -> tuple[str, int]:
        """Its XML, where its first block begins there, and where its last one ends."""
        parts = [f'<Piece NumberOfPoints="{self.n_points}" NumberOfCells="{self.n_cells}">\n']
        for section, arrays in self.arrays.items():
            parts.append(f"<{section}>")
            for attributes, length in arrays:
                parts.append(f'<DataArray {attributes} format="appended" offset="{offset}"/>')
                offset += length
            parts.append(f"</{section}>\n")
        return "".join([*parts, "</Piece>"]), offset


def packed(data: dict[str, np.ndarray]) -> tuple[Piece, list[bytes]]:
    """Triangles or tetrahedra as a piece and its blocks; none of no cells.

    Args:
        data: "position" of the points of each cell, shape (n_cells, n_points, d), "layer" of each cell, and values at
            the points, shape (n_cells, n_points) or (n_cells, n_points, d), by name.
    """
    n_cells, n_nodes, dim = data["position"].shape
    if not n_cells:
        return Piece(0, 0, {}), []
    blocks: list[bytes] = []

    def array(name: str, values: np.ndarray) -> tuple[str, int]:
        raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
        inside = zlib.compress(raw, 1)  # more takes twice the time and saves 2 %
        blocks.append(struct.pack("<4Q", 1, len(raw), 0, len(inside)) + inside)
        parts = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        return f'type="{VTK_TYPES[values.dtype.name]}" Name="{name}"{parts}', len(blocks[-1])

    def three(vectors: np.ndarray) -> np.ndarray:
        return np.pad(vectors.reshape(-1, dim), ((0, 0), (0, 3 - dim)))

    fields = {name: values for name, values in data.items() if name not in ("position", "layer")}
    kinds = np.full(n_cells, VTK_KINDS[dim, n_nodes], dtype=np.uint8)
    arrays = {
        "PointData": [array(name, three(v) if v.ndim == 3 else v.ravel()) for name, v in fields.items()],
        "CellData": [array("layer", data["layer"])],
        "Points": [array("Points", three(data["position"]))],
        "Cells": [
            array("connectivity", np.arange(n_cells * n_nodes)),
            array("offsets", np.arange(1, n_cells + 1) * n_nodes),
            array("types", kinds),
        ],
    }
    return Piece(n_cells * n_nodes, n_cells, arrays), blocks


def write_vtu(path: Path, pieces: Sequence[Piece], blocks: Iterable[bytes], marks: tuple[str, ...] = ()) -> None:
    """Write an unstructured grid of several pieces; without VTK, whose loading takes ten times as long.

    Source: VTK file formats, "XML" (docs.vtk.org): appended raw data, each array one block that zlib has compressed.

    Args:
        path: of the file.
        pieces: in order.
        blocks: of all of them, in order.
        marks: names of field data of one number, 1.
    """
    flags = "".join(
        f'<DataArray type="UInt8" Name="{mark}" NumberOfTuples="1" format="ascii">1</DataArray>' for mark in marks
    )
    field_data = f"<FieldData>{flags}</FieldData>" if flags else ""
    head = '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
    head += f'header_type="UInt64" compressor="vtkZLibDataCompressor"><UnstructuredGrid>{field_data}'
    offset = 0
    for piece in pieces:
        if piece.n_cells:
            element, offset = piece.element(offset)
            head += element
    head += '</UnstructuredGrid>\n<AppendedData encoding="raw">_'
    with open(path, "wb") as file:
        file.write(head.encode())
        for block in blocks:
            file.write(block)
        file.write(b"</AppendedData></VTKFile>\n")


def _in_turn(comm: MPI.Comm, own: list[bytes], pieces: Sequence[Piece]) -> Generator[bytes, None, None]:
    """The blocks of all ranks, one at a time: no rank holds those of another. For rank 0.

    They are received whether or not they can be written, as the others wait for that.
    """
    left = [rank for rank, piece in enumerate(pieces) for _ in range(piece.n_blocks) if rank]
    try:
        yield from own
        while left:
            yield comm.recv(source=left.pop(0))
    finally:
        for rank in left:
            comm.recv(source=rank)

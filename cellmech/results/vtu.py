"""Unstructured grids in VTK's XML format: pieces of triangles or tetrahedra, and their images at planes of symmetry."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np

VTK_KINDS = {(2, 3): 5, (2, 6): 22, (3, 4): 10, (3, 10): 24, (3, 3): 5}  # by dimension and points of a cell
VTK_TYPES = {"float64": "Float64", "int64": "Int64", "int32": "Int32", "uint8": "UInt8"}
MIRRORED = {3: (0, 2, 1), 6: (0, 2, 1, 5, 4, 3), 4: (0, 2, 1, 3), 10: (0, 2, 1, 3, 6, 5, 4, 7, 9, 8)}  # keeps the sense
IMAGE = "image"  # cell data: 0 for what was computed, then its images in order

Array = tuple[str, int]  # attributes of an array, and the number of its block


@dataclass(frozen=True)
class Piece:
    """A rank's part of a file, with its images: all but the numbers.

    Args:
        n_points, n_cells: how many, of it and of each image.
        lengths: of its blocks [bytes].
        copies: it and its images; of each by section the arrays. What does not change in a mirror is one block.
    """

    n_points: int
    n_cells: int
    lengths: tuple[int, ...]
    copies: tuple[dict[str, list[Array]], ...]

    def elements(self, offset: int) -> list[str]:
        """XML of it and its images, where its first block begins there."""
        starts = list(accumulate(self.lengths, initial=offset))
        head = f'<Piece NumberOfPoints="{self.n_points}" NumberOfCells="{self.n_cells}">\n'
        found = []
        for sections in self.copies:
            parts = [head]
            for section, arrays in sections.items():
                rows = (f'<DataArray {words} format="appended" offset="{starts[at]}"/>' for words, at in arrays)
                parts += [f"<{section}>", *rows, f"</{section}>\n"]
            found.append("".join([*parts, "</Piece>"]))
        return found


class _Blocks:
    """Arrays as they stand in a file."""

    def __init__(self) -> None:
        self.bytes: list[bytes] = []

    def put(self, name: str, values: np.ndarray) -> Array:
        """Add an array of shape (n,) or (n, components)."""
        raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
        inside = zlib.compress(raw, 1)  # more takes twice the time and saves 2 %
        self.bytes.append(struct.pack("<4Q", 1, len(raw), 0, len(inside)) + inside)
        parts = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        return f'type="{VTK_TYPES[values.dtype.name]}" Name="{name}"{parts}', len(self.bytes) - 1


def packed(
    position: np.ndarray, points: Mapping[str, np.ndarray], cells: Mapping[str, np.ndarray], mirrors: str = ""
) -> tuple[Piece, list[bytes]]:
    """Triangles or tetrahedra, with their images, as a piece and its blocks; none of no cells.

    Args:
        position: of the points of each cell, shape (n_cells, n_points, d).
        points: values there by name, shape (n_cells, n_points), or (n_cells, n_points, d) of a vector.
        cells: values of each cell by name, shape (n_cells,).
        mirrors: axes along which images are added, of what is there by then.
    """
    n_cells, n_nodes, dim = position.shape
    if not n_cells:
        return Piece(0, 0, (), ()), []
    blocks = _Blocks()
    order = np.arange(n_cells * n_nodes).reshape(n_cells, n_nodes)

    def three(vectors: np.ndarray) -> np.ndarray:
        return np.pad(vectors.reshape(-1, dim), ((0, 0), (0, 3 - dim)))

    vectors = {name: three(values) for name, values in points.items() if values.ndim == 3}
    places = three(position)
    scalars = {name: blocks.put(name, values.ravel()) for name, values in points.items() if values.ndim == 2}
    of_cells = [blocks.put(name, values) for name, values in cells.items()]
    offsets = blocks.put("offsets", np.arange(1, n_cells + 1) * n_nodes)
    kinds = blocks.put("types", np.full(n_cells, VTK_KINDS[dim, n_nodes], dtype=np.uint8))
    connected = [blocks.put("connectivity", order.ravel())]
    if mirrors:
        connected.append(blocks.put("connectivity", order[:, MIRRORED[n_nodes]].ravel()))
    copies = []
    for image, sign in enumerate(_signs(mirrors)):
        number = blocks.put(IMAGE, np.full(n_cells, image, dtype=np.uint8))
        copies.append(
            {
                "PointData": [
                    scalars[name] if name in scalars else blocks.put(name, vectors[name] * sign) for name in points
                ],
                "CellData": [*of_cells, number],
                "Points": [blocks.put("Points", places * sign)],
                "Cells": [connected[int(np.prod(sign) < 0)], offsets, kinds],
            }
        )
    return Piece(n_cells * n_nodes, n_cells, tuple(map(len, blocks.bytes)), tuple(copies)), blocks.bytes


def _signs(mirrors: str) -> Iterator[np.ndarray]:
    """Of the coordinates, for each image."""
    for image in range(2 ** len(mirrors)):
        sign = np.ones(3)
        for bit, axis in enumerate(mirrors):
            if image >> bit & 1:
                sign["xyz".index(axis)] = -1.0
        yield sign


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
        head += "".join(piece.elements(offset))
        offset += sum(piece.lengths)
    head += '</UnstructuredGrid>\n<AppendedData encoding="raw">_'
    with open(path, "wb") as file:
        file.write(head.encode())
        for block in blocks:
            file.write(block)
        file.write(b"</AppendedData></VTKFile>\n")

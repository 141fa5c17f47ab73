"""Field files for ParaView: the whole cell, every element with its own points, and what it stands on.

So nothing is averaged between neighbours.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing

import numpy as np
from mpi4py import MPI

from cellmech.cell.observables import Observer, point_fields
from cellmech.fem.domain import whole
from cellmech.results.records import SUBSTRATE, CaseFolder
from cellmech.results.substrate_file import write_substrate
from cellmech.results.vtu import Piece, packed, write_vtu
from cellmech.scene.scene import Scene

BEYOND = "beyond_ellipticity"
LAYER_CODES = {"nucleoplasm": 0, "lamina": 1, "cytosol": 2, "membrane": 3}


def write_fields(
    folder: CaseFolder,
    scene: Scene,
    observer: Observer,
    t_s: float,
    series: list[tuple[float, str]],
    beyond: bool = False,
) -> None:
    """Write the last observed state to `fields_<n>.vtu` and list all files so far in `fields.pvd`.

    Point data displacement_um, sigma_mises_Pa, J1, J2, J3, det_F, pressure_Pa, pressure_gradient_Pa_per_um on the
    reference positions; cell data layer (`LAYER_CODES`) and image, 0 for what was computed. The first time, obstacles
    are written to `substrate.vtu`, which is listed beside each. Collective on the run's communicator.

    Args:
        folder: of the case.
        scene: whose planes of symmetry mirror the cell, unless `output.whole_cell` is off; and its obstacles.
        observer: has observed the state.
        t_s: its time [s].
        series: (time, file) of what was written before; extended.
        beyond: whether the state is beyond the loss of ellipticity; the file then says so (`BEYOND`).
    """
    comm, points = observer.comm, point_fields(observer)
    position = points.pop("position")
    name = f"fields_{len(series):04d}.vtu"
    series.append((t_s, name))
    mirrors = scene.mirrors if scene.output.whole_cell else ""
    piece, blocks = packed(position, points, {"layer": _layers(observer, position)}, mirrors)
    pieces = comm.gather(piece, root=0)
    if pieces is None:
        for block in blocks:
            comm.send(block, 0)
        return
    with closing(_in_turn(comm, blocks, pieces)) as all_blocks, folder.replace_with(name) as path:
        write_vtu(path, pieces, all_blocks, (BEYOND,) if beyond else ())
    if len(series) == 1:
        write_substrate(folder, scene)
    files = [(t, f'file="{file}"') for t, file in series]
    if (folder.path / SUBSTRATE).exists():
        files += [(t, f'part="1" file="{SUBSTRATE}"') for t, _ in series]
    rows = "".join(f'<DataSet timestep="{t!r}" {words}/>' for t, words in files)
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


def _in_turn(comm: MPI.Comm, own: list[bytes], pieces: Sequence[Piece]) -> Generator[bytes, None, None]:
    """The blocks of all ranks, one at a time: no rank holds those of another. For rank 0.

    They are received whether or not they can be written, as the others wait for that.
    """
    left = [rank for rank, piece in enumerate(pieces) for _ in piece.lengths if rank]
    try:
        yield from own
        while left:
            yield comm.recv(source=left.pop(0))
    finally:
        for rank in left:
            comm.recv(source=rank)

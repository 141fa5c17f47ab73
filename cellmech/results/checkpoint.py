"""Checkpoints: all that a run needs to go on, in a form that does not depend on how many ranks there are.

Nodal vectors are stored with the positions of their nodes, by which any other partition of the same mesh finds its own.
"""

from __future__ import annotations

import hashlib
import io
import json
from typing import Any

import numpy as np
from dolfinx import fem

from cellmech.results.records import CHECKPOINT, CaseFolder
from cellmech.solver.schedule import Memory

HASH_BYTES = 32  # SHA-256 of the rest, which is an .npz file
SAME_NODE = 1e-9  # of the mesh's extent: what rounding may move a node between partitions


def save(folder: CaseFolder, space: fem.FunctionSpace, memory: Memory, case: dict[str, Any]) -> None:
    """Write the checkpoint of a case. Collective on the space's communicator.

    Args:
        folder: of the case; its history is brought to disk first.
        space: of the displacement.
        memory: of the run.
        case: what the case itself must remember, as JSON can hold it.
    """
    comm, owned, components = space.mesh.comm, space.dofmap.index_map.size_local, space.dofmap.index_map_bs
    nodes = space.tabulate_dof_coordinates()[:owned, :components]
    mine = {name: values[: components * owned].reshape(-1, components) for name, values in memory.fields.items()}
    parts = comm.gather({"nodes": nodes, **mine}, root=0)
    if parts is None:
        return
    arrays = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    numbers = json.dumps({"run": memory.numbers, "case": case}, allow_nan=False)
    folder.flush(force=True)
    content = io.BytesIO()
    tied = {"key": np.array(folder.key), "rows": np.array(folder.rows), "history_hash": np.array(folder.history_hash())}
    np.savez(content, numbers=np.array(numbers), **tied, **arrays)
    with folder.replace_with(CHECKPOINT) as path:
        path.write_bytes(hashlib.sha256(content.getvalue()).digest() + content.getvalue())


def load(folder: CaseFolder, space: fem.FunctionSpace) -> tuple[Memory, dict[str, Any]] | None:
    """The run's memory and the case's, if the folder holds a checkpoint of this case; else None. Collective.

    A checkpoint that is damaged, or of another mesh, is told of in the log and forgotten; the folder begins afresh.
    """
    comm = space.mesh.comm
    found, fault = _read(folder) if folder.lead else (None, "")
    found = comm.bcast(found)
    if found is not None:
        arrays, numbers = found
        mine, missing = _on_this_rank(arrays, space)
        if not comm.allreduce(missing):
            return Memory(numbers["run"], mine), numbers["case"]
        fault = "it is of another mesh"
    if fault:
        folder.begin_afresh(f"the checkpoint cannot be used ({fault}): solved from the start")
    return None


def _read(folder: CaseFolder) -> tuple[tuple[dict[str, np.ndarray], dict[str, Any]] | None, str]:
    try:
        whole = (folder.path / CHECKPOINT).read_bytes()
    except FileNotFoundError:
        return None, ""
    except OSError as error:
        return None, str(error.strerror)
    digest, content = whole[:HASH_BYTES], whole[HASH_BYTES:]
    if hashlib.sha256(content).digest() != digest:
        return None, "it is damaged"
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays.pop("key")) != folder.key:
            return None, "it is of other inputs or another version of the program"
        numbers = json.loads(str(arrays.pop("numbers")))
        folder.resume(int(arrays.pop("rows")), str(arrays.pop("history_hash")))
    except (OSError, ValueError) as error:  # of history.csv
        return None, " ".join(str(error).split())
    return (arrays, numbers), ""


def _on_this_rank(arrays: dict[str, np.ndarray], space: fem.FunctionSpace) -> tuple[dict[str, np.ndarray], int]:
    """The vectors at this rank's nodes, ghosts included, flat; and how many nodes were not found."""
    from scipy.spatial import cKDTree  # a tenth of the start of Python, for those who go on from a checkpoint only

    arrays = dict(arrays)
    nodes, here = arrays.pop("nodes"), space.tabulate_dof_coordinates()[:, : space.dofmap.index_map_bs]
    if len(nodes) != space.dofmap.index_map.size_global:
        return {}, 1
    distance, index = cKDTree(nodes).query(here) if len(here) else (np.zeros(0), np.zeros(0, dtype=int))
    missing = np.count_nonzero(distance > SAME_NODE * np.ptp(nodes, axis=0).max())
    return {name: values[index].ravel() for name, values in arrays.items()}, int(missing)

"""Meshes kept beside the compiled equations: what was meshed before needs no Gmsh, whose loading takes longer.

What is kept are the answers of a Gmsh model to what `gmshio` asks, so that mesh and numbers are those of the model
itself. A mesh is found by its specification, by the modules that make it and by the Gmsh that is installed.
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from cellmech.mesh.ball import BallSpec
from cellmech.mesh.disc import DiscSpec
from cellmech.sources import cache_directory, hash_behind

MAKERS = ("cellmech.mesh.geometry", "cellmech.mesh.ball_mesh")
HASH_BYTES = 32  # SHA-256 of the rest, which is an .npz file
MOST, MOST_NODES = 64, 100_000  # meshes that are kept, and nodes of one that is


class KeptModel:
    """Answers as a Gmsh model does, from arrays: `nodes`, `x`, and for each group its name and its elements."""

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        self._arrays, self.mesh = arrays, self
        self._groups = [(int(dim), int(tag)) for dim, tag in arrays["groups"]]
        self._properties = {int(kind): (int(dim), int(nodes)) for kind, dim, nodes in arrays["properties"]}

    @classmethod
    def of(cls, x: np.ndarray, groups: Sequence[tuple[int, str, int, np.ndarray]]) -> KeptModel:
        """A model of groups that have one entity each.

        Args:
            x: positions of the nodes [µm], shape (n, 3).
            groups: dimension, name, Gmsh's kind of element, and the numbers of nodes from 0, a row for each element.
        """
        numbers = [(dim, tag) for tag, (dim, *_) in enumerate(groups, 1)]
        arrays = {"nodes": np.arange(1, len(x) + 1), "x": x.ravel(), "groups": np.array(numbers)}
        arrays["names"] = np.array([name for _, name, _, _ in groups])
        first = 1
        for (dim, tag), (_, _, kind, nodes) in zip(numbers, groups, strict=True):
            arrays[f"entities {dim} {tag}"], arrays[f"kind {dim} {tag}"] = np.array([tag]), np.array([kind])
            arrays[f"elements {dim} {tag}"] = np.arange(first, first := first + len(nodes))
            arrays[f"element nodes {dim} {tag}"] = nodes.ravel() + 1
        kinds = {kind: (kind, dim, nodes.shape[1]) for dim, _, kind, nodes in groups}
        arrays["properties"] = np.array(list(kinds.values()))
        return cls(arrays)

    def getPhysicalGroups(self, dim: int = -1) -> list[tuple[int, int]]:
        """Dimension and number of the groups."""
        return [group for group in self._groups if dim in (-1, group[0])]

    def getPhysicalName(self, dim: int, tag: int) -> str:
        """Name of a group."""
        return str(self._arrays["names"][self._groups.index((dim, tag))])

    def getEntitiesForPhysicalGroup(self, dim: int, tag: int) -> np.ndarray:
        """Numbers of a group's entities."""
        return self._arrays[f"entities {dim} {tag}"]

    def getNodes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers and coordinates of the nodes."""
        return self._arrays["nodes"].copy(), self._arrays["x"].copy(), np.zeros(0)

    def getElements(self, dim: int, tag: int) -> tuple[Any, Any, Any]:
        """Kind, numbers and nodes of an entity's elements."""
        kind, numbers, nodes = (self._arrays[f"{part} {dim} {tag}"] for part in ("kind", "elements", "element nodes"))
        return kind, [numbers], [nodes]

    def getElementProperties(self, kind: int) -> tuple[str, int, int, int, np.ndarray, int]:
        """Dimension and number of nodes of a kind of elements, in Gmsh's places."""
        dim, nodes = self._properties[int(kind)]
        return "", dim, 0, nodes, np.zeros(0), 0


def arrays_of(model: Any) -> dict[str, np.ndarray]:
    """The content of a `KeptModel`, taken from a Gmsh model."""
    nodes, x, _ = model.mesh.getNodes()
    groups = model.getPhysicalGroups()
    names = [model.getPhysicalName(*group) for group in groups]
    arrays = {"nodes": nodes, "x": x, "groups": np.array(groups).reshape(-1, 2), "names": np.array(names)}
    kinds = {}
    for dim, tag in groups:
        arrays[f"entities {dim} {tag}"] = entities = model.getEntitiesForPhysicalGroup(dim, tag)
        for entity in entities:
            kind, elements, element_nodes = model.mesh.getElements(dim, int(entity))
            arrays[f"kind {dim} {entity}"] = np.array(kind)
            arrays[f"elements {dim} {entity}"], arrays[f"element nodes {dim} {entity}"] = elements[0], element_nodes[0]
            _, extent, _, count, *_ = model.mesh.getElementProperties(int(kind[0]))
            kinds[int(kind[0])] = (int(kind[0]), extent, count)
    return arrays | {"properties": np.array(list(kinds.values()))}


def kept(spec: DiscSpec | BallSpec) -> KeptModel | None:
    """The mesh of this disc or ball if it was meshed before; one that is damaged is none."""
    with suppress(OSError, ValueError, KeyError):
        whole = _place(spec).read_bytes()
        digest, content = whole[:HASH_BYTES], whole[HASH_BYTES:]
        if hashlib.sha256(content).digest() == digest:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                return KeptModel({name: file[name] for name in file.files})
    return None


def keep(spec: DiscSpec | BallSpec, model: Any) -> None:
    """Keep this mesh for later processes; a disk that refuses only costs them time."""
    arrays = arrays_of(model)
    if len(arrays["nodes"]) > MOST_NODES:
        return
    content = io.BytesIO()
    np.savez(content, **arrays)
    with suppress(OSError):
        path = _place(spec)
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f"{path.name}.{os.getpid()}")
        try:
            partial.write_bytes(hashlib.sha256(content.getvalue()).digest() + content.getvalue())
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
        newest_last = sorted(path.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in newest_last[:-MOST]:
            old.unlink(missing_ok=True)


@contextmanager
def without_gmsh() -> Iterator[None]:
    """Let `dolfinx.io.gmshio` be imported without Gmsh, of which it wants a name for its annotations only."""
    stand_in: Any = None
    if not {"gmsh", "dolfinx.io.gmshio"} & sys.modules.keys():
        stand_in = ModuleType("gmsh")
        stand_in.model = KeptModel
        sys.modules["gmsh"] = stand_in
    try:
        yield
    finally:
        if stand_in is not None and sys.modules.get("gmsh") is stand_in:
            del sys.modules["gmsh"]


def _place(spec: DiscSpec | BallSpec) -> Path:
    """The file of a mesh."""
    found = hashlib.sha256(repr(spec).encode())
    found.update(_makers())
    return cache_directory() / "meshes" / f"{found.hexdigest()}.npz"


@lru_cache
def _makers() -> bytes:
    """A hash of the modules that make a mesh, as they are at the first call, and of the Gmsh installed."""
    found = hashlib.sha256()
    for name in MAKERS:
        found.update(hash_behind(name).encode())
    gmsh = importlib.util.find_spec("gmsh")
    if gmsh is not None and gmsh.origin:
        state = os.stat(gmsh.origin)
        found.update(f"{gmsh.origin} {state.st_size} {state.st_mtime_ns}".encode())
    return found.digest()

"""Layered discs and rings as Gmsh models with named physical groups (the only gmsh import).

Every geometry is first written as a Gmsh script, the same text that `meshes/` holds for viewing, then meshed from it.
Layers thinner than the elements around them are structured: elongated triangles whose edges follow the circles.
"""

from __future__ import annotations

import signal
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.errors import MeshError
from cellmech.mesh.disc import DiscSpec, check, layer_rules, mesh_rules
from cellmech.mesh.disc_script import SIDE, TOP, disc_script, disc_sectors
from cellmech.mesh.geo_script import GeoScript, Sector

_KIND = {(1, 1): 1, (1, 2): 8, (2, 1): 2, (2, 2): 9}  # Gmsh's number of an element by dimension and order


@contextmanager
def build_disc(spec: DiscSpec) -> Iterator[Any]:
    """Mesh a disc; the Gmsh model lives until the `with` block ends.

    The mesh depends on the specification only. Second-order nodes of circles and of structured layers lie on circles
    about the centre. A full disc is exactly symmetric about its vertical axis.

    Raises:
        MeshError: Gmsh failed.
    """
    script, sectors = disc_sectors(replace(spec, shape="half"))
    with _meshed(script, sectors[0], spec.order) as model:
        if spec.shape == "full":
            _complete(model, spec.order)
        yield model


@contextmanager
def build_ring(
    inner_um: float, interfaces: Sequence[tuple[str, float]], size_um: float, order: int = 2
) -> Iterator[Any]:
    """Mesh the first quadrant of a ring about the origin, for verification; the model lives as long as the block.

    Groups are the layers, "inner", "outer", "axis_x" (the edge on y = 0) and "axis_y".

    Args:
        inner_um: inner radius [µm].
        interfaces: layers from the inside out: name and outer radius [µm].
        size_um: element size [µm].
        order: 1 for straight triangles, 2 for curved ones.

    Raises:
        InputError: a value breaks its rule.
        MeshError: Gmsh failed.
    """
    check(
        "build_ring", *layer_rules(inner_um, interfaces), *mesh_rules(order, {"inner_um": inner_um, "size_um": size_um})
    )
    script = GeoScript((0.0, 0.0))
    radii = [inner_um, *(radius for _, radius in interfaces)]
    across = [int(outer - inner < size_um) for inner, outer in pairwise(radii)]
    sector = script.sector(radii, (SIDE, TOP), [0, *across], solid=False)
    for (name, _), annulus in zip(interfaces, sector.annuli, strict=True):
        script.group(2, name, annulus.surfaces)
    for name, curves in (("inner", sector.arcs[0]), ("outer", sector.arcs[-1])):
        script.group(1, name, curves)
    script.group(1, "axis_x", sector.start)
    script.group(1, "axis_y", sector.end)
    script.sizes([repr(float(size_um))], order)
    with _meshed(script, sector, order) as model:
        yield model


def write_reference_geometries(folder: Path) -> list[Path]:
    """Write the half and the full disc of Table 1 as Gmsh scripts into `folder`; returns the files."""
    files = []
    for shape in ("half", "full"):
        note = f"// The {shape} disc of Table 1 [µm]. Written by cellmech.mesh.geometry.write_reference_geometries.\n"
        files.append(folder / f"table1-{shape}.geo")
        files[-1].write_text(note + disc_script(DiscSpec(shape)))
    return files


@contextmanager
def interrupt_kept() -> Iterator[None]:
    """Keep Ctrl-C working: Gmsh takes the handler when imported, started and ended, also inside dolfinx.io.gmshio.

    Outside the main thread, where Python lets nobody take it, Gmsh does not get to hear of that.
    """
    if threading.current_thread() is not threading.main_thread():
        with _signals_for_main_thread():
            yield
        return
    handler = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        if handler is not None and signal.getsignal(signal.SIGINT) is not handler:
            signal.signal(signal.SIGINT, handler)


@contextmanager
def _signals_for_main_thread() -> Iterator[None]:
    """Have `signal.signal` do nothing in other threads, instead of raising."""
    module: Any = signal
    real = module.signal

    def take(signum: Any, handler: Any) -> Any:
        in_main = threading.current_thread() is threading.main_thread()
        return real(signum, handler) if in_main else signal.getsignal(signum)

    module.signal = take
    try:
        yield
    finally:
        module.signal = real


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """Gmsh, quiet and with its own defaults, as long as the block lasts."""
    with interrupt_kept():
        import gmsh
    with interrupt_kept():
        with interrupt_kept():
            gmsh.initialize([], False)  # the user's own Gmsh options would change the mesh
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            yield gmsh
        finally:
            gmsh.finalize()


@contextmanager
def _meshed(script: GeoScript, sector: Sector, order: int) -> Iterator[Any]:
    with gmsh_session() as gmsh, tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cellmech.geo"
        path.write_text(script.text(), encoding="utf-8")
        with gmsh_errors():
            gmsh.open(str(path))
            gmsh.model.mesh.generate(2)
        if order == 2:
            _bend(gmsh.model, sector, np.array(script.centre))
        yield gmsh.model


@contextmanager
def gmsh_errors() -> Iterator[None]:
    """What Gmsh raises, which is of one type only, is a MeshError."""
    try:
        yield
    except Exception as error:
        raise MeshError(f"Gmsh could not mesh the geometry: {error}") from error


def _bend(model: Any, sector: Sector, centre: np.ndarray) -> None:
    """Put the mid-edge nodes of circles and structured annuli on circles about the centre."""
    edges = [_nodes(model, 1, arc, 2) for arcs in sector.arcs for arc in arcs]
    for annulus in sector.annuli:
        for number in annulus.surfaces if annulus.structured else ():
            triangles = _nodes(model, 2, number, 2)
            edges += [triangles[:, corners] for corners in ([0, 1, 3], [1, 2, 4], [2, 0, 5])]
    first, second, middle = np.unique(np.concatenate(edges), axis=0).T
    x = _positions(model)
    a, b = x[first] - centre, x[second] - centre
    ra, rb = (np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    direction = a / ra + b / rb
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    for tag, (px, py) in zip(middle, centre + (ra + rb) / 2 * direction, strict=True):
        model.mesh.setNode(int(tag), [px, py, 0.0], [])


def _complete(model: Any, order: int) -> None:
    """Make a half disc's model one of the full disc: each group one discrete entity, group "axis" left out.

    Gmsh's own copies of a surface are mirror images to 1e-7 µm only, and clockwise.
    """
    x = _positions(model)
    groups = [(dim, tag, model.getPhysicalName(dim, tag)) for dim, tag in model.getPhysicalGroups()]
    elements = {(dim, name): _group_nodes(model, dim, tag, order) for dim, tag, name in groups}
    on_axis = np.unique(elements.pop((1, "axis")))
    axis = x[on_axis[0], 0]
    x[on_axis, 0] = axis
    image = np.arange(len(x)) + len(x)
    image[on_axis] = on_axis
    x = np.concatenate([x, x * [-1.0, 1.0] + [2.0 * axis, 0.0]])
    flip = {1: [1, 0, 2][: order + 1], 2: [0, 2, 1, 5, 4, 3][: 3 * order]}  # keeps triangles counterclockwise
    elements = {key: np.concatenate([own, image[own][:, flip[key[0]]]]) for key, own in elements.items()}
    used = np.unique(np.concatenate([nodes.ravel() for nodes in elements.values()]))
    model.add("full disc")
    for number, ((dim, name), nodes) in enumerate(elements.items(), 1):
        model.addDiscreteEntity(dim, number)
        model.addPhysicalGroup(dim, [number], number)
        model.setPhysicalName(dim, number, name)
        if number == 1:
            points = np.column_stack([x[used], np.zeros(len(used))])
            model.mesh.addNodes(dim, number, np.arange(1, len(used) + 1), points.ravel())
        model.mesh.addElementsByType(number, _KIND[dim, order], [], np.searchsorted(used, nodes.ravel()) + 1)


def _group_nodes(model: Any, dim: int, group: int, order: int) -> np.ndarray:
    entities = model.getEntitiesForPhysicalGroup(dim, group)
    return np.concatenate([_nodes(model, dim, entity, order) for entity in entities])


def _nodes(model: Any, dim: int, entity: int, order: int) -> np.ndarray:
    """Node numbers of an entity's elements, a row each."""
    _, nodes = model.mesh.getElementsByType(_KIND[dim, order], entity)
    return nodes.astype(np.int64).reshape(-1, {1: 1 + order, 2: 3 * order}[dim])


def _positions(model: Any) -> np.ndarray:
    """Coordinates [µm] by node number, shape (largest number + 1, 2)."""
    tags, x, _ = model.mesh.getNodes()
    positions = np.zeros((int(tags.max()) + 1, 2))
    positions[tags.astype(np.int64)] = x.reshape(-1, 3)[:, :2]
    return positions

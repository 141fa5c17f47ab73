"""A block in space with a thin, stiff layer, held at its foot and pushed sideways at its top."""

from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from cellmech.fem import jit
from cellmech.fem.coefficients import material_fields
from cellmech.fem.domain import Domain
from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import THREE_D
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.materials import Material
from cellmech.mechanics.moduli import lame

LEVELS = (0.0, 0.3, 0.35, 0.65, 1.0)  # of rows of cells 0.25 wide: the second is thin
PUSH = 0.6
MODULI = {"soft": 10.0, "stiff": 3000.0}  # Pa


def slab(comm: MPI.Comm, order: int = 2) -> Body:
    """The block, of edges 1 µm."""
    kind = dmesh.CellType.tetrahedron
    mesh = dmesh.create_box(comm, [np.zeros(3), np.ones(3)], [4, 4, 4], kind)
    mesh.geometry.x[:, 2] = np.interp(mesh.geometry.x[:, 2], np.linspace(0, 1, 5), LEVELS)
    index_map = mesh.topology.index_map(3)
    cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    middle = dmesh.compute_midpoints(mesh, 3, cells)[:, 2]
    thin = (middle > LEVELS[1]) & (middle < LEVELS[2])
    mesh.topology.create_connectivity(2, 3)
    ends = [dmesh.locate_entities_boundary(mesh, 2, lambda x, z=z: np.isclose(x[2], z)) for z in (0.0, 1.0)]
    facets = np.concatenate(ends).astype(np.int32)
    numbers = np.repeat(np.array([1, 2], dtype=np.int32), [len(found) for found in ends])
    order_of_facets = np.argsort(facets)
    domain = Domain(
        mesh,
        dmesh.meshtags(mesh, 3, cells, np.where(thin, 2, 1).astype(np.int32)),
        dmesh.meshtags(mesh, 2, facets[order_of_facets], numbers[order_of_facets]),
        {"soft": 1, "stiff": 2},
        {"foot": 1, "top": 2},
        {},
    )
    return _body(domain, order, ends[0])


def _body(domain: Domain, order: int, foot: np.ndarray) -> Body:
    space: Any = jit.displacement_space(domain.mesh, order)
    bcs = tuple(
        fem.dirichletbc(np.float64(0.0), fem.locate_dofs_topological(space.sub(k), 2, foot), space.sub(k))
        for k in range(3)
    )
    materials = {}
    for name, young in MODULI.items():
        lmbda, mu = lame(young, 0.45)
        materials[name] = Material(LAWS["neo-hookean"], {"lmbda": lmbda, "mu": mu})
    push = {"top": (PUSH, 0.0, 0.0)}
    return Body(
        domain,
        material_fields(domain, materials),
        space,
        bcs,
        body_force=(0.0, 0.0, 0.0),
        tractions=push,
        bulk_degree=2,
        kinematics=THREE_D,
        shells={"stiff": MODULI["stiff"] / MODULI["soft"]},
    )

"""Small bodies with known answers, built from the package's own parts: no scene, no geometry of a cell."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from cellmech.fem import jit
from cellmech.fem.domain import Domain, build_domain, from_gmsh
from cellmech.fem.jit import PointValues
from cellmech.mechanics.balance import Body
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.materials import Material
from cellmech.mechanics.moduli import lame
from cellmech.mesh.geometry import DiscSpec, build_ring
from cellmech.solver import bdf
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

LAW_NAMES = tuple(LAWS)
TRIED = {"i1_limit": 40.0}
"""Constants of laws, by their keys, that tests set otherwise than their default: not at 1, and for strains of 1."""
Where = Callable[[np.ndarray], np.ndarray]


# Meshes


def domain_of(mesh: Any, cells: Mapping[str, Where] | None = None, facets: Mapping[str, Where] | None = None) -> Domain:
    """A mesh with groups named by where they are; an entity belongs to the last group it lies in."""
    cells = cells or {"solid": lambda x: np.full(x.shape[1], True)}
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    tags = [_tags(mesh, dim, cells), _tags(mesh, dim - 1, facets or {})]
    numbers = [{name: k for k, name in enumerate(group, 1)} for group in (cells, facets or {})]
    return Domain(mesh=mesh, cell_tags=tags[0], facet_tags=tags[1], cells=numbers[0], facets=numbers[1], quality={})


def _tags(mesh: Any, dim: int, groups: Mapping[str, Where]) -> Any:
    value: dict[int, int] = {}
    for k, where in enumerate(groups.values(), 1):
        value.update(dict.fromkeys(dmesh.locate_entities(mesh, dim, where), k))
    entities = np.array(sorted(value), dtype=np.int32)
    return dmesh.meshtags(mesh, dim, entities, np.array([value[e] for e in entities], dtype=np.int32))


def block(width: float = 1.0, height: float = 1.0, nx: int = 1, ny: int = 1, bottom: str = "bottom") -> Domain:
    """A rectangle [0, width] x [0, height] with its sides as groups; contact acts on one named "outer"."""
    corners = [np.zeros(2), np.array([width, height])]
    mesh = dmesh.create_rectangle(MPI.COMM_SELF, corners, [nx, ny], dmesh.CellType.triangle)
    sides = {
        bottom: lambda x: np.isclose(x[1], 0.0),
        "left": lambda x: np.isclose(x[0], 0.0),
        "right": lambda x: np.isclose(x[0], width),
        "top": lambda x: np.isclose(x[1], height),
    }
    return domain_of(mesh, facets=sides)


def curved_ring(size: float, inner: float = 1.0, layers: Sequence[tuple[str, float]] = (("solid", 2.0),)) -> Domain:
    """A quarter of a ring in curved triangles; groups are its layers, "inner", "outer", "axis_x" and "axis_y"."""
    with build_ring(inner, layers, size) as model:
        return from_gmsh(model, MPI.COMM_SELF)


def rows_ring(n: int, cells: Mapping[str, Where] | None = None) -> Domain:
    """`curved_ring` in n rows of triangles, alike for every n: structured, the rows being thinner than `size`."""
    rows = curved_ring(1.05 / n, 1.0, [(f"row {k}", 1.0 + k / n) for k in range(1, n + 1)])
    return replace(rows, **{field: getattr(domain_of(rows.mesh, cells), field) for field in ("cell_tags", "cells")})


def layered_disc(**spec: Any) -> Domain:
    """The half disc of Table 1 with its thin lamina in curved triangles, or another."""
    return build_domain(DiscSpec(**spec), MPI.COMM_SELF)


# Spaces and boundary data


def displacement_space(domain: Domain, degree: int = 2) -> Any:
    """Continuous vector Lagrange functions."""
    return jit.displacement_space(domain.mesh, degree)


def hold(space: Any, domain: Domain, group: str, component: int, value: float = 0.0) -> Any:
    """One displacement component given on a facet group."""
    facets = domain.facet_tags.find(domain.facets[group])
    dofs = fem.locate_dofs_topological(space.sub(component), domain.facet_tags.dim, facets)
    return fem.dirichletbc(np.float64(value), dofs, space.sub(component))


def prescribe(space: Any, domain: Domain, groups: Sequence[str], values: fem.Function) -> Any:
    """Both displacement components given on facet groups."""
    facets = np.concatenate([domain.facet_tags.find(domain.facets[group]) for group in groups])
    return fem.dirichletbc(values, fem.locate_dofs_topological(space, domain.facet_tags.dim, facets))


def affine(space: Any, H: Any, offset: Sequence[float] | float = 0.0) -> np.ndarray:
    """Nodal values of u = H X + offset, flat, in the plane or in space."""
    X = space.tabulate_dof_coordinates()[:, : len(H)]
    return (X @ np.asarray(H, dtype=float).T + np.asarray(offset)).ravel()


# Materials


def moduli(law: str, young: float, poisson: float, **more: float) -> dict[str, float]:
    """The constants a law asks for [Pa]; of `more`, by the keys of scene files, those that it has."""
    lmbda, mu = lame(young, poisson)
    given = TRIED | more
    own = LAWS[law].constants.items()
    values = {name: given.get(c.key, c.default) * (mu if c.times_mu else 1.0) for name, c in own}
    return {"lmbda": lmbda, "mu": mu, **values}


def solid(law: str = "neo-hookean", young: float = 10.0, poisson: float = 0.3, **more: float) -> Material:
    """A solid without fluid."""
    return Material(LAWS[law], moduli(law, young, poisson, **more))


def wet(law: str = "neo-hookean", young: float = 10.0, poisson: float = 0.3, **fluid: float) -> Material:
    """A solid with fluid."""
    return Material(LAWS[law], moduli(law, young, poisson), **{"fluid_fraction": 0.5, **fluid})


# Values


def value_at(expression: Any, domain: Domain, point: Sequence[float] = (0.25, 0.25), cell: int = 0) -> np.ndarray:
    """A UFL expression, compiled, at one reference point of one cell; flat."""
    return PointValues(expression, np.array([point]), domain.mesh.comm)(np.array([cell], dtype=np.int32))[0, 0]


# Time


def march(
    body: Body,
    force_scale: float,
    steps: Sequence[float],
    on_step: Callable[[float], None] = lambda t: None,
    state: State | None = None,
    tolerance: float = 1e-12,
) -> State:
    """Fixed steps [s] through the parts the time loop is made of; `on_step(t)` is called before the history moves."""
    state = state or State(body)
    solver = Solver(body, state, force_scale, tolerance)
    t = 0.0
    for k, h in enumerate(steps):
        t += h
        a = bdf.coefficients([h] if k == 0 else [h, steps[k - 1]])
        state.ddt.set(a)
        outcome = solver.solve(body.amplitude(t))
        assert outcome.converged, outcome.reason
        on_step(t)
        state.advance(a, body.density is not None)
    return state

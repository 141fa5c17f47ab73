"""What a FEniCSx user writes first: Table 1, neo-Hookean, in one script. The baseline that speed is measured against.

BDF2 with fixed 200 s steps, P2 on a uniform layered mesh, full Newton with backtracking, MUMPS refactored at every
iteration, UFL's own choice of quadrature. It deliberately shares nothing with the package (DOLFINx 0.5).
"""

from __future__ import annotations

import json
import sys
import time

import gmsh
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from dolfinx.io import gmshio
from mpi4py import MPI
from petsc4py import PETSc

RADII = {"nucleoplasm": 4.9, "lamina": 5.0, "cytosol": 9.5, "membrane": 10.0}
YOUNG = {"nucleoplasm": 10.0, "lamina": 1000.0, "cytosol": 10.0, "membrane": 100.0}
CENTRE, NU, C_F, LAMBDA_F, MU_F = 9.5, 0.45, 0.5, 1000.0, 5e-3
RHO_G, KAPPA, SMOOTHING, T_G = 1000 * 9.81e-6, 50.0, 0.005, 5000.0


def half_disc(size):
    """A half disc of four layers, triangles of one size."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    centre = geo.addPoint(0, CENTRE, 0)
    low = high = centre
    arcs, surfaces, axis = None, [], []
    for r in RADII.values():
        b, e, t = (geo.addPoint(x, y, 0) for x, y in ((0, CENTRE - r), (r, CENTRE), (0, CENTRE + r)))
        new = [geo.addCircleArc(b, centre, e), geo.addCircleArc(e, centre, t)]
        lines = [geo.addLine(low, b), geo.addLine(t, high)]
        inner = [] if arcs is None else [-arcs[1], -arcs[0]]
        surfaces.append(geo.addPlaneSurface([geo.addCurveLoop([lines[0], *new, lines[1], *inner])]))
        axis += lines
        low, high, arcs = b, t, new
    geo.synchronize()
    for k, surface in enumerate(surfaces):
        gmsh.model.addPhysicalGroup(2, [surface], k + 1)
    gmsh.model.addPhysicalGroup(1, axis, 1)
    gmsh.model.addPhysicalGroup(1, arcs, 2)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    result = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=2)
    gmsh.finalize()
    return result


def solve(size, dt=200.0, end=18000.0):
    """Solve and return the numbers the benchmark compares."""
    started = time.perf_counter()
    mesh, cell_tags, facet_tags = half_disc(size)
    V, Q = fem.VectorFunctionSpace(mesh, ("Lagrange", 2)), fem.FunctionSpace(mesh, ("DG", 0))
    E = fem.Function(Q)
    for k, young in enumerate(YOUNG.values()):
        E.x.array[cell_tags.indices[cell_tags.values == k + 1]] = young
    lmbda, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    u, u_n, u_nn, w = fem.Function(V), fem.Function(V), fem.Function(V), ufl.TestFunction(V)
    load = fem.Constant(mesh, 0.0)

    def right_cauchy_green(v):
        F = ufl.Identity(2) + ufl.grad(v)
        return F.T * F

    F, C = ufl.Identity(2) + ufl.grad(u), right_cauchy_green(u)
    J, C_inv = ufl.det(F), ufl.inv(C)
    C_dot = (1.5 * C - 2 * right_cauchy_green(u_n) + 0.5 * right_cauchy_green(u_nn)) / dt
    S = (1 - C_F) * (mu * (ufl.Identity(2) - C_inv) + lmbda * ufl.ln(J) * C_inv)
    S += C_F * (J * LAMBDA_F / 2 * ufl.tr(C_inv * C_dot) * C_inv + J * MU_F * C_inv * C_dot * C_inv)
    x = ufl.SpatialCoordinate(mesh) + u
    level = 1 - (x[0] / 10) ** 4 - ((x[1] + 10) / 9.5) ** 4
    slope = ufl.as_vector([-4 * x[0] ** 3 / 10**4, -4 * (x[1] + 10) ** 3 / 9.5**4])
    size_of_slope = ufl.sqrt(ufl.dot(slope, slope))
    d, n = level / size_of_slope, -slope / size_of_slope
    linear = ufl.conditional(ufl.lt(d, SMOOTHING), KAPPA * d**2 / (2 * SMOOTHING), KAPPA * (d - SMOOTHING / 2))
    cof_N = J * ufl.inv(F).T * ufl.FacetNormal(mesh)
    traction = ufl.conditional(ufl.gt(d, 0), linear, 0.0) * ufl.sqrt(ufl.dot(cof_N, cof_N)) * n
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=facet_tags)
    R = ufl.inner(F * S, ufl.grad(w)) * ufl.dx + load * RHO_G * w[1] * ufl.dx - ufl.dot(traction, w) * ds(2)
    axis = fem.locate_dofs_topological(V.sub(0), 1, facet_tags.indices[facet_tags.values == 1])
    problem = petsc.NonlinearProblem(R, u, [fem.dirichletbc(PETSc.ScalarType(0), axis, V.sub(0))])
    iterations = march(problem, u, u_n, u_nn, load, dt, end)
    wall = time.perf_counter() - started
    return {"wall_s": wall, "cells": mesh.topology.index_map(2).size_global, "newton": iterations} | report(
        mesh, cell_tags, u, u_n, u_nn, lmbda, mu, dt
    )


def march(problem, u, u_n, u_nn, load, dt, end):
    """Fixed steps, a fresh factorisation at every Newton iteration."""
    A, b, solution = petsc.create_matrix(problem.a), petsc.create_vector(problem.L), u.vector.duplicate()

    def residual(snes, x, f):
        x.copy(u.vector)
        u.x.scatter_forward()
        problem.F(u.vector, f)

    def tangent(snes, x, K, P):
        problem.J(x, K)
        K.assemble()

    snes = PETSc.SNES().create(MPI.COMM_WORLD)
    PETSc.Options()["plain_snes_linesearch_type"] = "bt"
    snes.setOptionsPrefix("plain_")
    snes.setFunction(residual, b)
    snes.setJacobian(tangent, A)
    snes.setTolerances(rtol=1e-8, atol=1e-9, stol=0.0, max_it=50)
    snes.getKSP().setType("preonly")
    snes.getKSP().getPC().setType("lu")
    snes.getKSP().getPC().setFactorSolverType("mumps")
    snes.setFromOptions()
    u.x.array[1::2] = -1e-3  # the contact does not resist before it touches
    iterations = 0
    for k in range(1, round(end / dt) + 1):
        s = min(k * dt / (2 * T_G), 1.0)
        load.value = s**3 * (10 - 15 * s + 6 * s**2)
        u.vector.copy(solution)
        snes.solve(None, solution)
        if snes.getConvergedReason() < 0:
            raise RuntimeError(f"no convergence at t = {k * dt} s: {snes.getConvergedReason()}")
        iterations += snes.getIterationNumber()
        if k < round(end / dt):
            u_nn.x.array[:] = u_n.x.array
            u_n.x.array[:] = u.x.array
    return iterations


def report(mesh, cell_tags, u, u_n, u_nn, lmbda, mu, dt):
    """Maxima in the nucleus at the elements' nodes, means over it: what the package reports."""
    F = ufl.variable(ufl.Identity(2) + ufl.grad(u))
    C, J = F.T * F, ufl.det(F)

    def green(v):
        G = ufl.Identity(2) + ufl.grad(v)
        return G.T * G

    C_inv, C_dot = ufl.inv(C), (1.5 * C - 2 * green(u_n) + 0.5 * green(u_nn)) / dt
    volumetric = J * LAMBDA_F / 2 * ufl.tr(C_inv * C_dot)
    S = (1 - C_F) * (mu * (ufl.Identity(2) - C_inv) + lmbda * ufl.ln(J) * C_inv)
    S += C_F * (volumetric * C_inv + J * MU_F * C_inv * C_dot * C_inv)
    plane = F * S * F.T / J
    zz = ((1 - C_F) * lmbda * ufl.ln(J) + C_F * volumetric) / J
    mean = (plane[0, 0] + plane[1, 1] + zz) / 3
    deviator = [plane[0, 0] - mean, plane[1, 1] - mean, zz - mean]
    mises = ufl.sqrt(1.5 * (sum(d * d for d in deviator) + 2 * plane[0, 1] ** 2))
    values = ufl.as_vector([mises, ufl.tr(C), ufl.tr(C * C), ufl.det(C)])
    points = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.5], [0.5, 0]], dtype=float)
    nucleus = cell_tags.indices[cell_tags.values <= 2]
    nodal = fem.Expression(values, points).eval(nucleus).reshape(-1, 4)
    dx = ufl.Measure("dx", domain=mesh, subdomain_data=cell_tags, metadata={"quadrature_degree": 4})((1, 2))
    area = fem.assemble_scalar(fem.form(fem.Constant(mesh, 1.0) * dx))
    means = [fem.assemble_scalar(fem.form(values[k] * dx)) / area for k in range(4)]
    names = ("sigma_mises", "J1", "J2", "J3")
    result = {f"{name}_max": float(m) for name, m in zip(names, nodal.max(axis=0), strict=True)}
    return result | {f"{name}_mean": float(m) for name, m in zip(names, means, strict=True)}


if __name__ == "__main__":
    print(json.dumps(solve(float(sys.argv[1]) if len(sys.argv) > 1 else 0.72)))

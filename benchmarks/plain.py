"""The best script of a competent FEniCSx user, a half cell on one pillar: what speed and sturdiness are measured by.

BDF2 with fixed 200 s steps, each begun from the last two states extrapolated along the load; P2 on a mesh graded to the
nucleus, its outline and the contact; a quadrature of degree 4; full Newton, MUMPS refactored at every iteration. It
deliberately shares nothing with the package (DOLFINx 0.5).

    python benchmarks/plain.py [SIZE_UM [NUMBERS]]

SIZE_UM: of the elements in the nucleus; half of it along its outline, a third at the contact, four times it far away.
NUMBERS: JSON with any of the keys of TABLE_1, such as '{"law": "yeoh", "load": 20}'; "dt" [s] is the fixed step,
"graded": false makes all elements of one size, "degree": null leaves the volume's quadrature to UFL, "start": "last"
begins each step from the last state: with all three it is what one writes first.
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

TABLE_1 = {
    "law": "neo-hookean",
    "radii": [4.9, 5.0, 9.5, 10.0],  # nucleoplasm, lamina, cytosol, membrane [um]
    "young": [10.0, 1000.0, 10.0, 100.0],  # [Pa]
    "fluid": [0.5, 0.5, 0.5, 0.5],  # volume fractions
    "poisson": 0.45,
    "beta_over_mu": 2.5,
    "i1_rest": 3.0,  # 0: Yeoh as printed
    "lambda_f": 1000.0,  # [Pa s]
    "mu_f": 5e-3,
    "load": 1.0,
    "half_ramp": 5000.0,  # [s]
    "penalty": 50.0,  # [Pa/um]
    "smoothing": 0.005,  # [um]
    "pillar": [10.0, 9.5, 4.0],  # half-width, height [um], exponent; it stands at y = -10
    "gap": 0.0,  # [um]
    "end": 18000.0,  # [s]
    "dt": 200.0,
    "degree": 4,
    "graded": True,
    "start": "extrapolated",
}
RHO_G = 1000 * 9.81e-6
GROWTH = 0.2  # of the element size over the distance from where it is small


def half_disc(size, radii, y_centre, graded):
    """A half disc of four layers."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    centre = geo.addPoint(0, y_centre, 0)
    low = high = centre
    arcs, surfaces, axis = None, [], []
    for r in radii:
        b, e, t = (geo.addPoint(x, y, 0) for x, y in ((0, y_centre - r), (r, y_centre), (0, y_centre + r)))
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
    gmsh.option.setNumber("Mesh.MeshSizeMax", 4 * size if graded else size)
    if graded:
        grade(size, radii[1], y_centre, radii[-1])
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    result = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=2)
    gmsh.finalize()
    return result


def grade(size, nucleus, y_centre, radius):
    """Small elements in the nucleus, smaller ones along its outline, the smallest where the cell touches the pillar."""
    r = f"Sqrt(x^2 + (y-({y_centre}))^2)"
    from_contact = f"Sqrt(x^2 + (y-({y_centre - radius}))^2)"
    sizes = [
        f"{size} + {GROWTH} * Max({r} - {nucleus}, 0)",
        f"{size / 2} + {GROWTH} * Abs({r} - {nucleus})",
        f"{size / 3} + {GROWTH} * {from_contact}",
    ]
    field = gmsh.model.mesh.field
    for k, text in enumerate(sizes):
        field.add("MathEval", k + 1)
        field.setString(k + 1, "F", text)
    field.add("Min", 9)
    field.setNumbers(9, "FieldsList", [1, 2, 3])
    field.setAsBackgroundMesh(9)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def solid_stress(scene, C, lmbda, mu):
    """S of the four laws, in plane and out of plane; C in plane, C33 = 1."""
    one, C_inv, J3 = ufl.Identity(2), ufl.inv(C), ufl.det(C)
    lnJ = ufl.ln(J3) / 2
    if scene["law"] == "saint-venant":
        trace = ufl.tr(C - one) / 2
        return lmbda * trace * one + mu * (C - one), lmbda * trace
    if scene["law"] == "neo-hookean":
        return mu * (one - C_inv) + lmbda * lnJ * C_inv, lmbda * lnJ
    beta = scene["beta_over_mu"] * mu
    alpha = mu / 2 - beta
    I1 = ufl.tr(C) + 1
    a = 2 * alpha
    if scene["law"] == "yeoh":
        e = I1 - scene["i1_rest"]
        a = a + 2 * (-0.5 * alpha * e + 0.1 * alpha * e**2)
    volumetric = (lmbda + 2 * mu / 3) * lnJ - 2 * alpha * J3 ** (1 / 3) - 4 * beta * J3 ** (2 / 3)
    return a * one + 2 * beta * (I1 * one - C) + volumetric * C_inv, a + 2 * beta * (I1 - 1) + volumetric


def right_cauchy_green(v):
    """C in plane."""
    F = ufl.Identity(2) + ufl.grad(v)
    return F.T * F


def fluid_stress(scene, C, C_dot):
    """S of the fluid, in plane and out of plane."""
    C_inv, J = ufl.inv(C), ufl.sqrt(ufl.det(C))
    volumetric = J * scene["lambda_f"] / 2 * ufl.tr(C_inv * C_dot)
    return volumetric * C_inv + J * scene["mu_f"] * C_inv * C_dot * C_inv, volumetric


def solve(size, scene=None):
    """Solve and return the numbers the benchmark compares; "failed" says when and why where it cannot."""
    scene = TABLE_1 | (scene or {})
    half_width, height, exponent = scene["pillar"]
    started = time.perf_counter()
    y_centre = height - 10 + scene["radii"][-1] + scene["gap"]
    mesh, cell_tags, facet_tags = half_disc(size, scene["radii"], y_centre, scene["graded"])
    V, Q = fem.VectorFunctionSpace(mesh, ("Lagrange", 2)), fem.FunctionSpace(mesh, ("DG", 0))
    E, c_f = fem.Function(Q), fem.Function(Q)
    for k, (young, fluid) in enumerate(zip(scene["young"], scene["fluid"], strict=True)):
        E.x.array[cell_tags.indices[cell_tags.values == k + 1]] = young
        c_f.x.array[cell_tags.indices[cell_tags.values == k + 1]] = fluid
    nu = scene["poisson"]
    lmbda, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    u, u_n, u_nn, w = fem.Function(V), fem.Function(V), fem.Function(V), ufl.TestFunction(V)
    load = fem.Constant(mesh, 0.0)
    F, C = ufl.Identity(2) + ufl.grad(u), right_cauchy_green(u)
    C_dot = (1.5 * C - 2 * right_cauchy_green(u_n) + 0.5 * right_cauchy_green(u_nn)) / scene["dt"]
    S = (1 - c_f) * solid_stress(scene, C, lmbda, mu)[0] + c_f * fluid_stress(scene, C, C_dot)[0]
    x = ufl.SpatialCoordinate(mesh) + u
    xi, eta, e = x[0] / half_width, (x[1] + 10) / height, int(exponent)
    level = 1 - xi**e - eta**e
    slope = ufl.as_vector([-e / half_width * xi ** (e - 1), -e / height * eta ** (e - 1)])
    size_of_slope = ufl.sqrt(ufl.dot(slope, slope))
    d, n = level / size_of_slope, -slope / size_of_slope
    kappa, s = scene["penalty"], scene["smoothing"]
    linear = ufl.conditional(ufl.lt(d, s), kappa * d**2 / (2 * s), kappa * (d - s / 2))
    cof_N = ufl.det(F) * ufl.inv(F).T * ufl.FacetNormal(mesh)
    traction = ufl.conditional(ufl.gt(d, 0), linear, 0.0) * ufl.sqrt(ufl.dot(cof_N, cof_N)) * n
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=facet_tags)
    dx = ufl.dx(metadata={"quadrature_degree": scene["degree"]}) if scene["degree"] else ufl.dx
    weight = scene["load"] * RHO_G * w[1] * dx
    R = ufl.inner(F * S, ufl.grad(w)) * dx + load * weight - ufl.dot(traction, w) * ds(2)
    axis = fem.locate_dofs_topological(V.sub(0), 1, facet_tags.indices[facet_tags.values == 1])
    problem = petsc.NonlinearProblem(R, u, [fem.dirichletbc(PETSc.ScalarType(0), axis, V.sub(0))])
    iterations, failed = march(scene, problem, u, u_n, u_nn, load)
    wall = time.perf_counter() - started
    found = {"wall_s": wall, "cells": mesh.topology.index_map(2).size_global, "newton": iterations, "failed": failed}
    found["unknowns"] = 2 * V.dofmap.index_map.size_global
    return found if failed else found | report(scene, mesh, cell_tags, u, u_n, u_nn, c_f, lmbda, mu)


def march(scene, problem, u, u_n, u_nn, load):
    """Fixed steps, a fresh factorisation at every Newton iteration; returns the iterations and why it stopped."""
    dt, steps, half_ramp = scene["dt"], round(scene["end"] / scene["dt"]), scene["half_ramp"]
    solution, snes = u.vector.duplicate(), newton(problem, u)
    u.x.array[1::2] = -1e-3  # the contact does not resist before it touches
    iterations, loads = 0, [0.0, 0.0, 0.0]
    for k in range(1, steps + 1):
        s = min(k * dt / (2 * half_ramp), 1.0) if half_ramp else 1.0
        load.value = s**3 * (10 - 15 * s + 6 * s**2)
        loads = [float(load.value), *loads[:2]]
        last, guess = u.x.array.copy(), u.x.array.copy()
        if k > 2 and loads[1] > loads[2] and scene["start"] == "extrapolated":
            guess += (u_n.x.array - u_nn.x.array) * (loads[0] - loads[1]) / (loads[1] - loads[2])
        for search, begin in (("basic", guess), ("bt", last)):  # full steps first
            PETSc.Options()["plain_snes_linesearch_type"] = search
            snes.setFromOptions()
            u.x.array[:] = begin
            u.vector.copy(solution)
            snes.solve(None, solution)
            iterations += snes.getIterationNumber()
            if snes.getConvergedReason() > 0:
                break
        else:
            return iterations, f"no convergence at t = {k * dt:g} s (SNES {snes.getConvergedReason()})"
        if k < steps:
            u_nn.x.array[:] = u_n.x.array
            u_n.x.array[:] = u.x.array
    return iterations, ""


def newton(problem, u):
    """Full Newton with MUMPS."""
    A, b = petsc.create_matrix(problem.a), petsc.create_vector(problem.L)

    def residual(snes, x, f):
        x.copy(u.vector)
        u.x.scatter_forward()
        problem.F(u.vector, f)

    def tangent(snes, x, K, P):
        problem.J(x, K)
        K.assemble()

    snes = PETSc.SNES().create(MPI.COMM_WORLD)
    snes.setOptionsPrefix("plain_")
    snes.setFunction(residual, b)
    snes.setJacobian(tangent, A)
    snes.setTolerances(rtol=1e-8, atol=1e-9, stol=0.0, max_it=50)
    snes.getKSP().setType("preonly")
    snes.getKSP().getPC().setType("lu")
    snes.getKSP().getPC().setFactorSolverType("mumps")
    return snes


def report(scene, mesh, cell_tags, u, u_n, u_nn, c_f, lmbda, mu):
    """Maxima in the nucleus at the elements' nodes, means over it: what the package reports."""
    F, C = ufl.Identity(2) + ufl.grad(u), right_cauchy_green(u)
    C_dot = (1.5 * C - 2 * right_cauchy_green(u_n) + 0.5 * right_cauchy_green(u_nn)) / scene["dt"]
    solid, fluid = solid_stress(scene, C, lmbda, mu), fluid_stress(scene, C, C_dot)
    S, S_zz = ((1 - c_f) * a + c_f * b for a, b in zip(solid, fluid, strict=True))
    plane, zz = F * S * F.T / ufl.det(F), S_zz / ufl.det(F)
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
    words = sys.argv[1:]
    print(json.dumps(solve(float(words[0]) if words else 0.25, json.loads(words[1]) if words[1:] else None)))

"""The reported pressure and its gradient in space against those of a manufactured finite-strain displacement."""

from types import SimpleNamespace

import numpy as np
import pytest
import ufl
from manufactured import POISSON, YOUNG, body_with, plane_gradient, solid_piola, solved, symbolic
from problems import moduli, rows_ring, solid

from cellmech.cell.observables import REPORTED
from cellmech.cell.samples import PRESSURE, PressureGradient, Samples, state_quantities
from cellmech.fem.jit import PointValues
from cellmech.fem.subdivision import lattice
from cellmech.solver.det_f import quadrature


def exact_pressure(domain):
    """Minus a third of the trace of the neo-Hookean Cauchy stress, written from eq. 18, and its gradient in space."""
    F = plane_gradient(symbolic(domain.mesh))
    J = ufl.det(F)
    out_of_plane = moduli("neo-hookean", YOUNG, POISSON)["lmbda"] * ufl.ln(J) / J
    p = -(ufl.tr(solid_piola("neo-hookean", F) * F.T) / J + out_of_plane) / 3
    return ufl.as_vector([p, *(ufl.inv(F).T * ufl.grad(p))])


def relative_errors(n, order):
    """Of the pressure, its reported gradient and the derivative of the element's own stress: mean and worst."""
    domain = rows_ring(n)
    P = solid_piola("neo-hookean", plane_gradient(symbolic(domain.mesh)))
    body = body_with(domain, solid("neo-hookean", YOUNG, POISSON), P, order=order)
    state = solved(body)
    mesh, (inner, weights), (reported, _) = (
        domain.mesh,
        quadrature(domain.mesh, body.bulk_degree),
        lattice(REPORTED[order]),
    )
    cells, points = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32), np.vstack([reported, inner])
    run = SimpleNamespace(body=body, state=state)
    samples = Samples(run, cells, points, np.append(np.zeros(len(reported)), weights), len(reported))
    gradient = PressureGradient(run, samples, points, order)
    samples.update()
    gradient.update()
    exact = PointValues(exact_pressure(domain), reported, mesh.comm)(cells)
    own_p = state_quantities(state, body.materials[0])[PRESSURE]
    own = ufl.inv(plane_gradient(state.u)).T * ufl.grad(own_p)
    found = {
        "pressure": samples.values[:, : samples.n_max, PRESSURE, None] - exact[..., :1],
        "gradient": gradient.values - exact[..., 1:],
        "own": PointValues(own, reported, mesh.comm)(cells) - exact[..., 1:],
    }
    sizes = {name: np.linalg.norm(exact[..., 1:] if name != "pressure" else exact[..., :1], axis=-1) for name in found}
    gaps = {name: np.linalg.norm(gap, axis=-1) for name, gap in found.items()}
    rms = {name: np.sqrt(np.mean(gap**2) / np.mean(sizes[name] ** 2)) for name, gap in gaps.items()}
    return rms, {name: gap.max() / sizes[name].max() for name, gap in gaps.items()}


@pytest.fixture(scope="module", params=[2, 3])
def errors(request):
    return request.param, [relative_errors(n, request.param) for n in (2, 4, 8)]


def rates(errors, name):
    values = np.array([row[0][name] for row in errors[1]])
    return np.log2(values[:-1] / values[1:])


def test_pressure_converges_with_the_displacements_order(errors):
    assert np.all(np.abs(rates(errors, "pressure") - errors[0]) < 0.15)


def test_pressure_gradient_converges_with_one_order_less(errors):
    assert np.all(np.abs(rates(errors, "gradient") - (errors[0] - 1)) < 0.15)


def test_pressure_gradient_is_nearer_than_the_derivative_of_the_stress(errors):
    for rms, peaks in errors[1]:
        assert 0.3 < rms["gradient"] / rms["own"] < 0.7
        assert 0.15 < peaks["gradient"] / peaks["own"] < 0.5

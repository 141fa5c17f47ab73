"""The pressure and its gradient in space against those of a manufactured finite-strain displacement."""

from types import SimpleNamespace

import numpy as np
import pytest
import ufl
from manufactured import POISSON, YOUNG, body_with, solid_piola, solved, symbolic
from problems import moduli, rows_ring, solid

from cellmech.det_f import node_points, quadrature
from cellmech.forms import PointValues
from cellmech.kinematics import deformation_gradient
from cellmech.samples import PRESSURE, PressureGradient, Samples, state_quantities


def exact_pressure(domain):
    """Minus a third of the trace of the neo-Hookean Cauchy stress, written from eq. 18, and its gradient in space."""
    F = deformation_gradient(symbolic(domain.mesh))
    J = ufl.det(F)
    out_of_plane = moduli("neo-hookean", YOUNG, POISSON)["lmbda"] * ufl.ln(J) / J
    p = -(ufl.tr(solid_piola("neo-hookean", F) * F.T) / J + out_of_plane) / 3
    return ufl.as_vector([p, *(ufl.inv(F).T * ufl.grad(p))])


def relative_errors(n):
    """Of the pressure, its reported gradient and the derivative of the element's own stress, in L2 and at worst."""
    domain = rows_ring(n)
    P = solid_piola("neo-hookean", deformation_gradient(symbolic(domain.mesh)))
    body = body_with(domain, solid("neo-hookean", YOUNG, POISSON), P)
    state = solved(body)
    mesh, (points, weights) = body.domain.mesh, quadrature(body.bulk_degree)
    cells, nodes = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32), node_points(body.space)
    run = SimpleNamespace(body=body, state=state)
    samples = Samples(run, cells, np.vstack([nodes, points]), np.append(np.zeros(len(nodes)), weights), len(nodes))
    gradient = PressureGradient(run, samples, points)
    samples.update()
    gradient.update()
    exact = PointValues(exact_pressure(domain), np.vstack([nodes, points]), mesh.comm)(cells)
    own_p = state_quantities(state, body.mixtures[0])[PRESSURE]
    own = ufl.inv(deformation_gradient(state.u)).T * ufl.grad(own_p)
    found = {
        "pressure": samples.values[..., PRESSURE, None] - exact[..., :1],
        "gradient": gradient.values[:, None] - exact[..., 1:],
        "own": PointValues(own, np.vstack([nodes, points]), mesh.comm)(cells) - exact[..., 1:],
    }
    sizes = {name: exact[..., 1:] if name != "pressure" else exact[..., :1] for name in found}

    def l2(values):
        return np.sqrt(np.sum(samples.area * np.sum(values**2, axis=-1)))

    errors = {name: l2(gap) / l2(sizes[name]) for name, gap in found.items()}
    steepest = np.linalg.norm(exact[..., 1:], axis=-1).max()
    peaks = {name: np.linalg.norm(found[name], axis=-1).max() / steepest for name in ("gradient", "own")}
    return errors, peaks


@pytest.fixture(scope="module")
def errors():
    return [relative_errors(n) for n in (2, 4, 8)]


def rates(errors, name):
    values = np.array([row[0][name] for row in errors])
    return np.log2(values[:-1] / values[1:])


def test_pressure_converges_with_order_2(errors):
    assert np.all(np.abs(rates(errors, "pressure") - 2.0) < 0.15)


def test_pressure_gradient_converges_with_order_1(errors):
    assert np.all(np.abs(rates(errors, "gradient") - 1.0) < 0.15)


def test_pressure_gradient_is_nearer_than_the_derivative_of_the_stress(errors):
    for l2, peaks in errors:
        assert 0.5 < l2["gradient"] / l2["own"] < 0.7
        assert 0.2 < peaks["gradient"] / peaks["own"] < 0.4

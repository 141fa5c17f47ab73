"""Stress and strain at fixed points of every element, and their maxima and means over a region."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from cellmech.fem.jit import PointValues
from cellmech.mechanics.balance import Body
from cellmech.mechanics.drivers import Actin
from cellmech.mechanics.invariants import reported_strains
from cellmech.mechanics.kinematics import deformation_gradient, green_lagrange
from cellmech.mechanics.materials import MaterialField
from cellmech.solver.principal import entries_of, principal_stretches
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import State

PRESSURE, DET_F, LEAST, GREATEST = 4, 5, 6, 7  # columns after sigma_Mises and the strains; the last two: stretches
N = 5  # quantities whose maxima and means are reported: the columns before det F
# A region's numbers in one row, for exchange between ranks:
MAXIMA, PLACES = slice(0, N), slice(N, 4 * N)  # less their rest values; x, y, z of each
HIGHEST, LOWEST = slice(4 * N, 4 * N + 2), slice(4 * N + 2, 4 * N + 5)  # gradient, stretch; pressure, det F, stretch
SIZE, INTEGRALS = 4 * N + 5, slice(4 * N + 6, 5 * N + 6)


def state_quantities(state: State, material: MaterialField, active: Any = None) -> Any:
    """(sigma_Mises [Pa], J1, J2, J3 less their values at rest, pressure [Pa], det F) as a UFL vector.

    sigma_Mises is the von Mises norm of the full 3-D Cauchy stress of the whole material, sigma_zz included; the
    pressure is minus a third of its trace. J1, J2, J3 of a mixed solid have the volume of its pressure.

    Args:
        state: of the body.
        material: of the cells.
        active: second Piola-Kirchhoff stress besides the material's [Pa], if there is any.
    """
    k = state.kinematics
    F, E = deformation_gradient(state.u, k), green_lagrange(state.u, k)
    S = material.solid(E, state.p)[1]
    if material.rate_dependent:
        S = S + material.fluid(F, state.strain_rate())
    if active is not None:
        S = S + active
    sigma = F * S * F.T / ufl.det(F)
    deviator = ufl.dev(sigma)
    mises = ufl.sqrt(1.5 * ufl.inner(deviator, deviator))
    return ufl.as_vector([mises, *reported_strains(material.strain(E, state.p, k)), -ufl.tr(sigma) / 3, ufl.det(F)])


class Samples:
    """Quantities at fixed points of some cells: the first `n_max` points count for maxima, `weights` for means."""

    def __init__(self, run: Simulation, cells: np.ndarray, points: np.ndarray, weights: np.ndarray, n_max: int) -> None:
        mesh, body = run.body.domain.mesh, run.body
        self.cells, self.n_max, self.comm = cells, n_max, mesh.comm
        tags = np.zeros(int(np.max(cells, initial=-1)) + 1, dtype=np.int32)
        inside = body.domain.cell_tags.indices < len(tags)
        tags[body.domain.cell_tags.indices[inside]] = body.domain.cell_tags.values[inside]
        self._parts, state = [], run.state.parts()
        self._run = run
        self._shares: list[tuple[fem.Constant, Callable[[float], float]]] = []
        apart = any(isinstance(driver, Actin) and driver.sector.names for driver in body.drivers)
        pieces = [(m, names) for m in body.materials for names in ([(n,) for n in m.names] if apart else [m.names])]
        for material, names in pieces:
            numbers = [body.domain.cells[name] for name in names]
            rows = np.flatnonzero(np.isin(tags[cells], numbers))
            quantities = state_quantities(state, material, self._active(body, names))
            self._parts.append((rows, PointValues(quantities, points, mesh.comm)))
        strain = ufl.as_vector(entries_of(green_lagrange(state.u, body.kinematics)))
        self._strain = PointValues(strain, points[:n_max], mesh.comm)
        place = ufl.as_vector([*ufl.SpatialCoordinate(mesh), ufl.JacobianDeterminant(mesh)])
        placed = PointValues(place, points, mesh.comm)(cells)
        self.position = placed[..., :-1]
        self.size = np.abs(placed[..., -1]) * weights * body.kinematics.weight(np.moveaxis(self.position, -1, 0))
        self.groups = tags[cells]
        self.values = np.zeros((len(cells), len(points), GREATEST + 1))

    def _active(self, body: Body, names: Sequence[str]) -> Any:
        """Active stress in these groups of cells at the strength of now [Pa]; None where there is none."""
        stresses = []
        for driver in body.drivers:
            if not isinstance(driver, Actin):
                continue
            where = driver.sector.names
            if where is None or set(names) <= set(where):
                share = fem.Constant(body.domain.mesh, 0.0)
                self._shares.append((share, driver.share))
                stresses.append(share * driver.stress(body))
        return sum(stresses[1:], stresses[0]) if stresses else None

    def update(self) -> None:
        """Evaluate at the current state."""
        if self._run.body.contracting:
            self._run.body.contract(self._run.ledger.amplitude)
        for constant, share in self._shares:
            constant.value = share(self._run.ledger.amplitude)
        for rows, values in self._parts:
            if len(rows):
                self.values[rows, :, :LEAST] = values(self.cells[rows])
        stretches = principal_stretches(self._strain(self.cells).reshape(-1, 6))
        self.values[:, : self.n_max, LEAST:] = stretches.reshape(len(self.cells), -1, 2)


class PressureGradient:
    """The pressure's gradient in space [Pa/µm].

    In each element the pressure and the deformed position are fitted by polynomials of the reference coordinates, one
    degree below the displacement's, and the slope of the one over the other is the gradient: for elements up to second
    order one vector an element, from the pressure at the quadrature points; for third order one at each reported point,
    from all points. Converges with order 1 and 2, like the derivative of the element's own stress, but with a fraction
    of its error (tests/verification/test_pressure.py), and without second derivatives.

    Args:
        run: the run.
        samples: of all points; the fit is to the last values.
        points: their reference coordinates, shape (n_points, 2).
        order: of the displacement.
    """

    def __init__(self, run: Simulation, samples: Samples, points: np.ndarray, order: int) -> None:
        self._samples = samples
        self._position = PointValues(ufl.SpatialCoordinate(run.body.domain.mesh) + run.state.u, points, samples.comm)
        reported = points[: samples.n_max]
        fitted = points if order > 2 else points[samples.n_max :]
        self._from = slice(len(points) - len(fitted), None)
        self._slopes = _slopes(fitted, reported if order > 2 else reported[:1], 2 if order > 2 else 1)
        self.position = np.zeros((len(samples.cells), *points.shape))
        self.values = np.zeros((len(samples.cells), self._slopes.shape[1], points.shape[1]))

    def update(self) -> None:
        """Fit at the current state."""
        self.position = self._position(self._samples.cells)
        columns = [*np.moveaxis(self.position[:, self._from], 2, 0), self._samples.values[:, self._from, PRESSURE]]
        slopes = [tuple(column @ derivative.T for derivative in self._slopes) for column in columns]
        if len(slopes) == 3:
            (a, c), (b, d), (p, q) = slopes
            self.values = np.stack([p * d - q * b, q * a - p * c], axis=-1) / (a * d - b * c)[..., None]
        else:
            along = np.moveaxis(np.array(slopes), (0, 1), (-1, -2))  # by each reference coordinate: x, y, z, pressure
            self.values = np.linalg.solve(along[..., :3], along[..., 3:])[..., 0]


def _slopes(fitted: np.ndarray, at: np.ndarray, degree: int) -> np.ndarray:
    """What makes values at points the derivatives of the polynomial that fits them best; shape (d, n_at, n_fitted)."""
    dim = fitted.shape[1]
    powers = np.array([power for power in product(range(degree + 1), repeat=dim) if sum(power) <= degree])

    def monomials(points: np.ndarray, by: int | None = None) -> np.ndarray:
        factor, left = np.ones(len(powers)), powers.copy()
        if by is not None:
            factor, left[:, by] = powers[:, by], np.maximum(powers[:, by] - 1, 0)
        return np.asarray(factor * np.prod(points[:, None] ** left, axis=-1))

    fit = np.linalg.pinv(monomials(fitted))
    return np.stack([monomials(at, by) @ fit for by in range(dim)])


@dataclass
class Region:
    """Flat indices into a sample set: points that count for maxima, points that count for means."""

    samples: Samples
    gradient: PressureGradient
    peak: np.ndarray
    bulk: np.ndarray
    scale: float = 1.0  # true size over the size that the points stand for

    def __post_init__(self) -> None:
        shape = self.samples.values.shape[1]
        self._rows = np.unique(self.peak // shape)  # of the gradient
        self._size = self.scale * self.samples.size.reshape(-1)[self.bulk]

    def local(self) -> np.ndarray:
        """This rank's numbers: `MAXIMA`, `PLACES`, `HIGHEST`, `LOWEST`, `SIZE`, `INTEGRALS`."""
        row = np.zeros(INTEGRALS.stop)
        if not len(self.peak):
            row[MAXIMA], row[HIGHEST], row[LOWEST] = -np.inf, 0.0, np.inf
            return row
        values = self.samples.values.reshape(-1, GREATEST + 1)
        peak, bulk = values[self.peak], values[self.bulk]
        at = self.peak[np.argmax(peak[:, :N], axis=0)]
        row[MAXIMA] = values[at, np.arange(N)]
        place = self.samples.position.reshape(-1, self.samples.position.shape[-1])[at]
        row[PLACES] = np.pad(place, ((0, 0), (0, 3 - place.shape[1]))).ravel()
        steepest = np.max(np.linalg.norm(self.gradient.values[self._rows], axis=-1))
        row[HIGHEST] = steepest, np.max(peak[:, GREATEST])
        lowest = np.min(peak[:, PRESSURE:GREATEST], axis=0)
        lowest[1] = min(lowest[1], np.min(bulk[:, DET_F], initial=np.inf))
        row[LOWEST] = lowest
        row[SIZE], row[INTEGRALS] = np.sum(self._size), self._size @ bulk[:, :N]
        return row

    def largest_mises(self, size: float) -> np.ndarray:
        """This rank's largest sigma_Mises [Pa] and the sizes of their points [µm^2 or µm^3], until these exceed `size`.

        Shape (2, n), from the largest on: what lies above a share of the whole region is among the ranks' rows.
        """
        rows = np.stack([self.samples.values.reshape(-1, GREATEST + 1)[self.bulk, 0], self._size])
        rows = rows[:, np.argsort(-rows[0], kind="stable")]
        return rows[:, : int(np.searchsorted(np.cumsum(rows[1]), size, side="right")) + 1]


def merge(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Combine the ranks' `Region.local` rows, shape (n_regions, len(row)) each."""
    total = np.array(parts[0])
    for part in parts[1:]:
        better = part[:, MAXIMA] > total[:, MAXIMA]
        total[:, MAXIMA] = np.where(better, part[:, MAXIMA], total[:, MAXIMA])
        total[:, PLACES] = np.where(np.repeat(better, 3, axis=1), part[:, PLACES], total[:, PLACES])
        total[:, HIGHEST] = np.maximum(total[:, HIGHEST], part[:, HIGHEST])
        total[:, LOWEST] = np.minimum(total[:, LOWEST], part[:, LOWEST])
        total[:, SIZE:] += part[:, SIZE:]
    return total


def exceeded_on(size: float, rows: Sequence[np.ndarray]) -> float:
    """The smallest of the values that are exceeded on no more than `size`; from all ranks' `largest_mises`."""
    values, sizes = np.concatenate(rows, axis=1)
    order = np.argsort(-values, kind="stable")
    above = np.cumsum(sizes[order])
    return float(values[order[min(int(np.searchsorted(above, size, side="right")), len(order) - 1)]])

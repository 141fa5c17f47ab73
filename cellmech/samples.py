"""Stress and strain at fixed points of every element, and their maxima and means over a region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl

from cellmech.forms import PointValues
from cellmech.kinematics import deformation_gradient, embed, green_lagrange, reported_strains
from cellmech.materials import Mixture
from cellmech.residual import State
from cellmech.run import Run

DET_F, PRESSURE = 4, 5  # columns after the four quantities


def state_quantities(state: State, mixture: Mixture) -> Any:
    """(sigma_Mises [Pa], J1 - 2, J2 - 2, J3 - 1, det F, pressure [Pa]) as a UFL vector.

    sigma_Mises is the von Mises norm of the full 3-D Cauchy stress of the whole mixture, sigma_zz included; the
    pressure is minus a third of its trace.
    """
    F, E = embed(deformation_gradient(state.u), 1.0), green_lagrange(state.u)
    S = mixture.solid(embed(E))[1]
    if mixture.rate_dependent:
        S = S + mixture.fluid(F, embed(state.strain_rate()))
    sigma = F * S * F.T / ufl.det(F)
    deviator = ufl.dev(sigma)
    mises = ufl.sqrt(1.5 * ufl.inner(deviator, deviator))
    return ufl.as_vector([mises, *reported_strains(E), ufl.det(F), -ufl.tr(sigma) / 3])


class Samples:
    """Quantities at fixed points of some cells: the first `n_max` points count for maxima, `weights` for means."""

    def __init__(self, run: Run, cells: np.ndarray, points: np.ndarray, weights: np.ndarray, n_max: int) -> None:
        mesh, body = run.body.domain.mesh, run.body
        self.cells, self.n_max = cells, n_max
        tags = np.zeros(int(np.max(cells, initial=-1)) + 1, dtype=np.int32)
        inside = body.domain.cell_tags.indices < len(tags)
        tags[body.domain.cell_tags.indices[inside]] = body.domain.cell_tags.values[inside]
        self._parts = []
        for mixture in body.mixtures:
            numbers = [body.domain.cells[name] for name in mixture.names]
            rows = np.flatnonzero(np.isin(tags[cells], numbers))
            self._parts.append((rows, PointValues(state_quantities(run.state, mixture), points, mesh.comm)))
        place = ufl.as_vector([*ufl.SpatialCoordinate(mesh), ufl.JacobianDeterminant(mesh)])
        placed = PointValues(place, points, mesh.comm)(cells)
        self.position, self.area = placed[..., :2], np.abs(placed[..., 2]) * weights
        self.groups = tags[cells]
        self.values = np.zeros((len(cells), len(points), PRESSURE + 1))

    def update(self) -> None:
        """Evaluate at the current state."""
        for rows, values in self._parts:
            if len(rows):
                self.values[rows] = values(self.cells[rows])


@dataclass
class Region:
    """Flat indices into a sample set: points that count for maxima, points that count for means."""

    samples: Samples
    peak: np.ndarray
    bulk: np.ndarray
    scale: float = 1.0  # true area over the area that the points stand for

    def local(self) -> np.ndarray:
        """This rank's [4 maxima, 4 × 2 places, det F min, area, 4 integrals], maxima less their rest value."""
        values = self.samples.values.reshape(-1, PRESSURE + 1)
        if not len(self.peak):
            return np.concatenate([np.full(4, -np.inf), np.zeros(8), [np.inf], np.zeros(5)])
        position = self.samples.position.reshape(-1, 2)
        at = self.peak[np.argmax(values[self.peak, :4], axis=0)]
        area = self.scale * self.samples.area.reshape(-1)[self.bulk]
        return np.concatenate(
            [
                values[at, np.arange(4)],
                position[at].ravel(),
                [min(np.min(values[self.peak, DET_F]), np.min(values[self.bulk, DET_F], initial=np.inf))],
                [np.sum(area)],
                area @ values[self.bulk, :4],
            ]
        )


def merge(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Combine the ranks' `Region.local` arrays, shape (n_regions, 18) each."""
    total = np.array(parts[0])
    for part in parts[1:]:
        better = part[:, :4] > total[:, :4]
        total[:, :4] = np.where(better, part[:, :4], total[:, :4])
        places = np.repeat(better, 2, axis=1)
        total[:, 4:12] = np.where(places, part[:, 4:12], total[:, 4:12])
        total[:, 12] = np.minimum(total[:, 12], part[:, 12])
        total[:, 13:] += part[:, 13:]
    return total


def lattice(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the reference triangle's n-fold subdivision and weights that integrate linear functions exactly."""
    index = [(i, j) for j in range(n + 1) for i in range(n + 1 - j)]
    number = {ij: k for k, ij in enumerate(index)}
    weights = np.zeros(len(index))
    for i, j in index:
        for corners in (((i, j), (i + 1, j), (i, j + 1)), ((i + 1, j), (i + 1, j + 1), (i, j + 1))):
            if all(c in number for c in corners):
                weights[[number[c] for c in corners]] += 1 / (6 * n * n)
    return np.array(index, dtype=float) / n, weights

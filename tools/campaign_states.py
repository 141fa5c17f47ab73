"""A state of the cell as its field file has it, and what acts on it: integrated anew, with NumPy alone.

Positions and displacements of a field file's points define the deformed cell completely: an element has as many as its
polynomials need. From them follow outline, depth, pressure and its resultants; nothing of the solver is asked.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import basix
import numpy as np

from cellmech.fem.subdivision import lattice, lattice_pieces
from cellmech.results.result import modelled, read_grid
from cellmech.scene.scene import Scene

DENSE = 513  # points of an edge at which its depth is looked for
FINE = 40  # Gauss points of an edge that see what lies between the solver's
DENSITY, GRAVITY = 1e-12, 1e6  # kg/m3 in Pa s2/µm2, m/s2 in µm/s2
SAME = 1e-7  # of the radius: points that near are one


@dataclass(frozen=True)
class Forces:
    """Resultants of the obstacles on the whole cell.

    Args:
        up, sideways: [Pa µm]; sideways is that of the modelled half in a half cell.
        moment: about the centre of gravity, counter-clockwise [Pa µm2].
        depth_um: largest depth met.
    """

    up: float
    sideways: float
    moment: float
    depth_um: float


def obstacle_depth(obstacle: tuple[float, ...], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth l/|grad l| [µm] and outward normal of points x, shape (..., 2), in an obstacle (eqs 26, 28, 29).

    An obstacle is (y,) for a flat, (x, y, half-width, height, exponent) for a pillar.
    """
    if len(obstacle) == 1:
        return obstacle[0] - x[..., 1], np.broadcast_to([0.0, 1.0], x.shape)
    x0, y0, w, h, e = obstacle
    xi, eta = (x[..., 0] - x0) / w, (x[..., 1] - y0) / h
    level = 1 - np.abs(xi) ** e - np.abs(eta) ** e
    slope = np.stack([-e / w * np.sign(xi) * np.abs(xi) ** (e - 1), -e / h * np.sign(eta) * np.abs(eta) ** (e - 1)], -1)
    length = np.maximum(np.linalg.norm(slope, axis=-1), 1 / max(w, h))
    return level / length, -slope / length[..., None]


def obstacles_of(scene: Scene) -> list[tuple[float, ...]]:
    """The scene's obstacles as `obstacle_depth` takes them; a half cell mirrors its pillars."""
    found: list[tuple[float, ...]] = []
    for p in scene.pillar:
        sides = (p.x_um, -p.x_um) if scene.cell.shape == "half" and p.x_um else (p.x_um,)
        found += [(x, p.y_um, p.half_width_um, p.height_um, p.exponent) for x in sides]
    return found + ([] if scene.flat is None else [(scene.flat.y_um,)])


def ramp(scene: Scene, t_s: float) -> float:
    """Share of the load that acts at a time [-] (eq. 25)."""
    if scene.load.half_ramp_s == 0:
        return 1.0
    s = min(max(t_s / (2 * scene.load.half_ramp_s), 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s * s)


def weight_per_area(scene: Scene) -> float:
    """Of the cell less buoyancy, at full load [Pa/µm]."""
    density = scene.cell.density_kg_m3 - scene.cell.medium_density_kg_m3
    return density * DENSITY * scene.load.gravity_m_s2 * GRAVITY * scene.load.factor


def pressure(scene: Scene, d: np.ndarray) -> np.ndarray:
    """Penalty pressure of the surface form at depths d [Pa]."""
    kappa, s = scene.contact.penalty_Pa_per_um, scene.contact.smoothing_um
    return np.where(d <= 0, 0.0, np.where(d < s, kappa * d * d / (2 * s), kappa * (d - s / 2)))


def monomials(points: np.ndarray, degree: int, along: int | None = None) -> np.ndarray:
    """x^i y^j, i + j <= degree, or their derivatives along x (0) or y (1), at points; a power a column."""
    columns = []
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            factor, a, b = {None: (1, i, j), 0: (i, i - 1, j), 1: (j, i, j - 1)}[along]
            columns.append(factor * points[:, 0] ** max(a, 0) * points[:, 1] ** max(b, 0))
    return np.stack(columns, axis=-1)


@lru_cache
def _element(n: int) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Of elements whose edges are divided in n: points, their triangles in the file, and the points of each edge."""
    points = lattice(n)[0]
    ends = (points[:, 1] == 0, points[:, 0] == 0, np.abs(points.sum(axis=1) - 1) < 1e-9)
    edges = [np.flatnonzero(on) for on in ends]
    return points, lattice_pieces(n), [edge[np.argsort(points[edge] @ [2.0, 1.0])] for edge in edges]


class State:
    """The cell at one time.

    Args:
        scene: what was asked for.
        path: a field file.
    """

    def __init__(self, scene: Scene, path: Path) -> None:
        self.scene, self.divisions = scene, {1: 1, 2: 2, 3: 4}[scene.mesh.order]
        grid = modelled(read_grid(path))
        nodes = grid.cells_dict[grid.celltypes[0]]
        self.det_F, self.arrays = np.asarray(grid["det_F"]), {key: np.asarray(grid[key]) for key in grid.point_data}
        points, pieces, _ = _element(self.divisions)
        n_elements = len(nodes) // len(pieces)

        def by_element(values: np.ndarray) -> np.ndarray:
            found = np.zeros((n_elements, len(points), values.shape[-1]))
            found[:, pieces] = values[nodes].reshape(n_elements, *pieces.shape, -1)
            return found

        self.X = by_element(np.asarray(grid.points)[:, :2])
        self.u = by_element(self.arrays["displacement_um"][:, :2])
        self.x = self.X + self.u
        self.copies = 2 if scene.cell.shape == "half" else 1

    def finite(self) -> bool:
        """Whether every number of the file is."""
        return all(np.isfinite(values).all() for values in self.arrays.values())

    def deformation_gradient(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F, |dX/dxi| and x at reference points of every element."""
        points, n = _element(self.divisions)[0], self.divisions
        fit = np.linalg.inv(monomials(points, n))
        slopes = [monomials(at, n, along) @ fit for along in (0, 1)]
        dX, dx = (np.stack([np.einsum("qp,epi->eqi", s, v) for s in slopes], -1) for v in (self.X, self.x))
        det = np.linalg.det(dX)
        return dx @ np.linalg.inv(dX), np.abs(det), np.einsum("qp,epi->eqi", monomials(at, n) @ fit, self.x)

    def area(self) -> float:
        """Of the undeformed cell as it is meshed [µm2]."""
        q, w = _triangle(6)
        return float(self.copies * np.sum(self.deformation_gradient(q)[1] * w))

    def centre_of_gravity(self) -> np.ndarray:
        """Of the deformed cell, or of the modelled half [µm]."""
        q, w = _triangle(6)
        _, area, x = self.deformation_gradient(q)
        return np.einsum("eq,eqi->i", area * w, x) / np.sum(area * w)

    def fall(self) -> float:
        """By how much the centre of gravity has come down [µm]."""
        q, w = _triangle(6)
        n = self.divisions
        shape = monomials(q, n) @ np.linalg.inv(monomials(_element(n)[0], n))
        area = self.deformation_gradient(q)[1] * w
        return -float(np.einsum("eq,eq->", area, self.u[..., 1] @ shape.T) / np.sum(area))

    def outline(self) -> np.ndarray:
        """Deformed positions of the points of the outer edges [µm], shape (n_edges, n_points, 2)."""
        edges = [(self.X[:, edge], self.x[:, edge]) for edge in _element(self.divisions)[2]]
        X, x = (np.concatenate(part) for part in zip(*edges, strict=True))
        middle = (X[:, 0] + X[:, -1]) / 2
        keys = np.round(middle / (SAME * self.scene.radius_um)).astype(np.int64)
        _, inverse, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        outer = count[inverse.ravel()] == 1
        if self.copies == 2:
            outer &= np.abs(middle[:, 0]) > SAME * self.scene.radius_um
        return x[outer]

    def forces(self, fine: bool = False) -> Forces:
        """What the obstacles do, by the quadrature that the scene asks for, or by a fine one."""
        if self.scene.contact.form == "surface":
            return self._on_the_outline(FINE if fine else self.scene.contact.quadrature_degree // 2 + 1)
        return self._in_the_volume(min(30, 3 * self.scene.contact.quadrature_degree) if fine else None)

    def touching_um(self) -> float:
        """Length along x of the outline, the modelled half's of a half cell, where an obstacle's force sets in [µm].

        Edges are sampled all along, and closely about their deepest sample: a contact may be narrower than the others.
        """
        x, contact = self.outline(), self.scene.contact
        powers, fit = np.arange(x.shape[1]), _fit(x.shape[1] - 1)

        def at(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            points = np.einsum("esn,enc->esc", s[..., None] ** powers @ fit, x)
            depths = [obstacle_depth(obstacle, points)[0] for obstacle in obstacles_of(self.scene)]
            return points, np.max(depths, axis=0) + (0.0 if contact.form == "surface" else contact.volume_width_um)

        s = np.tile(np.linspace(0, 1, DENSE), (len(x), 1))
        deepest = np.take_along_axis(s, np.argmax(at(s)[1], axis=1)[:, None], axis=1)
        closely = np.clip(deepest + np.linspace(-2, 2, DENSE) / (DENSE - 1), 0, 1)
        points, depth = at(np.sort(np.hstack([s, closely]), axis=1))
        a, b = depth[:, :-1], depth[:, 1:]
        ends = (a > 0) != (b > 0)
        share = np.where(ends, np.maximum(a, b) / np.where(ends, np.abs(a - b), 1.0), a > 0)
        return float(np.sum(share * np.abs(np.diff(points[..., 0], axis=1))))

    def _on_the_outline(self, n_points: int) -> Forces:
        """A pressure p(d) along the obstacle's normal, per deformed length."""
        x = self.outline()
        s, w = np.polynomial.legendre.leggauss(n_points)
        if n_points == FINE:  # and points that weigh nothing, for a depth between them
            s, w = np.concatenate([s, np.linspace(-1, 1, DENSE)]), np.concatenate([w, np.zeros(DENSE)])
        s, w, degree = (s + 1) / 2, w / 2, x.shape[1] - 1
        powers, fit = np.arange(degree + 1), _fit(degree)
        at = np.einsum("sn,enc->esc", s[:, None] ** powers @ fit, x)
        slope = np.einsum("sn,enc->esc", powers[1:] * s[:, None] ** (powers[1:] - 1) @ fit[1:], x)
        return self._sum(at, np.linalg.norm(slope, axis=-1) * w, None)

    def _in_the_volume(self, degree: int | None) -> Forces:
        """kappa H_w(d) J n, as printed kappa H_w(d) cof(F) n, per undeformed area."""
        q, w = _triangle(degree or self.scene.contact.quadrature_degree)
        F, area, x = self.deformation_gradient(q)
        if self.scene.contact.form == "volume":
            return self._sum(x, area * w * np.linalg.det(F), None)
        cofactor = np.linalg.det(F)[..., None, None] * np.swapaxes(np.linalg.inv(F), -1, -2)
        return self._sum(x, area * w, cofactor)

    def _sum(self, x: np.ndarray, measure: np.ndarray, cofactor: np.ndarray | None) -> Forces:
        surface, contact = self.scene.contact.form == "surface", self.scene.contact
        total, moment, deepest = np.zeros(2), 0.0, -np.inf
        lever = x - self.centre_of_gravity()
        for obstacle in obstacles_of(self.scene):
            d, n = obstacle_depth(obstacle, x)
            s = np.clip((d / contact.volume_width_um + 1) / 2, 0, 1)
            push = pressure(self.scene, d) if surface else contact.penalty_Pa_per_um * s**3 * (10 - 15 * s + 6 * s * s)
            n = n if cofactor is None else np.einsum("eqij,eqj->eqi", cofactor, n)
            force = (push * measure)[..., None] * n
            total += force.sum(axis=(0, 1))
            moment += float(np.sum(lever[..., 0] * force[..., 1] - lever[..., 1] * force[..., 0]))
            deepest = max(deepest, float(d.max()))
        return Forces(self.copies * total[1], total[0], moment, deepest)


@lru_cache
def _fit(degree: int) -> np.ndarray:
    """Coefficients in the powers of s of the polynomials through evenly spaced points, a power a row."""
    return np.linalg.inv(np.vander(np.linspace(0, 1, degree + 1), increasing=True))


@lru_cache
def _triangle(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Quadrature of the reference triangle."""
    points, weights = basix.make_quadrature(basix.CellType.triangle, degree)
    return np.asarray(points), np.asarray(weights)

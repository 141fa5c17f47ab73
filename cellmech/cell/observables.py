"""Reported numbers of a state: maxima, means and shares per region, shape, contact, energies.

Stress and strain are evaluated at fixed points of each element, its nodes or a finer lattice, from that element's own
gradient and material; the largest value counts and neighbours are never averaged. Means are over the reference area, or
volume. To add an observable: a method that returns a number, called in `Observer.observe`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cellmech.cell.samples import (
    DET_F,
    HIGHEST,
    INTEGRALS,
    LOWEST,
    MAXIMA,
    PLACES,
    PRESSURE,
    SIZE,
    PressureGradient,
    Region,
    Samples,
    exceeded_on,
    merge,
)
from cellmech.cell.shape import nucleus_shape
from cellmech.fem.boundary import boundary
from cellmech.fem.distance import nearest
from cellmech.fem.outline import Outline
from cellmech.fem.subdivision import lattice, lattice_pieces
from cellmech.fem.surface import Surface
from cellmech.mechanics.kinematics import Axisymmetric, Kinematics
from cellmech.mechanics.obstacles import Obstacle
from cellmech.scene.substrate import Upright
from cellmech.solver.det_f import REPORTED, order_of, quadrature
from cellmech.solver.simulation import Simulation

QUANTITIES = {"sigma_mises": "_Pa", "J1": "", "J2": "", "J3": "", "pressure": "_Pa"}  # and their units
STRAINS = ("J1", "J2", "J3")
# Share of a region's size above its 99th percentile. The last digits keep the bound off the sums of equal sizes, where
# round-off, another on each number of ranks, would decide between two points.
ABOVE_P99 = 0.01 * (1 + 1e-9)
SETTLED = 1e-9  # a maximum over time moves on only for more than this share of its size: round-off is no growth
LATTICE = 16  # subdivisions of an element's edge where a reported layer is not meshed apart


@dataclass(frozen=True)
class Ring:
    """A reported region: the points with inner <= r <= outer about the cell's centre [µm]."""

    inner_um: float
    outer_um: float

    def size(self, kinematics: Kinematics) -> float:
        """Of the whole ring or shell [µm^2 or µm^3]."""
        return kinematics.ball(self.outer_um) - kinematics.ball(self.inner_um)


@dataclass(frozen=True)
class Layout:
    """The geometry that reporting needs.

    Args:
        centre: of the cell at the start, as many coordinates as the mesh has [µm].
        mirrored: coordinates whose planes of symmetry bound what is modelled.
        copies: how many times the modelled part makes the whole cell.
        regions: reported regions by name.
        groups: names of the cell groups a region consists of, for the regions that are meshed apart.
        pillars: obstacles whose distance from the lamina, along the axis, is reported.
        shaped: whether the nucleus is no circle or ball, and its size the mesh's.
        lift_um: how far the cell was moved to first touch [µm].
        slide_um: how far it was moved along x, and in space along z, to where it rests [µm].
        obstacles: all by label; of them the one nearest to the nucleus is reported.
    """

    centre: tuple[float, ...]
    mirrored: tuple[int, ...]
    copies: int
    regions: Mapping[str, Ring]
    groups: Mapping[str, tuple[str, ...]]
    pillars: tuple[Upright, ...]
    shaped: bool = False
    lift_um: float = 0.0
    slide_um: tuple[float, ...] = (0.0,)
    obstacles: Mapping[str, Obstacle] = field(default_factory=dict)

    @property
    def half(self) -> bool:
        """True if the modelled section at z = 0 is half a disc."""
        return 0 in self.mirrored


class Observer:
    """Looks at a run after each accepted step.

    Args:
        run: the run.
        layout: where its regions are.
    """

    def __init__(self, run: Simulation, layout: Layout) -> None:
        self.run, self.layout = run, layout
        body = run.body
        self.kinematics = body.kinematics
        self.rest = np.array([0.0, *self.kinematics.rest, 0.0])  # what QUANTITIES are in a body at rest
        self.comm = body.domain.mesh.comm
        order = order_of(body.space)
        self.subdivisions = REPORTED[order]
        mesh = body.domain.mesh
        self.dim = mesh.topology.dim
        reported, (q, w) = lattice(self.subdivisions, self.dim)[0], quadrature(mesh, body.bulk_degree)
        cells = body.domain.own_cells
        points, weights = np.vstack([reported, q]), np.concatenate([np.zeros(len(reported)), w])
        self.samples = Samples(run, cells, points, weights, len(reported))
        self.gradient = PressureGradient(run, self.samples, points, order)
        self._fine: Samples | None = None
        self.regions = {name: self._region(name) for name in layout.regions}
        self.nucleus = boundary(body.domain, body.space, "nucleus_outline", layout.mirrored)
        self.peaks: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in layout.regions}

    def _region(self, name: str) -> Region:
        if name in self.layout.groups:
            numbers = [self.run.body.domain.cells[group] for group in self.layout.groups[name]]
            rows = np.flatnonzero(np.isin(self.samples.groups, numbers))
            n_points = self.samples.size.shape[1]
            index = rows[:, None] * n_points + np.arange(n_points)
            peak, bulk = index[:, : self.samples.n_max].ravel(), index[:, self.samples.n_max :].ravel()
            return Region(self.samples, self.gradient, peak, bulk)
        if self._fine is None:
            points, weights = lattice(LATTICE, self.dim)
            self._fine = Samples(self.run, self.samples.cells, points, weights, len(points))
        ring = self.layout.regions[name]
        r = np.linalg.norm(self._fine.position - np.array(self.layout.centre), axis=-1).ravel()
        slack = 1e-6 * ring.outer_um
        inside = (r >= ring.inner_um - slack) & (r <= ring.outer_um + slack) & self._on_the_side_of(ring).ravel()
        index = np.flatnonzero(inside)
        covered = self.comm.allreduce(float(self._fine.size.reshape(-1)[index].sum()))
        true = ring.size(self.kinematics) / self.layout.copies
        return Region(self._fine, self.gradient, index, index, true / covered)

    def _on_the_side_of(self, ring: Ring) -> np.ndarray:
        """For each point, True if its element lies on the ring's side of the nucleus outline, always an interface.

        A point on the outline belongs to elements of both sides, whose materials may differ.
        """
        assert self._fine is not None
        r = np.linalg.norm(self._fine.position - np.array(self.layout.centre), axis=-1)
        nucleus_um = self.layout.regions["nucleus"].outer_um
        within = r.mean(axis=1, keepdims=True) < nucleus_um
        return np.broadcast_to(within == (ring.outer_um <= nucleus_um), r.shape)

    def _position(self, outline: Outline, sign: float) -> np.ndarray:
        """Deformed position of the lowest (-1) or highest (1) point of the undeformed outline [µm]. Collective."""
        reference, nodes = outline.reference.reshape(-1, 2), outline.nodes(self.run.state.u).reshape(-1, 2)
        k = int(np.argmax(sign * reference[:, 1])) if len(reference) else None
        mine = (-np.inf, np.zeros(2)) if k is None else (sign * float(reference[k, 1]), nodes[k])
        return max(self.comm.allgather(mine), key=lambda found: found[0])[1]

    def observe(self, t_s: float) -> dict[str, Any]:
        """Evaluate everything after an accepted step (before history moves); nested as in result.json. Collective."""
        self.run.state.update()
        self.samples.update()
        self.gradient.update()
        if self._fine is not None:
            self._fine.update()
        local = np.array([region.local() for region in self.regions.values()])
        total = merge(self.comm.allgather(local)) if self.comm.size > 1 else local
        self.table = dict(zip(self.regions, total, strict=True))
        result: dict[str, Any] = {name: self._of_region(name, t_s) for name in self.regions}
        for name, value in self._percentiles().items():
            result[name]["sigma_mises_p99_Pa"] = value
        result |= self._shares()
        result["shape_index"], result["lamina_pillar_distance_um"] = self._shape()
        near = nearest(self.nucleus, self.run.state.u, self.layout.obstacles)
        result["nucleus_obstacle"], result["nucleus_obstacle_distance_um"] = near or (None, None)
        tops = [pillar.y_um + pillar.height_um for pillar in self.layout.pillars]
        result["nucleus_shape"] = nucleus_shape(
            self.nucleus,
            self.run.state.u,
            half=self.layout.half,
            turned=isinstance(self.kinematics, Axisymmetric),
            top_um=max(tops, default=None),
        )
        result["indentation_um"] = result["nucleus_shape"]["indentation_um"]
        result["contact"], result["energy"] = self._contact(), self._energy()
        return result

    def _of_region(self, name: str, t_s: float) -> dict[str, Any]:
        row = self.table[name]
        maxima, means = row[MAXIMA] + self.rest, row[INTEGRALS] / row[SIZE] + self.rest
        places = row[PLACES].reshape(-1, 3)[:, : self.dim].tolist()
        values: dict[str, Any] = {}
        for k, (quantity, unit) in enumerate(QUANTITIES.items()):
            largest = float(maxima[k])
            peak = self.peaks[name].get(quantity, (-np.inf, 0.0))[0]
            if largest - peak > SETTLED * abs(largest - self.rest[k]):
                self.peaks[name][quantity] = (largest, t_s)
            over_time = self.peaks[name][quantity] if self.run.has_a_way else (None, None)
            values[f"{quantity}_max{unit}"] = largest
            values[f"{quantity}_max_at_um"] = places[k]
            values[f"{quantity}_max_over_time{unit}"] = over_time[0]
            values[f"{quantity}_max_time_s"] = over_time[1]
            values[f"{quantity}_mean{unit}"] = float(means[k])
        lowest, (steepest, greatest) = map(float, row[LOWEST]), map(float, row[HIGHEST])
        values["pressure_min_Pa"], values["det_F_min"], values["principal_stretch_min"] = lowest
        values["principal_stretch_max"], values["pressure_gradient_max_Pa_per_um"] = greatest, steepest
        values[self.kinematics.content] = float(row[SIZE]) * self.layout.copies
        return values

    def _percentiles(self) -> dict[str, float]:
        """The 99th percentile of sigma_Mises over each region's undeformed area or volume [Pa]. Collective.

        It is the value of a point, never one between two, so ranks agree on it as they do on the stress itself. They
        exchange the points of the upper hundredth only.
        """
        sizes = {name: ABOVE_P99 * float(row[SIZE]) for name, row in self.table.items()}
        local = [region.largest_mises(sizes[name]) for name, region in self.regions.items()]
        parts = self.comm.allgather(local) if self.comm.size > 1 else [local]
        together = zip(sizes.items(), zip(*parts, strict=True), strict=True)
        return {name: exceeded_on(size, rows) for (name, size), rows in together}

    def _shares(self) -> dict[str, Any]:
        """The nucleus's part in the cell's deformation, in the paper's sense and in two others.

        In the paper's sense most of it is the share of the areas, which are the circles' own: the mesh's would be off
        by more than the strains add. Of a ball it is the share of the volumes.
        """
        nucleus, cell = self.table["nucleus"], self.table["cell"]
        regions, copies = self.layout.regions, self.layout.copies
        inner, outer = (regions[name].size(self.kinematics) / copies for name in ("nucleus", "cell"))
        if self.layout.shaped:
            inner = float(nucleus[SIZE])
        share, peak, integral = {}, {}, {}
        for k, name in enumerate(QUANTITIES):
            if name not in STRAINS:
                continue
            part, whole = nucleus[INTEGRALS][k], cell[INTEGRALS][k]
            share[name] = float(100 * (part + self.rest[k] * inner) / outer)
            peak[name] = float(nucleus[k] / cell[k]) if cell[k] else None
            integral[name] = float(part / whole) if whole else None
        of_size = f"share_of_{self.kinematics.content.split('_')[0]}_percent"
        return {of_size: share, "share_of_max": peak, "share_of_integral": integral}

    def _shape(self) -> tuple[dict[str, float], float | None]:
        """Shape indices of the nucleus outline (eq. 33) and the gap between lamina and pillar on the axis [µm]."""
        u = self.run.state.u
        if isinstance(self.nucleus, Surface):
            section = self.nucleus.section_moments(u, level=self.layout.centre[2])
            half_length, half_area = section.length / 2, section.area / 2
            bottom, top = (self.nucleus.pole(u, sign) for sign in (-1.0, 1.0))
        else:
            half_length, half_area = (modelled / (1 if self.layout.half else 2) for modelled in self.nucleus.extent(u))
            bottom, top = (self._position(self.nucleus, sign) for sign in (-1.0, 1.0))
        straight = float(np.linalg.norm(top - bottom))
        index = {
            "full": 4 * np.pi * 2 * half_area / (2 * half_length) ** 2,
            "half_outline": 4 * np.pi * half_area / (half_length + straight) ** 2,
            "half_area_full_perimeter": 4 * np.pi * half_area / (2 * half_length) ** 2,
        }
        tops = [pillar.top(float(bottom[0]), *map(float, bottom[2:])) for pillar in self.layout.pillars]
        below = [y for y in tops if y is not None]
        return index, float(bottom[1] - max(below)) if below else None

    def _contact(self) -> dict[str, float | None]:
        run, layout = self.run, self.layout
        force = run.ledger.contact_force() * layout.copies
        dead = run.body.dead(run.ledger.amplitude)
        weight = 0.0 - float(run.ledger.load_resultant()[1]) * dead * layout.copies
        unit = self.kinematics.force_unit.replace(" ", "_x_")
        result: dict[str, float | None] = {
            f"force_{unit}": float(force[1]),
            f"lateral_force_{unit}": 0.0 if layout.half else float(force[0]),
            f"weight_{unit}": weight,
            "max_depth_um": None,
            "max_pressure_Pa": None,
            "half_width_um": None,
            "lift_um": layout.lift_um,
            "slide_um": layout.slide_um[0],
            **({"slide_z_um": layout.slide_um[1]} if self.dim == 3 else {}),
        }
        for driver in run.body.pulling:
            result[f"{driver.name}_{unit}"] = 0.0 - float(run.ledger.resultant(driver.name)[1]) * layout.copies
        obstacles: tuple[Obstacle, ...] = (*run.body.obstacles, *run.out_of_reach)
        if run.body.contact is not None and obstacles:
            contact = run.body.contact
            outline, u = run.outline, run.state.u
            depth = outline.max_depth(u, obstacles)
            result["max_depth_um"] = max(depth, 0.0)
            result["max_pressure_Pa"] = contact.pressure_at(depth)
            if isinstance(outline, Surface):
                modelled = outline.contact_area(u, obstacles, contact.threshold_um)
                whole = replace(modelled, area_um2=modelled.area_um2 * layout.copies)
                result |= {"half_width_um": whole.radius_um, "area_um2": whole.area_um2}
            else:
                length = outline.contact_length_x(u, obstacles, contact.threshold_um)
                result["half_width_um"] = length if layout.half else length / 2
        return result

    def _energy(self) -> dict[str, float | None]:
        ledger, copies = self.run.ledger, self.layout.copies
        stored = {"stored": ledger.stored() * copies}
        body, works = self.run.body, ledger.works
        given = {f"{'gravity' if n == 'load' else n}_work": work * copies for n, work in ledger.given().items()}
        spent = stored | {"dissipated": ledger.dissipated * copies, "contact_work": ledger.contact_work * copies}
        if body.drag is not None:
            spent["drag_work"] = works["drag"] * copies
        if not self.run.has_a_way:
            works_of_the_way = (name for name in spent if name != "stored")
            return {**dict.fromkeys((*given, *works_of_the_way, "balance_error")), **stored}
        if body.density is not None:
            spent["kinetic"] = ledger.kinetic() * copies
        return {**given, **spent, "balance_error": sum(given.values()) - sum(spent.values())}


def point_fields(observer: Observer) -> dict[str, np.ndarray]:
    """Point data of the last observed state: what `fields` files hold.

    Returns:
        Values by name, shape (n_pieces, n_points) or, of vectors, (n_pieces, n_points, d). An element is one piece, of
        third order four triangles or eight tetrahedra; ends first, then their middles in VTK's order.
    """
    samples, gradient = observer.samples, observer.gradient
    reported = slice(0, samples.n_max)
    position, values = samples.position[:, reported], samples.values[:, reported]
    fields = {
        "position": position,
        "displacement_um": gradient.position[:, reported] - position,
        "sigma_mises_Pa": values[..., 0],
        "J1": values[..., 1] + observer.rest[1],
        "J2": values[..., 2] + observer.rest[2],
        "J3": values[..., 3] + observer.rest[3],
        "det_F": values[..., DET_F],
        "pressure_Pa": values[..., PRESSURE],
        "pressure_gradient_Pa_per_um": np.broadcast_to(gradient.values, position.shape),
    }
    pieces = lattice_pieces(observer.subdivisions, observer.dim)
    return {name: array[:, pieces].reshape(-1, *array[:, pieces].shape[2:]) for name, array in fields.items()}

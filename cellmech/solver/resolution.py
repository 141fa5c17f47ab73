"""Resolution of the contact by the mesh: edges between its largest pressure and its ends; and what else is in doubt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl

from cellmech.fem.jit import compile_form
from cellmech.fem.outline import Outline, along, deepest, depth, slope
from cellmech.fem.surface import Surface
from cellmech.mechanics.balance import Body, contact_work
from cellmech.mechanics.contact import Contact
from cellmech.solver.acceptance import MISSED
from cellmech.solver.energy_balance import owned_values
from cellmech.solver.simulation import Simulation

NEAR_AXIS = 1e-7  # µm
SAMPLES = 16  # of an edge
ENOUGH = 2.0  # edges; with one the depth is off by 2 %, with two by less than 0.5 % (docs/accuracy.md)
COUNTS = 0.03  # of the whole force: a contact that bears less is not looked at
BETWEEN = 40  # Gauss points of an edge that tell what the solver's own miss between them
INSIDE = 3  # times the solver's degree of quadrature, likewise of an element's inside
UNTOLD = "the cell has hardly begun to move, and what is wrong may be as large as what it has moved"
ROUNDED = 1e-6  # of the load, ten times Newton's tolerance: what round-off keeps out of balance is told of from there
MISSING = 0.02  # of the works turned over: what the energies' balance may leave of them
SOFT = 0.5  # of the contact's half-width: an obstacle that the cell sinks into further is not rigid


@dataclass(frozen=True)
class Stretch:
    """A piece of the outline that touches.

    Args:
        edges: from the deepest point to the nearer end of the contact, in element edges.
        share: of the whole contact force, roughly [-].
        half_width_um: half its length.
        depth_um: largest.
    """

    edges: float
    share: float
    half_width_um: float
    depth_um: float


def stretches(run: Simulation, axis: float | None) -> list[Stretch]:
    """The contacts of the present state, from the left to the right of the cell's bottom. Collective.

    Args:
        run: the run.
        axis: x of the mirror axis on which the outline begins and no contact ends, None for a full cell [µm].
    """
    contact, obstacles = run.body.contact, (*run.body.obstacles, *run.out_of_reach)
    if contact is None or not obstacles:
        return []
    if isinstance(run.outline, Surface):
        return _patches(run, run.outline, contact)
    outline, s = run.outline, np.linspace(0.0, 1.0, SAMPLES + 1)
    place = along(outline.nodes(run.state.u), s)
    deep = deepest(obstacles, place) - contact.threshold_um
    mine = np.flatnonzero(np.any(deep > 0.0, axis=1))
    parts = run.comm.allgather((outline.reference[mine, :2], place[mine], deep[mine]))
    ends, place, deep = (np.concatenate(column) for column in zip(*parts, strict=True))
    weight = run.body.kinematics.weight
    found = [_stretch(contact, weight, *piece) for piece in _pieces(ends, place, deep, axis)]
    total = sum(one.share for one in found)
    return [Stretch(one.edges, one.share / total, one.half_width_um, one.depth_um) for one in found if total > 0.0]


def _patches(run: Simulation, surface: Surface, contact: Contact) -> list[Stretch]:
    """The contact with each obstacle that is touched, in space; edges are of a right-angled facet of their size.

    One that reaches a plane of symmetry goes on behind it.
    """
    found, u = [], run.state.u
    planes = ["xyz".index(name[-1]) for name in run.body.domain.facets if name.startswith("symmetry")]
    nodes = surface.nodes(u)
    corners = nodes[:, :3]
    facets = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1) / 2
    for obstacle in run.body.obstacles:
        on = np.any(depth(obstacle, nodes) > contact.threshold_um, axis=1)
        area, count = run.comm.allreduce(np.array([facets[on].sum(), np.count_nonzero(on)]))
        nearest = np.abs(surface.reference[on][..., planes]).min(axis=(0, 1), initial=np.inf)
        cut = np.count_nonzero(np.min(run.comm.allgather(nearest), axis=0) < NEAR_AXIS)
        radius = surface.contact_area(u, [obstacle], contact.threshold_um).radius_um * np.sqrt(2.0**cut)
        deep = surface.max_depth(u, [obstacle]) - contact.threshold_um
        if count and deep > 0.0:
            share = contact.pressure_at(deep + contact.threshold_um) * radius**2
            found.append(Stretch(radius / float(np.sqrt(2 * area / count)), share, radius, deep))
    total = sum(one.share for one in found)
    return [replace(one, share=one.share / total) for one in found]


def _pieces(
    ends: np.ndarray, place: np.ndarray, depth: np.ndarray, axis: float | None
) -> list[tuple[np.ndarray, np.ndarray, bool]]:
    """Samples of each piece that touches without a gap: positions, depths, whether it begins on the axis."""
    following = {tuple(np.round(end[0], 9)): k for k, end in enumerate(ends)}
    after = [following.get(tuple(np.round(end[1], 9))) for end in ends]
    starts = sorted(set(range(len(ends))) - {k for k in after if k is not None}, key=lambda k: ends[k, 0, 0])
    pieces: list[tuple[np.ndarray, np.ndarray, bool]] = []
    for k in starts:
        chain: list[int] = []
        at: int | None = k
        while at is not None:
            chain.append(at)
            at = after[at]
        x = np.concatenate([place[chain[0], :1], *(place[j, 1:] for j in chain)])
        d = np.concatenate([depth[chain[0], :1], *(depth[j, 1:] for j in chain)])
        cuts = np.flatnonzero(np.diff(np.concatenate([[False], d > 0.0, [False]]).astype(int)))
        mirrored = axis is not None and abs(float(ends[k, 0, 0]) - axis) < NEAR_AXIS
        pieces += [(x[a:b], d[a:b], bool(mirrored and a == 0)) for a, b in cuts.reshape(-1, 2)]
    return pieces


def _stretch(
    contact: Contact, weight: Callable[[np.ndarray], Any], x: np.ndarray, d: np.ndarray, on_axis: bool
) -> Stretch:
    peak, last = int(np.argmax(d)), len(d) - 1
    edges = (last - peak + 1) / SAMPLES if on_axis else (min(peak, last - peak) + 1) / SAMPLES
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    pressure = np.array([contact.pressure_at(float(depth + contact.threshold_um)) for depth in d]) * weight(x.T)
    force = float(np.sum((pressure[1:] + pressure[:-1]) / 2 * length)) or float(pressure.max())
    width = float(length.sum())
    return Stretch(edges, force, width if on_axis else width / 2, float(d.max()))


def missed(run: Simulation) -> float:
    """Share of the contact's force that lies between the solver's quadrature points, or in them alone [-]. Collective.

    An obstacle's edge between two points pushes nothing in the solver's eyes, and one just at a point pushes all along
    its share of the element.
    """
    if run.body.contact is None or not run.body.obstacles:
        return 0.0
    if run.body.contact.on_surface and isinstance(run.outline, Outline):
        fine = _finely_on_the_outline(run, run.outline)
    else:
        fine = _finely(run)
    told = run.ledger.resultant("contact")
    largest = max(float(np.linalg.norm(fine)), float(np.linalg.norm(told)))
    return float(np.linalg.norm(fine - told)) / largest if largest else 0.0


def missed_pull(run: Simulation) -> float:
    """Share of the pull across gaps that lies between the solver's quadrature points, or in them alone [-]. Collective.

    An element longer than the range may have the whole pull between two of its points. Where the surface sticks pulls
    of all directions cancel, so nodal forces are compared, and not their sum.
    """
    if not run.body.pulling:
        return 0.0
    fine = replace(run.body, contact_degree=INSIDE * run.body.contact_degree)
    sums = np.zeros(2)
    for driver in run.body.pulling:
        works = [driver.work(body, run.state.u, _test(body)) for body in (run.body, fine)]
        if None not in works:
            told, finely = (_forces(work, run) for work in works)
            sums += np.abs(finely - told).sum(), np.abs(finely).sum()
    off, whole = run.comm.allreduce(sums)
    return float(off / whole) if whole else 0.0


def _finely_on_the_outline(run: Simulation, outline: Outline) -> np.ndarray:
    """The force of a surface form [Pa µm or pN], anew over the deformed outline; shape (2,). Collective."""
    contact = run.body.contact
    assert contact is not None
    nodes, (s, weight) = outline.nodes(run.state.u), np.polynomial.legendre.leggauss(BETWEEN)
    x, tangent = along(nodes, (s + 1) / 2), slope(nodes, (s + 1) / 2)
    length = np.linalg.norm(tangent, axis=-1) * weight / 2 * run.body.kinematics.weight(np.moveaxis(x, -1, 0))
    pressure_at = np.vectorize(contact.pressure_at, otypes=[float])
    force = np.zeros(2)
    for obstacle in run.body.obstacles:
        d = depth(obstacle, x)
        on = d > contact.threshold_um
        if contact.symmetric:  # along the outline's own normal, inwards: the outline runs counter-clockwise
            towards = np.stack([-tangent[on][:, 1], tangent[on][:, 0]], axis=-1)
        else:
            towards = -np.stack(np.broadcast_arrays(*obstacle.gradient(x[on].T)), axis=-1)
        normal = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
        force += (pressure_at(d[on]) * length[on]) @ normal if on.any() else 0.0
    return run.comm.allreduce(force)


def _finely(run: Simulation) -> np.ndarray:
    """The contact's force [Pa µm or pN] by quadrature of a higher degree, a component each. Collective."""
    body = replace(run.body, contact_degree=INSIDE * run.body.contact_degree)
    work = contact_work(body, run.state, _test(body))
    assert work is not None
    values = _forces(work, run)
    return run.comm.allreduce(values.reshape(-1, run.components).sum(axis=0))


def _test(body: Body) -> Any:
    return ufl.TestFunction(body.space)


def _forces(work: ufl.Form, run: Simulation) -> np.ndarray:
    """Owned nodal forces of a virtual work [Pa µm or pN], flat. Collective."""
    return owned_values(compile_form(work, run.comm))


def doubts(run: Simulation, axis: float | None) -> dict[str, str]:
    """Doubts about a state, its contact above all, for the warnings of a model. Collective."""
    found = {} if run.told else {"motion": UNTOLD}
    if (share := run.totals.rounded) > ROUNDED:
        found["round-off"] = (
            f"round-off keeps forces of {share:.2g} of the load out of balance in the worst of {run.totals.steps} "
            "steps: stiffness times position is as much larger than the load; contact carries the load all the same"
        )
    bearing = [one for one in stretches(run, axis) if one.share >= COUNTS]
    coarse = [one for one in bearing if one.edges < ENOUGH]
    if coarse:
        worst = min(coarse, key=lambda one: one.edges)
        found["contact mesh"] = (
            f"the mesh is too coarse for {len(coarse)} of {len(bearing)} contacts: {worst.edges:.2g} element edges lie "
            f"between the largest pressure and the end of the contact, {worst.half_width_um:.3g} um in half-width, and "
            f"{ENOUGH:g} or more should; depth and strain may be off by more than 1 %; set mesh.size_um lower"
        )
    share = missed(run)
    if not coarse and share > MISSED:
        found["contact mesh"] = (
            f"the mesh is too coarse for the contact: {100 * share:.2g} % of its force lie between the points at which "
            "it is integrated; depth and strain may be off by as much; set mesh.size_um lower, or "
            "contact.quadrature_degree higher"
        )
    if (share := missed_pull(run)) > MISSED:
        found["adhesion mesh"] = (
            f"the mesh is too coarse for the adhesion: {100 * share:.2g} % of its pull lie between the points at which "
            "it is integrated; what it does may be off by as much; set mesh.size_um lower, contact.quadrature_degree "
            "higher, or adhesion.range_um wider"
        )
    soft = [one for one in bearing if one.depth_um > SOFT * one.half_width_um]
    if soft:
        worst = max(soft, key=lambda one: one.depth_um - SOFT * one.half_width_um)
        found["penalty"] = (
            f"the cell sinks {worst.depth_um:.3g} um into an obstacle on a contact {worst.half_width_um:.3g} um in "
            "half-width: it yields like a cushion; raise contact.penalty_Pa_per_um for a rigid one"
        )
    return found


def unbalanced(missing: float, turnover: float) -> str:
    """What is in doubt of a way on which energy is lost; "" where next to none is.

    Args:
        missing: what the balance of the energies leaves.
        turnover: the largest works of what drives the body so far, of the same unit.
    """
    if abs(missing) <= MISSING * turnover:
        return ""
    return (
        f"{abs(missing) / turnover:.2g} of the work that was done is {'missing' if missing > 0 else 'too much'} in the "
        "balance of the energies: steps are too long for what happens in them, an impact perhaps; set time.rtol lower"
    )

"""From a scene to a body: geometry, materials, obstacles, load, in the units of the solver."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from cellmech.cell.additions import Additions
from cellmech.cell.footing import follow, modulus_of
from cellmech.cell.layering import INSIDE_OUT, MERGED, MeshPlan, fade_of
from cellmech.cell.observables import Layout, Ring
from cellmech.errors import InputError, SolveError
from cellmech.fem.coefficients import mixtures
from cellmech.fem.domain import Domain, build_domain, whole
from cellmech.fem.jit import displacement_space, pressure_space
from cellmech.fem.outline import Outline
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact, smooth_step
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.materials import Material
from cellmech.mechanics.obstacles import Flat, Obstacle, Pillar
from cellmech.mesh.disc import DiscSpec
from cellmech.scene.parts import LAYER_NAMES, LayerName
from cellmech.scene.placement import STEEP, Placement, placement, rest_beside, slope_at, standing
from cellmech.scene.scene import Scene
from cellmech.solver.rigid_modes import rigid_modes
from cellmech.solver.schedule import LOAD_STEPS, SMALL, Schedule
from cellmech.solver.simulation import Run

# Units inside: µm, s, Pa.
KG_M3 = 1e-12  # kg/m^3 in Pa s^2/µm^2
M_S2 = 1e6  # m/s^2 in µm/s^2

ZONE_OVER_HERTZ = 1.32  # on Table 1 the contact edge lies at 0.9 of Hertz's half-width, the membrane's peaks beyond it
NEAR = 5e-4  # of the radius: an obstacle that near is modelled from the start
SMALL_FALL = 1e-5  # of a fall: errors of its first moments, which it carries on, are relative to no less
LEAST_FALL = 1e-12  # of the radius: nor are they to less than this, of which round-off leaves three digits
FALLEN = 100.0  # small displacements, after which what a fall has carried on is within its tolerance
OVERLAP = 1e-6  # of the radius: so deep an obstacle may begin, for rounding
NONE = Additions()
_MESHES = MPI.Comm.Create_keyval()  # a number of a communicator would not do: MPI gives it to another one after `Free`


def _domain(spec: DiscSpec, comm: MPI.Comm) -> Domain:
    """The mesh of a disc; a communicator keeps its last few, so that they end with it (collective)."""
    kept: Any = comm.Get_attr(_MESHES)
    if kept is None:
        kept = lru_cache(maxsize=4)(partial(build_domain, comm=comm))
        comm.Set_attr(_MESHES, kept)
    return kept(spec)


def material(scene: Scene, name: LayerName) -> Material:
    """A layer's material (eqs 6-13, 17-20)."""
    layer, cell, law = scene.layer_of(name), scene.cell, LAWS[scene.layer_law(name)]
    energy = law.in_plane if cell.trace == "in-plane" and law.in_plane is not None else law
    lmbda, mu = scene.lame(name)
    constants = {"lmbda": lmbda, "mu": mu}
    for argument, constant in law.constants.items():
        constants[argument] = scene.constant(name, constant) * (mu if constant.times_mu else 1.0)
    viscosities = (cell.fluid_lambda_Pa_s, cell.fluid_mu_Pa_s) if scene.time.history else (0.0, 0.0)
    mixed, power = name in mixed_layers(scene), cell.solid_exponent
    return Material(energy, constants, layer.fluid_fraction, *viscosities, mixed=mixed, solid_exponent=power)


def mixed_layers(scene: Scene) -> frozenset[LayerName]:
    """Layers whose pressure is an unknown of its own: nearly incompressible ones, unless the scene says otherwise.

    Smeared layers have one pressure, and so one form: all are mixed as soon as one should be. Only elements of second
    order have a mixed form here.
    """
    if scene.mesh.pressure == "none" or scene.mesh.order != 2:
        return frozenset()
    wanted = scene.nearly_incompressible()
    everywhere = scene.mesh.pressure == "mixed" or (wanted and scene.cell.layers == "smeared")
    return frozenset(LAYER_NAMES if everywhere else wanted)


def smeared_weights(scene: Scene, domain: Domain, centre: tuple[float, float]) -> dict[str, Any]:
    """The paper's characteristic functions g_i [-] (eqs 2-5), H of positive argument inside; no fade at the rim."""
    X = ufl.SpatialCoordinate(domain.mesh)
    r = ufl.sqrt((X[0] - centre[0]) ** 2 + (X[1] - centre[1]) ** 2)
    width = fem.Constant(domain.mesh, float(scene.cell.smear_um or 0.0))
    weights: dict[str, Any] = {}
    inside: Any = 0.0
    for name in INSIDE_OUT[:-1]:
        middle, _ = fade_of(scene, name)
        squared = (middle**2 - r**2) / (2 * scene.nucleus_radius_um)
        within = smooth_step(squared if scene.cell.fade == "squared" else middle - r, width)
        weights[name], inside = within - inside, within
    weights[INSIDE_OUT[-1]] = 1.0 - inside
    return weights


def obstacles_of(scene: Scene) -> dict[str, Obstacle]:
    """The scene's obstacles by label; a half cell's pillars are mirrored at x = 0."""
    found: dict[str, Obstacle] = {}
    for stand in standing(scene.cell.shape == "half", scene.pillar):
        found[f"pillar {stand.pillar}" + (" mirrored" if stand.mirrored else "")] = stand.arch
    if scene.flat is not None:
        found["flat"] = Flat(scene.flat.y_um)
    return found


def ramp(half_ramp_s: float) -> Callable[[float], float]:
    """t_g(t) [-]: the C2 step from 0 at t = 0 to 1 at t = 2 T_g (eq. 25); 1 at once for T_g = 0."""

    def amplitude(t: float) -> float:
        if half_ramp_s == 0:
            return 1.0
        s = min(max(t / (2 * half_ramp_s), 0.0), 1.0)
        return s**3 * (10 - 15 * s + 6 * s**2)

    return amplitude


class Setup:
    """Everything a scene becomes before it runs (collective on comm).

    Args:
        scene: validated input.
        comm: the ranks that share this case.
        plan: which layers are meshed apart.
        additions: what the scene cannot say.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm, plan: MeshPlan, additions: Additions = NONE) -> None:
        self.scene, self.half, self.additions = scene, scene.cell.shape == "half", additions
        self.place: Placement = placement(scene)
        self.lift_um = scene.cell.gap_um if self.place.touch and not scene.cell.inertia else 0.0
        self.centre = (self.place.centre_x_um, self.place.centre_y_um - self.lift_um)
        self.interfaces = plan.interfaces(scene)
        density = scene.cell.density_kg_m3 - scene.cell.medium_density_kg_m3
        self.force_density = density * KG_M3 * scene.load.gravity_m_s2 * M_S2 * scene.load.factor
        self.weight = self.force_density * math.pi * scene.radius_um**2
        self.contact = self._contact()
        standard = DiscSpec(
            shape=scene.cell.shape,
            centre=self.centre,
            interfaces=self.interfaces,
            nucleus_radius_um=scene.nucleus_radius_um,
            size_um=scene.mesh.size_um,
            contact_size_um=scene.mesh.contact_size_um,
            order=min(scene.mesh.order, 2),
            thin_layers=scene.mesh.thin_layers,
            touch=tuple((t.x_um, t.y_um) for t in self.place.touch),
            contact_zone_um=self._contact_zone_um(),
            grading=plan.grading,
        )
        fitted = scene.mesh.grading == "fitted"
        self.spec = follow(standard, scene, self.weight, self.contact.pressure_at) if fitted else standard
        self.domain = _domain(self.spec, comm)
        self.obstacles = additions.beside(obstacles_of(scene), scene.radius_um if self.half else None)
        self.body, self.out_of_reach = self._body()

    def _contact_zone_um(self) -> float:
        """Radius of the finely meshed zone [µm]: somewhat more than Hertz's half-width on the cytosol's solid."""
        radius, modulus = self.scene.radius_um, modulus_of(self.scene)
        half_width = 2.0 * math.sqrt(abs(self.weight) * radius / (math.pi * modulus))
        return radius * min(max(ZONE_OVER_HERTZ * half_width / radius, 0.1), 1.0)

    def _contact(self) -> Contact:
        """How obstacles push, whether there are any or not."""
        settings = self.scene.contact
        width = settings.smoothing_um if settings.form == "surface" else settings.volume_width_um
        return Contact(settings.form, settings.penalty_Pa_per_um, width)

    @property
    def number_of_cells(self) -> int:
        """Triangles of the whole mesh."""
        return int(self.domain.mesh.topology.index_map(self.domain.mesh.topology.dim).size_global)

    @property
    def dofs(self) -> int:
        """Unknowns of the whole mesh."""
        return int(self.body.space.dofmap.index_map.size_global) * 2

    @property
    def force_scale(self) -> float:
        """What residuals are measured by [Pa µm]: the weight modelled, or a stiffness if there is none."""
        soft = min(map(self.scene.layer_young_Pa, LAYER_NAMES))
        return abs(self.weight) / (2 if self.half else 1) or 1e-3 * soft

    def _body(self) -> tuple[Body, list[Obstacle]]:
        scene, domain = self.scene, self.domain
        smeared, own = scene.cell.layers == "smeared", self.additions.materials
        layers: dict[str, Material] = {name: own.get(name) or material(scene, name) for name in LAYER_NAMES}
        mixed = any(one.mixed for one in layers.values())
        space = displacement_space(domain.mesh, scene.mesh.order, bubble=mixed)
        first: dict[str, str] = {merged: pair[0] for pair, merged in MERGED.items()}
        groups = {name: layers[first.get(name, name)] for name, _ in self.interfaces if not smeared}
        blend = smeared_weights(scene, domain, self.centre) if smeared else None
        contact = self.contact if self.obstacles else None
        body = Body(
            domain=domain,
            mixtures=mixtures(domain, layers if smeared else groups, blend),
            space=space,
            bcs=self.symmetry(space),
            body_force=(0.0, -self.force_density),
            contact=contact,
            density=scene.cell.density_kg_m3 * KG_M3 if scene.cell.inertia else None,
            amplitude=ramp(scene.load.half_ramp_s),
            bulk_degree=scene.mesh.quadrature_degree,
            contact_degree=scene.contact.quadrature_degree,
            pressure_space=pressure_space(domain.mesh) if mixed else None,
        )
        outline, rest = Outline(domain, space, "outer"), fem.Function(space)
        gap = -max(self.contact.width, NEAR * scene.radius_um)
        depths = {label: outline.max_depth(rest, [o]) for label, o in self.obstacles.items()}
        for label in self.additions.obstacles:
            if depths[label] > OVERLAP * scene.radius_um:
                rule = f"must not overlap the cell at the start, and does by {depths[label]:.3g} um"
                raise InputError("Additions", f"obstacles.{label}", rule)
        near = {label: depth > gap for label, depth in depths.items()}
        reached = tuple(o for label, o in self.obstacles.items() if near[label])
        others = [o for label, o in self.obstacles.items() if not near[label]]
        return dataclasses.replace(body, obstacles=reached), others

    def symmetry(self, space: Any) -> tuple[Any, ...]:
        """u_x = 0 on the axis of a half cell."""
        if not self.half:
            return ()
        tags = self.domain.facet_tags
        facets = tags.indices[tags.values == self.domain.facets["axis"]]
        dofs = fem.locate_dofs_topological(space.sub(0), 1, facets)
        return (fem.dirichletbc(PETSc.ScalarType(0), dofs, space.sub(0)),)

    @property
    def mirror_symmetric(self) -> bool:
        """Whether the obstacles are symmetric about the cell's vertical axis."""
        x0 = 2 * self.centre[0]
        pillars = [o for o in self.obstacles.values() if isinstance(o, Pillar)]
        if len(pillars) + (self.scene.flat is not None) < len(self.obstacles):
            return False  # whether the others are, nobody has said
        images = {(round(x0 - p.x_um, 9), p.y_um, p.half_width_um, p.height_um, p.exponent) for p in pillars}
        return images == {(round(p.x_um, 9), p.y_um, p.half_width_um, p.height_um, p.exponent) for p in pillars}

    @property
    def free_sideways(self) -> bool:
        """Whether nothing tells left from right: a symmetric scene, a flat alone in reach, a hardly sloping top."""
        hardly = 0.0 < abs(slope_at(self.place.touch)) <= STEEP
        return hardly or self.mirror_symmetric or all(isinstance(o, Flat) for o in self.body.obstacles)

    @property
    def falls(self) -> bool:
        """Whether the cell begins in the air and its fall is computed."""
        return self.scene.cell.inertia and (self.scene.cell.gap_um > 0 or not self.place.touch)

    def refuse_without_equilibrium(self) -> None:
        """Raise SolveError where statics alone says that there is none."""
        if self.scene.cell.inertia or self.weight == 0:
            return
        if self.weight < 0:
            raise SolveError("floats: the medium is denser than the cell, no equilibrium without inertia")
        slope = slope_at(self.place.touch)
        if not self.half and abs(slope) > STEEP:
            touch, way = self.place.touch[0], rest_beside(self.scene)
            text = f"slides: no equilibrium; the only touch is on a slope (x = {touch.x_um:.4g} um, normal tilted by "
            text += f"{math.degrees(math.asin(slope)):.3g} degrees) and contact is frictionless"
            if way is not None:
                text += f"; it would rest at cell.centre_x_um = {self.place.centre_x_um + way:.6g}"
            raise SolveError(text)

    def layout(self) -> Layout:
        """What the observables need to know of the geometry."""
        scene, apart = self.scene, {name for name, _ in self.interfaces}
        regions: dict[str, Ring] = {"nucleus": Ring(0.0, scene.nucleus_radius_um), "cell": Ring(0.0, scene.radius_um)}
        regions |= {name: Ring(scene.inner_radius_um(name), scene.outer_radius_um(name)) for name in INSIDE_OUT}
        nucleus = tuple(name for name, radius in self.interfaces if radius <= scene.nucleus_radius_um)
        groups: dict[str, tuple[str, ...]] = {"nucleus": nucleus, "cell": tuple(apart)}
        pieces = {name: tuple(n for n in apart if whole(n) == name) for name in INSIDE_OUT}
        groups |= {name: own for name, own in pieces.items() if own}
        pillars = tuple(o for o in self.obstacles.values() if isinstance(o, Pillar))
        return Layout(self.centre, self.half, regions, groups, pillars, self.lift_um, self.place.slide_um)

    def schedule(self) -> Schedule:
        """Times to land on, and the tolerance."""
        scene, end = self.scene, self.scene.time.end_s
        load_steps = LOAD_STEPS if scene.time.history else 0
        ramp_end = min(scene.ramp_end_s, end)
        small = self._small_um()
        told = FALLEN * small if self.falls else 0.0
        return Schedule(end, scene.output.times_s, scene.time.rtol, ramp_end, load_steps, small, told)

    def _small_um(self) -> float:
        """A displacement that is small beside what the load leads to by the end [µm]: on Table 1 a twentieth of it.

        For a cell that falls a small displacement is that of its first moments. A stiff cell sinks into its obstacle
        more than this tells; the run looks after that.
        """
        if self.falls:
            return max(SMALL_FALL * self._fall_um(), LEAST_FALL * self.scene.radius_um)
        scene = self.scene
        soft = min(scene.layer_young_Pa(name) * max(scene.layer_solid(name), 0.1) for name in LAYER_NAMES)
        load, radius = abs(self.force_density) * self.body.amplitude(self.scene.time.end_s), self.scene.radius_um
        return min(SMALL * load * radius**2 / soft, 1e-2 * radius)

    def _fall_um(self) -> float:
        """How far the cell falls by the first time that is reported, or to first touch if that is less [µm]; > 0."""
        scene = self.scene
        t = np.linspace(0.0, min((*scene.output.times_s, scene.time.end_s)), 201)
        g = self.force_density / (scene.cell.density_kg_m3 * KG_M3)
        speed = np.cumsum([self.body.amplitude(moment) for moment in t]) * t[1] * g
        way = float(np.sum(speed) * t[1])
        gap = scene.cell.gap_um if self.place.touch and scene.cell.gap_um > 0 else math.inf
        return min(way, gap) or scene.radius_um

    def create_run(self, log: Callable[[str], None]) -> Run:
        """The run, its zero modes removed where the scene has any."""
        modes = None
        if not self.half and not self.scene.cell.inertia:
            modes = rigid_modes(self.body, self.centre, sideways=self.free_sideways)
        return Run(self.body, self.schedule(), self.force_scale, self.out_of_reach, modes, not self.falls, log)

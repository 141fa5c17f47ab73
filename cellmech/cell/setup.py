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

from cellmech.causes import Cause
from cellmech.cell.additions import Additions
from cellmech.cell.driving import driven
from cellmech.cell.layering import INSIDE_OUT, MeshPlan, fade_of, shells, stiffness_Pa
from cellmech.cell.observables import Layout, Ring
from cellmech.cell.placed import KG_M3, Placed
from cellmech.errors import InputError, SolveError
from cellmech.fem.boundary import boundary
from cellmech.fem.coefficients import material_fields
from cellmech.fem.domain import Domain, build_domain, whole
from cellmech.fem.jit import displacement_space, pressure_space
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import smooth_step
from cellmech.mechanics.contraction import Contraction
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.materials import Material
from cellmech.mechanics.obstacles import Flat, Obstacle, Pillar
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.disc import DiscSpec
from cellmech.scene.driver_parts import Actin
from cellmech.scene.parts import LAYER_NAMES, LayerName
from cellmech.scene.placement import STEEP, rest_beside, slope_at
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import Upright, facing, standing, symmetric
from cellmech.solver.acceptance import Acceptance
from cellmech.solver.ellipticity import StabilityWatch
from cellmech.solver.resolution import missed
from cellmech.solver.rigid_modes import rigid_modes
from cellmech.solver.schedule import LOAD_STEPS, SMALL, Schedule
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import free_translations

NEAR = 5e-4  # of the radius: an obstacle that near is modelled from the start
PLANES = {"axis": 0, "symmetry x": 0, "symmetry z": 2}  # facet groups, and the component that is held on each
SMALL_FALL = 1e-5  # of a fall: errors of its first moments, which it carries on, are relative to no less
LEAST_FALL = 1e-12  # of the radius: nor are they to less than this, of which round-off leaves three digits
FALLEN = 100.0  # small displacements, after which what a fall has carried on is within its tolerance
OVERLAP = 1e-6  # of the radius: so deep an obstacle may begin, for rounding
NONE = Additions()
_MESHES = MPI.Comm.Create_keyval()  # a number of a communicator would not do: MPI gives it to another one after `Free`


def _domain(spec: DiscSpec | BallSpec, comm: MPI.Comm) -> Domain:
    """The mesh of a disc or a ball; a communicator keeps its last few, so that they end with it (collective)."""
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

    Smeared layers have one pressure, and so one form: all are mixed as soon as one should be. Only triangles of second
    order have a mixed form here.
    """
    if scene.mesh.pressure == "none" or scene.mesh.order != 2 or scene.cell.geometry == "3d":
        return frozenset()
    wanted = scene.nearly_incompressible()
    everywhere = scene.mesh.pressure == "mixed" or (wanted and scene.cell.layers == "smeared")
    return frozenset(LAYER_NAMES if everywhere else wanted)


def smeared_weights(scene: Scene, domain: Domain, centre: tuple[float, ...]) -> dict[str, Any]:
    """The paper's characteristic functions g_i [-] (eqs 2-5), H of positive argument inside; no fade at the rim."""
    X = ufl.SpatialCoordinate(domain.mesh)
    r = ufl.sqrt(sum((X[k] - c) ** 2 for k, c in enumerate(centre)))
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
    """The scene's obstacles by label, mirror images included where the modelled part of the cell may meet them."""
    found: dict[str, Obstacle] = {stand.label: stand.arch for stand in facing(scene)}
    if scene.flat is not None:
        found["flat"] = Flat(scene.flat.y_um)
    return found


class Setup(Placed):
    """Everything a scene becomes before it runs (collective on comm).

    Args:
        scene: validated input.
        comm: the ranks that share this case.
        plan: which layers are meshed apart.
        additions: what the scene cannot say.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm, plan: MeshPlan, additions: Additions = NONE) -> None:
        super().__init__(scene, plan)
        self.comm, self.additions = comm, additions
        self.refuse_what_is_too_large(comm)
        self.domain = _domain(self.spec, comm)
        self.obstacles = additions.beside(obstacles_of(scene), scene.radius_um if self.half else None)
        self.body, self.out_of_reach = self._body()

    @property
    def number_of_cells(self) -> int:
        """Triangles of the whole mesh."""
        return int(self.domain.mesh.topology.index_map(self.domain.mesh.topology.dim).size_global)

    @property
    def dofs(self) -> int:
        """Unknowns of the whole mesh."""
        return int(self.body.space.dofmap.index_map.size_global) * self.kinematics.components

    def _body(self) -> tuple[Body, list[Obstacle]]:
        scene, domain = self.scene, self.domain
        smeared, own = scene.cell.layers == "smeared", self.additions.materials
        layers: dict[str, Material] = {name: own.get(name) or material(scene, name) for name in LAYER_NAMES}
        mixed = any(one.mixed for one in layers.values())
        space = displacement_space(domain.mesh, scene.mesh.order, bubble=mixed)
        groups = {name: layers[whole(name)] for name, _ in self.interfaces if not smeared}
        blend = smeared_weights(scene, domain, self.centre) if smeared else None
        contact = self.contact if self.obstacles else None
        pulls = driven(scene, self.centre, self.obstacles, () if smeared else self.interfaces, domain)
        contractions = [one for one in pulls.get("drivers", ()) if isinstance(one, Contraction)]
        body = Body(
            domain=domain,
            materials=material_fields(domain, layers if smeared else groups, blend, contractions),
            space=space,
            bcs=self.symmetry(space),
            body_force=tuple(-self.force_density if k == 1 else 0.0 for k in range(self.kinematics.components)),
            contact=contact,
            density=scene.cell.density_kg_m3 * KG_M3 if scene.cell.inertia else None,
            **pulls,
            bulk_degree=scene.mesh.quadrature_degree,
            contact_degree=scene.contact.quadrature_degree,
            pressure_space=pressure_space(domain.mesh) if mixed else None,
            kinematics=self.kinematics,
            shells=shells(scene, self.interfaces),
        )
        outline, rest = boundary(domain, space, "outer"), fem.Function(space)
        gap = -max(self.contact.width, NEAR * scene.radius_um, body.reach_um)
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
        """No displacement across the planes, or the axis, at which the modelled part ends."""
        tags, found = self.domain.facet_tags, []
        for name, component in PLANES.items():
            if name in self.domain.facets:
                facets = tags.indices[tags.values == self.domain.facets[name]]
                dofs = fem.locate_dofs_topological(space.sub(component), tags.dim, facets)
                found.append(fem.dirichletbc(PETSc.ScalarType(0), dofs, space.sub(component)))
        return tuple(found)

    @property
    def mirror_symmetric(self) -> bool:
        """Whether the obstacles are symmetric about the cell's vertical axis, in space about both planes through it."""
        if self.kinematics.components == 3:
            arches = [stand.arch for stand in standing(self.scene)]
            return self.centre[::2] == (0.0, 0.0) and all(symmetric(arches, axis) for axis in "xz")
        x0 = 2 * self.centre[0]
        pillars = [o for o in self.obstacles.values() if isinstance(o, Pillar)]
        if len(pillars) + (self.scene.flat is not None) < len(self.obstacles):
            return False  # whether the others are, nobody has said
        images = {(round(x0 - p.x_um, 9), p.y_um, p.half_width_um, p.height_um, p.exponent) for p in pillars}
        return images == {(round(p.x_um, 9), p.y_um, p.half_width_um, p.height_um, p.exponent) for p in pillars}

    @property
    def free_sideways(self) -> bool:
        """Whether nothing tells left from right: a symmetric scene, a flat alone in reach, a hardly sloping top.

        A nucleus aside tells where several obstacles are touched; on one the cell is held as if it were symmetric.
        """
        hardly = 0.0 < abs(slope_at(self.scene, self.place.touch)) <= STEEP
        several = len({touch.obstacle for touch in self.place.touch}) > 1
        symmetric = self.mirror_symmetric and not (several and self.scene.lopsided)
        return hardly or symmetric or all(isinstance(o, Flat) for o in self.body.obstacles)

    @property
    def turns(self) -> bool:
        """Whether the modelled part is free to move along a horizontal axis, and so to turn."""
        return bool(np.any(free_translations(self.body)[::2]))

    @property
    def falls(self) -> bool:
        """True if the cell begins in the air and its fall, or its sinking, is computed."""
        return (self.scene.cell.inertia or self.sinks) and (self.scene.cell.gap_um > 0 or not self.place.touch)

    def refuse_without_equilibrium(self) -> None:
        """Raise SolveError where statics alone says that there is none."""
        if self.scene.cell.inertia or self.sinks or self.weight == 0 or self.scene.drivers:
            return
        slope = slope_at(self.scene, self.place.touch)
        if abs(slope) > STEEP:
            touch, way = self.place.touch[0], rest_beside(self.scene)
            told = f"the only touch is on a slope (x = {touch.at[0]:.4g} um, normal tilted by "
            told += f"{math.degrees(math.asin(slope)):.3g} degrees) and contact is frictionless"
            if way is not None:
                rest = (round(at + part, 9) for at, part in zip(self.scene.centre_um, way, strict=True))
                keys = (f"cell.centre_{axis}_um = {at:.6g}" for axis, at in zip("xz", rest, strict=False))
                told += f"; it would rest at {' and '.join(keys)}"
            raise SolveError(Cause.SLIDES.reason(told=told))

    def layout(self) -> Layout:
        """The geometry as the observables need it."""
        scene, apart = self.scene, {name for name, _ in self.interfaces}
        regions: dict[str, Ring] = {"nucleus": Ring(0.0, scene.nucleus_radius_um), "cell": Ring(0.0, scene.radius_um)}
        regions |= {name: Ring(scene.inner_radius_um(name), scene.outer_radius_um(name)) for name in INSIDE_OUT}
        nucleus = tuple(name for name, radius in self.interfaces if radius <= scene.nucleus_radius_um)
        groups: dict[str, tuple[str, ...]] = {"nucleus": nucleus, "cell": tuple(apart)}
        pieces = {name: tuple(n for n in apart if whole(n) == name) for name in INSIDE_OUT}
        groups |= {name: own for name, own in pieces.items() if own}
        return Layout(
            centre=self.centre,
            mirrored=tuple("xyz".index(axis) for axis in scene.mirrors),
            copies=scene.copies,
            regions=regions,
            groups=groups,
            pillars=tuple(o for o in self.obstacles.values() if isinstance(o, Upright)),
            shaped=scene.nucleus is not None,
            lift_um=self.lift_um,
            slide_um=self.place.slide_um,
            obstacles=self.obstacles,
        )

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
        soft = min(stiffness_Pa(scene, name) for name in LAYER_NAMES)
        body, radius = self.body, self.scene.radius_um
        load = abs(self.force_density) * radius * body.dead(body.amplitude(self.scene.time.end_s))
        for _, one in scene.drivers:
            if isinstance(one, Actin):
                load += abs(one.pull_Pa) + soft * (one.contraction or 0.0)
            else:
                load += one.work_uJ_m2 / radius
        return min(SMALL * load * radius / soft, 1e-2 * radius)

    def _fall_um(self) -> float:
        """Way that the cell falls by the first time that is reported, or to first touch if that is less [µm]; > 0."""
        scene = self.scene
        t = np.linspace(0.0, min((*scene.output.times_s, scene.time.end_s)), 201)
        g = abs(self.force_density) / (scene.cell.density_kg_m3 * KG_M3)
        load = abs(np.array([self.body.dead(self.body.amplitude(moment)) for moment in t]))
        if self.body.drag is not None:
            surface = self.kinematics.directions * self.kinematics.ball(scene.radius_um) / scene.radius_um
            speed = load * abs(self.weight) / (self.body.drag * surface)
        else:
            speed = np.cumsum(load) * t[1] * g
        way = float(np.sum(speed) * t[1])
        gap = scene.cell.gap_um if self.place.touch and scene.cell.gap_um > 0 else math.inf
        return min(way, gap) or scene.radius_um

    def create_run(self, log: Callable[[str], None], tolerance: float | None = None) -> Simulation:
        """The run, its zero modes removed where the scene has any; states of no stable material do not count.

        Args:
            log: receives one line of text now and then.
            tolerance: as `Simulation` has it.
        """
        modes = None
        if self.turns and not self.scene.cell.inertia:
            modes = rigid_modes(self.body, self.centre, sideways=self.free_sideways)
        run = Simulation(
            self.body, self.schedule(), self.force_scale, self.out_of_reach, modes, not self.falls, log, tolerance
        )
        watch, goes_on = StabilityWatch(run.body, run.state.u), self.scene.stability == "warn"
        seen, upright = partial(missed, run), self.scene.lopsided
        run.acceptance = Acceptance(run, watch, self.scene.time.end_s, goes_on, seen, upright)
        return run

"""A cell in its place: all of a scene that needs no mesh, and what its mesh will take."""

from __future__ import annotations

from mpi4py import MPI

from cellmech.cell.layering import MeshPlan
from cellmech.cell.meshing import mesh_spec
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.kinematics import GEOMETRIES
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.ball_size import NODES, expected_cells
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.placement import Placement, placement
from cellmech.scene.scene import Scene
from cellmech.solver import room
from cellmech.solver.linear import LARGE

# Units inside: µm, s, Pa.
KG_M3 = 1e-12  # kg/m^3 in Pa s^2/µm^2
M_S2 = 1e6  # m/s^2 in µm/s^2

SURELY = 0.7  # of the memory that a mesh is expected to take, without seeing it


class Placed:
    """A cell in its place.

    Args:
        scene: validated input.
        plan: which layers are meshed apart.
    """

    def __init__(self, scene: Scene, plan: MeshPlan) -> None:
        self.scene, self.half = scene, scene.cell.shape == "half"
        self.kinematics = GEOMETRIES[scene.cell.geometry]
        self.place: Placement = placement(scene)
        falls = scene.cell.inertia or self.sinks
        self.lift_um = scene.cell.gap_um if self.place.touch and not falls else 0.0
        x, y, *z = self.place.centre
        self.centre = (x, y - self.lift_um, *z)
        self.interfaces = plan.interfaces(scene)
        density = scene.cell.density_kg_m3 - scene.cell.medium_density_kg_m3
        self.force_density = density * KG_M3 * scene.load.gravity_m_s2 * M_S2 * scene.load.factor
        self.weight = self.force_density * self.kinematics.ball(scene.radius_um)
        self.contact = self._contact()
        self.spec = mesh_spec(scene, plan, self.centre, self.place.touch, self.weight, self.contact)

    @property
    def sinks(self) -> bool:
        """True if the medium's drag lets the cell move without inertia."""
        return self.scene.medium.viscosity_Pa_s > 0 and self.scene.time.history and not self.scene.cell.inertia

    def _contact(self) -> Contact:
        """The law of the contact, whether there are obstacles or not."""
        settings = self.scene.contact
        return Contact(settings.form, settings.penalty_Pa_per_um, getattr(settings, settings.width_key))

    def expected_size(self) -> tuple[int, int, float]:
        """Elements and unknowns that a ball's mesh will have, to some 10 %, and the memory for them [bytes].

        Zeros for a disc, which is meshed in no time.
        """
        if not isinstance(self.spec, BallSpec):
            return 0, 0, 0.0
        cells, order = expected_cells(self.spec), self.scene.mesh.order
        unknowns = int(float(f"{3 * NODES[order] * cells:.2g}"))
        return int(float(f"{cells:.2g}")), unknowns, room.needed_bytes(unknowns, order, unknowns >= LARGE)

    def refuse_what_is_too_large(self, comm: MPI.Comm) -> None:
        """Refuse a mesh whose unknowns surely have no room, before it takes minutes to make. Collective.

        Raises:
            MemoryError: on every rank, with what would fit.
        """
        _, unknowns, needed = self.expected_size()
        if unknowns >= LARGE:
            room.refuse_without(needed, unknowns, comm, SURELY)

    @property
    def force_scale(self) -> float:
        """What residuals are measured by [Pa µm or pN]: the weight modelled, or a stiffness if there is none."""
        soft = min(map(self.scene.layer_young_Pa, LAYER_NAMES))
        return abs(self.weight) / self.scene.copies or 1e-3 * soft

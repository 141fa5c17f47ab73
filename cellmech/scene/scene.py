"""A scene: an immutable tree of validated inputs whose attribute names are the TOML keys."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from cellmech.scene.inputs import Inputs
from cellmech.scene.parts import IN_SPACE, Mesh
from cellmech.scene.rules import breaches
from cellmech.scene.sizes import outer_radii
from cellmech.scene.substrate import crowded, smallest_shape
from cellmech.scene.value_types import broken

AT_REST = 20.0  # relaxation times after which the fluid's stress is below the Newton tolerance


class Scene(Inputs):
    """One cell on one substrate under one load: everything a run needs to know.

    `Scene()` is Table 1. A scene that exists keeps every rule: building one that does not raises pydantic's
    ValidationError, which `files.read_scene` turns into an InputError.
    """

    @model_validator(mode="after")
    def _radii_of_sizes(self) -> Self:
        for name, value in outer_radii(self).items():
            object.__setattr__(self, name, value)
        return self

    @model_validator(mode="after")
    def _array_instead_of_table_1s_pillar(self) -> Self:
        if self.array is not None and "pillar" not in self.model_fields_set:
            object.__setattr__(self, "pillar", ())
        return self

    @model_validator(mode="after")
    def _round_in_space(self) -> Self:
        if self.cell.geometry == "3d":
            pillars = (pillar.model_copy(update={"profile": pillar.profile or "round"}) for pillar in self.pillar)
            object.__setattr__(self, "pillar", tuple(pillars))
            if self.array is not None and self.array.profile is None:
                object.__setattr__(self, "array", self.array.model_copy(update={"profile": "round"}))
        return self

    @model_validator(mode="before")
    @classmethod
    def _mesh_of_space(cls, data: object) -> object:
        """The sizes of tetrahedra, where none are written."""
        if not (isinstance(data, dict) and isinstance(data.get("cell"), dict) and data["cell"].get("geometry") == "3d"):
            return data
        mesh = data.get("mesh", {})
        return {**data, "mesh": {**IN_SPACE.get(mesh.get("order", 3), {}), **mesh}} if isinstance(mesh, dict) else data

    @model_validator(mode="after")
    def _shape_of_the_symmetry(self) -> Self:
        if self.cell.geometry == "3d" and "shape" not in self.cell.model_fields_set and not crowded(self):
            object.__setattr__(self, "cell", self.cell.model_copy(update={"shape": smallest_shape(self)}))
        return self

    @model_validator(mode="after")
    def _order_that_serves(self) -> Self:
        """Second order where third would not do and the scene names none.

        Second order has a mixed form. And a fluid without solid shears without resistance, in which elements of third
        order turn inside out. Tetrahedra have no mixed form.
        """
        mesh, written = self.mesh, self.mesh.model_fields_set
        mixed = mesh.pressure == "mixed" or (mesh.pressure == "auto" and self.nearly_incompressible())
        mixed = mixed and self.cell.geometry != "3d"
        if "order" not in written and (mixed or self.without_solid()):
            second = Mesh.model_validate({"order": 2} | {name: getattr(mesh, name) for name in written})
            object.__setattr__(self, "mesh", second)
        return self

    @model_validator(mode="after")
    def _history_where_it_matters(self) -> Self:
        if self.time.history == "auto":
            whole = self.cell.inertia or self.rest_s <= AT_REST * self.relaxation_s
            object.__setattr__(self, "time", self.time.model_copy(update={"history": whole}))
        return self

    @model_validator(mode="after")
    def _keeps_the_rules(self) -> Self:
        breach = next(breaches(self), None)
        if breach is not None:
            raise broken(breach.rule, breach.hint, key=breach.key, got=breach.got)
        return self

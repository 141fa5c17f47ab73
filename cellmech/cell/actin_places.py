"""Where contractile actin lies in a cell, as its scene says."""

from __future__ import annotations

from cellmech.scene.driver_parts import Actin
from cellmech.scene.scene import Scene

CAP_UM = 0.1  # of the cell's radius: thickness of a cap
# By `where`: angles from the top, direction.
PLACES = {
    "cap": ((0.0, 60.0), "tangential"),
    "basal": ((120.0, 180.0), "radial"),
    "cortex": ((0.0, 180.0), "tangential"),
    "sector": ((0.0, 180.0), "tangential"),
}


def radii_of(scene: Scene, actin: Actin) -> tuple[float, float]:
    """Radii between which it lies [µm]: a cap and a basal pull in the cytosol, a cortex in the membrane."""
    nucleus, rim, radius = scene.nucleus_radius_um, scene.inner_radius_um("membrane"), scene.radius_um
    places = {"cap": (nucleus, min(nucleus + CAP_UM * radius, rim)), "basal": (nucleus, rim), "cortex": (rim, radius)}
    return actin.radii_um or places.get(actin.where, (0.0, radius))


def bounds_of(scene: Scene) -> list[float]:
    """All such radii [µm], rising: the mesh has an interface at each."""
    return sorted({radius for _, one in scene.drivers if isinstance(one, Actin) for radius in radii_of(scene, one)})


def pulls_all_round(scene: Scene) -> bool:
    """True if actin reaches the nucleus above its middle, where else its outline needs no small elements."""
    nucleus = scene.nucleus_radius_um
    for _, one in scene.drivers:
        if isinstance(one, Actin):
            (inner, outer), (first, _) = radii_of(scene, one), one.angles_deg or PLACES[one.where][0]
            if inner <= nucleus <= outer and first < 90.0:
                return True
    return False

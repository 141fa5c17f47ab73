"""The text of a first scene of one's own: a cell on pillars, every key with its unit and what it means."""

from __future__ import annotations

_CELL = """\
# A cell that settles on micropillars. What is not written here has the value of docs/scene.md.
# Lengths are in µm, moduli and stresses in Pa (1 kPa is 1000 Pa), times in s.
title = "{title}"

[cell]
geometry = "{geometry}"{about}
law = "neo-hookean"            # of the solid: or saint-venant, mooney-rivlin, yeoh
density_kg_m3 = 1050.0         # kg/m3, of the cell
medium_density_kg_m3 = 1000.0  # kg/m3, of what it is in: only the difference weighs

[layer.membrane]               # four layers, from the outside in; radii are from the cell's centre
outer_radius_um = 10.0         # µm, the cell's radius
young_Pa = 100.0               # Pa, Young's modulus
[layer.cytosol]
outer_radius_um = 9.5          # µm: the membrane is 0.5 µm thick
young_Pa = 10.0                # Pa
[layer.lamina]
outer_radius_um = 7.5          # µm, the radius of the nucleus
young_Pa = 1000.0              # Pa
[layer.nucleoplasm]
outer_radius_um = 7.4          # µm: the lamina is 0.1 µm thick
young_Pa = 10.0                # Pa

"""
_PLANE = """\
[array]                        # endless ridges, seen from their end; the cell comes to rest on them
pitch_um = 8.0                 # µm, from middle to middle
width_um = 4.0                 # µm, the whole width at the foot
height_um = 5.0                # µm, from foot to top
exponent = 4                   # how square: 2 is an ellipse, 20 nearly a box
offset_um = [4.0, 0.0]         # µm, from a pillar's middle to the cell's: half a pitch is between two

"""
_ROUND = """\
[[pillar]]                     # one round pillar, on the axis; one beside it would be a ring
width_um = 6.0                 # µm, its whole width at the foot
height_um = 5.0                # µm, from foot to top
exponent = 4                   # how square: 2 is an ellipsoid, 20 nearly a cylinder

"""
_SPACE = """\
[array]                        # a lattice of pillars; the cell comes to rest on them
lattice = "square"             # or hexagonal
pitch_um = 8.0                 # µm, from middle to middle
width_um = 4.0                 # µm, the whole width at the foot
height_um = 5.0                # µm, from foot to top
profile = "round"              # from above: or square, ridge
exponent = 4                   # how square in side view: 2 is an ellipsoid, 20 nearly a cylinder
offset_um = [4.0, 4.0]         # µm, along x and z, from a pillar's middle to the cell's: between four of them

"""
_HARD = """\
[contact]
penalty_Pa_per_um = 200.0      # Pa/µm: how hard the pillars are; the cell sinks into them the less

"""
_DRIVEN = """\
[load]
half_ramp_s = 5000.0           # s: the weight is whole after twice this time

[adhesion]                     # the weight of a cell in medium deforms next to nothing: adhesion does
work_uJ_m2 = 3.0               # µJ/m2 (1 µJ/m2 is 1 Pa µm)
range_um = 0.5                 # µm, the gap across which it pulls
half_ramp_s = 5000.0           # s, likewise

[medium]
viscosity_Pa_s = 100.0         # Pa s: water has 0.001; this much steadies a cell that jumps into contact

[time]
end_s = 18000.0                # s
"""
_SPUN = """\
[load]
factor = 50.0                  # times its weight, as in a centrifuge at 50 g: that in medium deforms next to nothing

[time]
history = false                # the end state alone; docs/scene.md has adhesion and actin, which take longer

[mesh]                         # coarse, for a first look; without this table it takes ten times as long
order = 2
size_um = 5.0                  # µm
"""
# By geometry: what is said of it, and what the cell stands on and is driven by.
_PARTS = {
    "plane": (
        "             # a section through a cylinder on endless ridges; or axisymmetric, 3d",
        _PLANE + _HARD + _DRIVEN,
    ),
    "axisymmetric": ("      # a ball on a round pillar; or plane, 3d", _ROUND + _HARD + _DRIVEN),
    "3d": ("                # a ball on pillars; or plane, axisymmetric", _SPACE + _HARD + _SPUN),
}
GEOMETRIES = tuple(_PARTS)


def starter(geometry: str) -> str:
    """A scene file of that geometry, one of `GEOMETRIES`, with comments; it is valid and has no warnings."""
    about, rest = _PARTS[geometry]
    return _CELL.format(title="A cell on my pillars", geometry=geometry, about=about) + rest

"""What a cell stands on, as triangles for ParaView."""

import numpy as np
import pytest
from mpi4py import MPI

from cellmech.results.records import CaseFolder
from cellmech.results.result import read_grid
from cellmech.results.substrate_file import substrate_triangles, write_substrate
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import standing

SCENES = {
    "plane": {},
    "plane, array": {"pillar": [], "array": {"offset_um": [5.0, 0.0]}},
    "axisymmetric": {"cell": {"geometry": "axisymmetric"}},
    "round": {"cell": {"geometry": "3d"}},
    "ridges": {"cell": {"geometry": "3d"}, "pillar": [], "array": {"profile": "ridge", "height_um": 5.0}},
    "square": {"cell": {"geometry": "3d"}, "pillar": [], "array": {"profile": "square", "exponent": 5.0}},
}


@pytest.mark.parametrize("name", SCENES)
def test_triangles_lie_on_their_obstacles_and_cover_them(name):
    scene = Scene.model_validate(SCENES[name])
    found = substrate_triangles(scene)
    flat = found.pop(0)
    in_space = scene.cell.geometry == "3d"
    assert flat[..., 1].max() == scene.flat.y_um
    assert np.ptp(flat[..., 0]) == pytest.approx(6 * scene.radius_um)
    assert np.ptp(flat[..., 2]) == (pytest.approx(6 * scene.radius_um) if in_space else 0.0)
    assert len(found) == len(standing(scene)) > 0
    for one, corners in zip(standing(scene), found.values(), strict=True):
        arch, (x, y, z) = one.arch, np.moveaxis(corners, -1, 0)
        on = np.abs(arch.level_set(corners.reshape(-1, 3).T)) < 1e-9
        foot = (y == arch.y_um).ravel()
        assert (on | foot).all() and on.sum() > 100
        assert y.max() == pytest.approx(arch.y_um + arch.height_um, abs=1e-12) and y.min() == arch.y_um
        assert (x.min(), x.max()) == pytest.approx((arch.x_um - arch.half_width_um, arch.x_um + arch.half_width_um))
        if in_space and name != "ridges":
            assert (z.min(), z.max()) == pytest.approx((arch.z_um - arch.half_width_um, arch.z_um + arch.half_width_um))


def test_file_has_each_obstacle_and_is_left_out_where_there_is_none(tmp_path):
    for name, tables, obstacles in (
        ("both", {}, {0, 1}),
        ("none", {"pillar": [], "flat": False, "cell": {"inertia": True}}, None),
    ):
        folder = CaseFolder(tmp_path / name, MPI.COMM_SELF)
        write_substrate(folder, Scene.model_validate(tables))
        folder.close()
        path = tmp_path / name / "substrate.vtu"
        assert path.exists() == (obstacles is not None)
        if obstacles is not None:
            grid = read_grid(path)
            assert set(np.asarray(grid.cell_data["obstacle"]).tolist()) == obstacles
            assert not np.asarray(grid.point_data["displacement_um"]).any()

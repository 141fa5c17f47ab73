"""Field files as VTK reads them."""

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from cellmech.results.result import modelled, read_grid
from cellmech.results.vtu import packed, write_vtu


@pytest.mark.parametrize("ends", [(40,), (13, 13, 40)], ids=["one piece", "three, one of them empty"])
@pytest.mark.parametrize(("n_nodes", "kind"), [(3, 5), (6, 22)])
def test_written_field_file_is_read_back_to_the_last_bit(n_nodes, kind, ends, tmp_path):
    random = np.random.default_rng(1)
    position = random.normal(size=(40, n_nodes, 2))
    data = {"displacement_um": random.normal(size=(40, n_nodes, 2)), "J1": random.normal(size=(40, n_nodes))}
    layer = np.arange(40, dtype=np.int32) % 4
    parts = [slice(start, end) for start, end in zip((0, *ends), ends, strict=False)]
    ready = [
        packed(position[part], {name: values[part] for name, values in data.items()}, {"layer": layer[part]})
        for part in parts
    ]
    blocks = [block for _, own in ready for block in own]
    write_vtu(tmp_path / "fields.vtu", [piece for piece, _ in ready], blocks, ("beyond_ellipticity",))
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "fields.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetFieldData().GetArray("beyond_ellipticity").GetValue(0) == 1
    assert {grid.GetCellType(k) for k in range(grid.GetNumberOfCells())} == {kind}
    points, cell = vtk_to_numpy(grid.GetPoints().GetData()), grid.GetCell(39).GetPointIds()
    assert [cell.GetId(k) for k in range(n_nodes)] == list(range(39 * n_nodes, 40 * n_nodes))
    assert np.array_equal(points[:, :2].reshape(40, n_nodes, 2), position)
    assert not points[:, 2].any()
    fields = {name: vtk_to_numpy(grid.GetPointData().GetArray(name)) for name in ("displacement_um", "J1")}
    assert np.array_equal(fields["displacement_um"][:, :2].reshape(40, n_nodes, 2), data["displacement_um"])
    assert np.array_equal(fields["J1"].reshape(40, n_nodes), data["J1"])
    assert np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("layer")), layer)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(("dim", "n_nodes", "mirrors"), [(2, 3, "x"), (2, 6, "x"), (3, 4, "xz"), (3, 10, "xz")])
def test_images_have_mirrored_places_and_vectors_and_the_sense_of_what_they_show(
    dim, n_nodes, mirrors, ranks, tmp_path
):
    corners = np.random.default_rng(2).normal(size=(6, dim + 1, dim))
    negative = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    corners[negative] = corners[negative][:, [1, 0, *range(2, dim + 1)]]
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)][: n_nodes - dim - 1]
    nodes = np.concatenate([corners, *[corners[:, pair].mean(axis=1, keepdims=True) for pair in pairs]], axis=1)
    fields = {"displacement_um": 0.1 * nodes, "J1": nodes[..., 0] + 5 * nodes[..., 1]}
    layer = np.arange(6, dtype=np.int32) % 4
    ready = [
        packed(nodes[mine], {name: values[mine] for name, values in fields.items()}, {"layer": layer[mine]}, mirrors)
        for mine in np.array_split(np.arange(6), ranks)
    ]
    blocks = [block for _, own in ready for block in own]
    write_vtu(tmp_path / "fields.vtu", [piece for piece, _ in ready], blocks)
    grid = read_grid(tmp_path / "fields.vtu")
    image, (cells,) = np.asarray(grid.cell_data["image"]), grid.cells_dict.values()
    points = np.asarray(grid.points)
    np.testing.assert_allclose(grid.point_data["displacement_um"], 0.1 * points, rtol=0, atol=1e-15)
    for number, signs in enumerate([[1, 1, 1], [-1, 1, 1], [1, 1, -1], [-1, 1, -1]][: 2 ** len(mirrors)]):
        mine = cells[image == number]
        shown = points[mine] * signs
        centroids = nodes.mean(axis=1)
        np.testing.assert_allclose(shown.mean(axis=1)[:, :dim], centroids, rtol=0, atol=1e-15)
        np.testing.assert_allclose(
            np.asarray(grid.point_data["J1"])[mine], shown[..., 0] + 5 * shown[..., 1], rtol=0, atol=1e-14
        )
        edges = points[mine][:, 1 : dim + 1, :dim] - points[mine][:, :1, :dim]
        assert (np.linalg.det(edges) > 0).all()
        middles = [points[mine][:, pair].mean(axis=1) for pair in pairs]
        for at, middle in enumerate(middles, dim + 1):
            np.testing.assert_allclose(points[mine][:, at], middle, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(np.asarray(grid.cell_data["layer"])[image == number], layer)
    computed = modelled(grid)
    assert computed.n_cells == 6 and not np.asarray(computed.cell_data["image"]).any()

"""Field files as VTK reads them."""

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from cellmech.results.field_files import packed, write_vtu


@pytest.mark.parametrize("ends", [(40,), (13, 13, 40)], ids=["one piece", "three, one of them empty"])
@pytest.mark.parametrize(("n_nodes", "kind"), [(3, 5), (6, 22)])
def test_written_field_file_is_read_back_to_the_last_bit(n_nodes, kind, ends, tmp_path):
    random = np.random.default_rng(1)
    data = {
        "position": random.normal(size=(40, n_nodes, 2)),
        "displacement_um": random.normal(size=(40, n_nodes, 2)),
        "J1": random.normal(size=(40, n_nodes)),
        "layer": np.arange(40, dtype=np.int32) % 4,
    }
    parts = [slice(start, end) for start, end in zip((0, *ends), ends, strict=False)]
    ready = [packed({name: values[part] for name, values in data.items()}) for part in parts]
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
    assert np.array_equal(points[:, :2].reshape(40, n_nodes, 2), data["position"])
    assert not points[:, 2].any()
    fields = {name: vtk_to_numpy(grid.GetPointData().GetArray(name)) for name in ("displacement_um", "J1")}
    assert np.array_equal(fields["displacement_um"][:, :2].reshape(40, n_nodes, 2), data["displacement_um"])
    assert np.array_equal(fields["J1"].reshape(40, n_nodes), data["J1"])
    assert np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("layer")), data["layer"])

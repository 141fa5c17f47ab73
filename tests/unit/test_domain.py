import math
import tempfile

import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import create_unit_square
from mpi4py import MPI

from cellmech.errors import MeshError
from cellmech.fem.domain import build_domain, from_gmsh, mesh_quality
from cellmech.fem.jit import compile_form
from cellmech.mesh.disc import DiscSpec
from cellmech.mesh.elements import jacobian_coefficients
from cellmech.mesh.geometry import build_disc, build_ring

COMM = MPI.COMM_SELF
COARSE = DiscSpec(size_um=1.5)
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [0.0, 0.5], [0.5, 0.0]])


@pytest.fixture(scope="module")
def domain():
    return build_domain(DiscSpec(), COMM)


def integral(domain, measure) -> float:
    return fem.assemble_scalar(compile_form(fem.Constant(domain.mesh, 1.0) * measure, domain.mesh.comm))


def test_measures_cover_the_named_groups(domain):
    half = math.pi / 2
    assert integral(domain, domain.dx(2)) == pytest.approx(half * 100, rel=1e-6)
    assert integral(domain, domain.dx(2, "lamina")) == pytest.approx(half * (25 - 4.9**2), rel=1e-6)
    assert integral(domain, domain.dx(2, ("lamina", "nucleoplasm"))) == pytest.approx(half * 25, rel=1e-6)
    assert integral(domain, domain.ds(4)) == pytest.approx(half * 20 + 20, rel=1e-6)
    assert integral(domain, domain.ds(4, ("outer",))) == pytest.approx(half * 20, rel=1e-6)
    assert integral(domain, domain.ds(2, ("axis",))) == pytest.approx(20.0, rel=1e-12)
    assert integral(domain, domain.ds(2, ("nucleus_outline",))) == 0.0
    assert integral(domain, domain.dS(4, ("nucleus_outline",))) == pytest.approx(half * 10, rel=1e-6)


def test_measure_carries_its_quadrature_degree(domain):
    assert domain.dx(7, ("lamina",)).metadata() == {"quadrature_degree": 7}


def test_unknown_group_is_a_mesh_error_that_names_the_known_ones(domain):
    with pytest.raises(MeshError, match=r"no group 'skin' for ds; it has outer, nucleus_outline, axis"):
        domain.ds(2, ("outer", "skin"))


def test_quality_counts_elements_and_bounds_their_shape(domain):
    q = domain.quality
    assert q["cells"] == sum(q[f"cells_{name}"] for name in domain.cells) == len(domain.cell_tags.values)
    assert 0.85 < q["min_scaled_jacobian"] < 1.0
    assert 0.1 < q["min_shape_quality"] < q["mean_shape_quality"] < 1.0
    assert q["mean_shape_quality"] > 0.8
    assert 0.05 < q["min_edge_um"] <= 0.1 + 1e-9  # across the lamina, or along the rim at the contact edge
    assert 0.9 < q["max_edge_um"] < 2.0
    assert 4 < q["max_aspect_ratio"] < 15  # of the lamina at the top


def test_quality_of_a_right_triangle_is_the_textbook_one():
    q = mesh_quality(create_unit_square(COMM, 1, 1))
    root = math.sqrt(2.0)
    inscribed, circumscribed = 1 / (2 + root), root / 2
    assert q["min_shape_quality"] == pytest.approx(2 * inscribed / circumscribed, rel=1e-14)
    assert q["max_aspect_ratio"] == pytest.approx(root / (root / 2), rel=1e-14)
    assert (q["min_edge_um"], q["max_edge_um"], q["min_scaled_jacobian"], q["cells"]) == (1.0, root, 1.0, 2.0)


def determinant(points: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Of second-order triangles (cells, 6, 2) at reference points, shape (points, cells)."""
    z, o = 1 - x - y, np.zeros_like(x)
    by_x = np.array([1 - 4 * z, 4 * x - 1, o, 4 * y, -4 * y, 4 * (z - x)])
    by_y = np.array([1 - 4 * z, o, 4 * y - 1, 4 * x, 4 * (z - y), -4 * x])
    tx, ty = np.einsum("np,cnd->pcd", by_x, points), np.einsum("np,cnd->pcd", by_y, points)
    return tx[..., 0] * ty[..., 1] - tx[..., 1] * ty[..., 0]


def test_jacobian_coefficients_are_those_of_the_bernstein_basis():
    rng = np.random.default_rng(1)
    points = SQUARE + 0.1 * rng.standard_normal((50, 6, 2))
    x, y = rng.dirichlet([1, 1, 1], 200)[:, :2].T
    z = 1 - x - y
    bernstein = np.array([z**2, x**2, y**2, 2 * x * y, 2 * y * z, 2 * x * z])
    np.testing.assert_allclose(bernstein.T @ jacobian_coefficients(points).T, determinant(points, x, y), atol=1e-13)


def test_jacobian_coefficients_see_an_inversion_between_the_nodes():
    points = SQUARE.copy()
    points[4:] = [[-0.5, 0.5], [0.3, 0.4]]
    assert determinant(points[None], *SQUARE.T).min() == pytest.approx(0.2)
    assert determinant(points[None], np.linspace(0, 1, 21), np.zeros(21)).min() < -0.1
    assert jacobian_coefficients(points[None]).min() < -0.1


@pytest.mark.parametrize("order", [1, 2])
def test_inverted_element_is_a_mesh_error_with_number_and_place(order):
    with build_disc(DiscSpec(size_um=1.5, order=order)) as model:
        tags, x, _ = model.mesh.getNodes()
        x = x.reshape(-1, 3)
        inside = np.linalg.norm(x - [2.0, 9.0, 0.0], axis=1).argmin()
        model.mesh.setNode(int(tags[inside]), [4.0, 9.0, 0.0], [])
        with pytest.raises(
            MeshError, match=r"not positive all over \d+ of \d+ elements, centred at \([\d.]+, [\d.]+\)"
        ):
            from_gmsh(model, COMM)


def test_inverted_mid_node_is_a_mesh_error():
    with build_disc(COARSE) as model:
        triangles = model.mesh.getElementsByType(9)[1].reshape(-1, 6)
        a, b, c, m = triangles[0, [0, 1, 2, 3]]
        corners = [np.array(model.mesh.getNode(int(tag))[0]) for tag in (a, b, c)]
        model.mesh.setNode(int(m), 0.3 * (corners[0] + corners[1]) / 2 + 0.7 * corners[2], [])
        with pytest.raises(MeshError, match=r"not positive all over [1-9]"):
            from_gmsh(model, COMM)


def test_nameless_group_is_a_mesh_error():
    with build_disc(COARSE) as model:
        model.removePhysicalName("lamina")
        with pytest.raises(MeshError, match="needs a name"):
            from_gmsh(model, COMM)


def test_model_without_groups_is_a_mesh_error():
    with build_disc(COARSE) as model:
        model.removePhysicalGroups()
        with pytest.raises(MeshError, match="no physical group of surfaces"):
            from_gmsh(model, COMM)


def test_what_is_no_fault_of_the_mesh_is_no_mesh_error(monkeypatch, tmp_path):
    """Neither a refusal of the disk nor a bug is a physical result; here with no mesh kept from before."""
    monkeypatch.setattr("cellmech.mesh.store.kept", lambda spec: None)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    with pytest.raises(FileNotFoundError, match="gone"):
        build_domain(COARSE, COMM)
    monkeypatch.undo()
    monkeypatch.setattr("cellmech.mesh.store.kept", lambda spec: None)
    monkeypatch.setattr("cellmech.mesh.geometry.disc_sectors", lambda spec: 1 / 0)
    with pytest.raises(RuntimeError, match=r"^ZeroDivisionError: division by zero$"):
        build_domain(COARSE, COMM)


def test_full_disc_has_no_axis_but_twice_the_area():
    full = build_domain(DiscSpec("full"), COMM)
    assert set(full.facets) == {"outer", "nucleus_outline"}
    assert list(full.cells) == ["nucleoplasm", "lamina", "cytosol", "membrane"]
    assert integral(full, full.dx(2)) == pytest.approx(math.pi * 100, rel=1e-6)
    assert integral(full, full.dS(4, ("nucleus_outline",))) == pytest.approx(math.pi * 10, rel=1e-6)


def test_ring_becomes_a_domain():
    with build_ring(1.0, (("ring", 2.0),), size_um=0.2) as model:
        ring = from_gmsh(model, COMM)
    assert set(ring.facets) == {"inner", "outer", "axis_x", "axis_y"}
    assert integral(ring, ring.dx(2)) == pytest.approx(math.pi * 3 / 4, rel=1e-5)
    assert integral(ring, ring.ds(2, ("axis_y",))) == pytest.approx(1.0, rel=1e-12)

"""The mesh of a ball: sizes of its layers, groups, symmetry, curved elements that are valid."""

import math
import signal
from dataclasses import replace

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from cellmech.errors import InputError, MeshError
from cellmech.fem import domain as domains
from cellmech.fem.domain import build_domain, from_gmsh
from cellmech.fem.jit import compile_form
from cellmech.mesh import ball_mesh
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.ball_mesh import build_ball, shells_of
from cellmech.mesh.elements import jacobian_coefficients, shape_measures
from cellmech.mesh.sizes import Zone

COMM = MPI.COMM_SELF
COARSE = BallSpec(size_um=5.0)
PARTS = {"quarter": 4, "half": 2, "full": 1}
RADII = {"nucleoplasm": (0.0, 4.9), "lamina": (4.9, 5.0), "cytosol": (5.0, 9.5), "membrane": (9.5, 10.0)}
TO_DOLFINX = [0, 1, 2, 3, 8, 9, 5, 7, 6, 4]  # Gmsh numbers the edges 01, 12, 20, 30, 32, 31
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
ENDS = ((2, 3), (1, 3), (1, 2), (0, 3), (0, 2), (0, 1))  # of a tetrahedron's edges in DOLFINx's order
STRAIGHT = np.concatenate([CORNERS, [(CORNERS[a] + CORNERS[b]) / 2 for a, b in ENDS]])


@pytest.fixture(scope="module")
def coarse():
    return build_domain(COARSE, COMM)


def integral(domain, measure) -> float:
    return fem.assemble_scalar(compile_form(fem.Constant(domain.mesh, 1.0) * measure, domain.mesh.comm))


def volumes(spec: BallSpec) -> dict[str, float]:
    """Of the layers of the whole ball [µm³], exactly: a Jacobian's mean is that of its coefficients."""
    model, found = build_ball(spec), {}
    x = model.getNodes()[1].reshape(-1, 3)
    for dim, tag in model.getPhysicalGroups(3):
        nodes = model.getElements(dim, tag)[2][0].reshape(-1, 10)[:, TO_DOLFINX] - 1
        found[model.getPhysicalName(dim, tag)] = jacobian_coefficients(x[nodes]).mean(axis=1).sum() / 6
    return {name: PARTS[spec.shape] * volume for name, volume in found.items()}


def ball(inner: float, outer: float) -> float:
    return 4 / 3 * math.pi * (outer**3 - inner**3)


def test_measures_cover_the_named_groups(coarse):
    assert list(coarse.cells) == list(RADII)
    assert set(coarse.facets) == {"outer", "nucleus_outline", "symmetry x", "symmetry z"}
    assert 4 * integral(coarse, coarse.dx(3, "lamina")) == pytest.approx(ball(4.9, 5.0), rel=3e-4)
    assert integral(coarse, coarse.ds(4, "outer")) == pytest.approx(100 * math.pi, rel=1e-4)
    assert integral(coarse, coarse.ds(4, "symmetry x")) == pytest.approx(50 * math.pi, rel=1e-5)
    assert integral(coarse, coarse.ds(4, "symmetry z")) == pytest.approx(50 * math.pi, rel=1e-5)
    assert integral(coarse, coarse.ds(4)) == pytest.approx(200 * math.pi, rel=1e-4)
    assert integral(coarse, coarse.dS(4, "nucleus_outline")) == pytest.approx(25 * math.pi, rel=3e-4)


@pytest.mark.parametrize(("shape", "planes"), [("half", {"symmetry x"}), ("full", set())])
def test_larger_shapes_have_the_layers_of_the_quarter(shape, planes):
    domain = build_domain(replace(COARSE, shape=shape), COMM)
    assert set(domain.facets) == {"outer", "nucleus_outline", *planes}
    found, known = volumes(replace(COARSE, shape=shape)), volumes(COARSE)
    assert found == pytest.approx(known, rel=1e-13)
    assert domain.quality["min_scaled_jacobian"] > 0.3


def test_volumes_converge_as_second_order_geometry_does(ladder):
    one, other = (volumes(BallSpec(size_um=size, zones=())) for size in (4.0, 2.0))
    errors = [[abs(found[name] / ball(*RADII[name]) - 1) for name in RADII] for found in (one, other)]
    orders = np.log2(np.array(errors[0]) / np.array(errors[1]))
    whole = sum(other.values())
    ladder("volume of a ball of curved tetrahedra [µm³]", ours=whole, reference=ball(0.0, 10.0), rel=3e-5)
    assert np.all((orders[[0, 1, 3]] > 3.0) & (orders[[0, 1, 3]] < 5.0))
    assert max(errors[1]) < 1e-4


def test_layers_have_as_many_elements_across_as_asked():
    assert [shell.tolist() for shell in shells_of(COARSE)] == [[4.9, 5.0], [9.5, 10.0]]
    two = replace(COARSE, thin_layers=2)
    assert np.concatenate(shells_of(two)) == pytest.approx([4.9, 4.95, 5.0, 9.5, 9.75, 10.0], rel=1e-15)
    once, twice = (build_domain(spec, COMM).quality for spec in (COARSE, two))
    for name, times in (("nucleoplasm", 1), ("lamina", 2), ("cytosol", 1), ("membrane", 2)):
        assert twice[f"cells_{name}"] == times * once[f"cells_{name}"]
    assert volumes(two) == pytest.approx(volumes(COARSE), rel=1e-12)


def test_layer_thicker_than_its_elements_is_not_extruded():
    fine = BallSpec(interfaces=(("core", 2.0), ("shell", 4.0), ("skin", 4.1)), nucleus_radius_um=2.0, size_um=1.0)
    assert [shell.tolist() for shell in shells_of(fine)] == [[2.0], [4.0, 4.1]]


def test_any_number_of_layers_can_be_stacked():
    names = [f"cytosol {k}" for k in range(1, 7)]
    rings = tuple((name, 5.1 + 0.1 * k) for k, name in enumerate(names))
    spec = BallSpec(interfaces=(("nucleus", 5.0), *rings, ("cytoplasm", 10.0)), size_um=5.0, nucleus_radius_um=5.0)
    found = volumes(spec)
    assert list(found) == ["nucleus", *names, "cytoplasm"]
    for name, outer in rings:
        assert found[name] == pytest.approx(ball(outer - 0.1, outer), rel=3e-4)


def test_thick_layers_keep_their_shape_beside_wide_stacks():
    """Stretched over what the stacks leave, their tetrahedra would be inverted."""
    radii = (0.34, 0.55, 0.815, 0.835, 1.12, 1.55, 1.73, 2.0)
    layers = tuple((f"ring {k}", radius) for k, radius in enumerate(radii))
    spec = BallSpec(interfaces=layers, nucleus_radius_um=0.815, size_um=0.5, zones=())
    assert [len(shell) for shell in shells_of(spec)] == [2, 2, 1, 2, 1]
    assert build_domain(spec, COMM).quality["min_scaled_jacobian"] > 0.1


def test_nodes_of_interfaces_and_of_planes_lie_on_them_exactly():
    model = build_ball(BallSpec(centre=(3.0, 9.5, -1.0), size_um=5.0))
    x = model.getNodes()[1].reshape(-1, 3) - [3.0, 9.5, -1.0]
    for dim, tag in model.getPhysicalGroups(2):
        nodes = x[np.unique(model.getElements(dim, tag)[2][0]) - 1]
        name = model.getPhysicalName(dim, tag)
        if name.startswith("symmetry"):
            assert np.all(nodes[:, "xyz".index(name[-1])] == 0.0)
        else:
            radius = {"outer": 10.0, "nucleus_outline": 5.0}[name]
            assert np.abs(np.linalg.norm(nodes, axis=1) - radius).max() < 1e-14 * radius


@pytest.mark.parametrize("shape", ["half", "full"])
def test_whole_mesh_is_its_own_mirror_image(shape):
    x = build_ball(BallSpec(shape, centre=(0.0, 0.0, 0.0), size_um=5.0)).getNodes()[1].reshape(-1, 3)
    known = {tuple(point) for point in (x + 0.0).tolist()}
    for axis in {"half": (2,), "full": (0, 2)}[shape]:
        image = x.copy()
        image[:, axis] *= -1.0
        assert {tuple(point) for point in (image + 0.0).tolist()} == known


def test_poles_of_the_nucleus_are_nodes():
    x = build_ball(COARSE).getNodes()[1].reshape(-1, 3)
    for pole in (-5.0, 5.0, -10.0, 10.0):
        assert np.abs(x - [0.0, 9.5 + pole, 0.0]).max(axis=1).min() < 1e-14


def test_tetrahedra_share_their_faces():
    """Each face belongs to two elements, or to one on the boundary, whose faces are known."""
    model = build_ball(replace(COARSE, thin_layers=2))
    groups = {model.getPhysicalName(*group): model.getElements(*group)[2][0] for group in model.getPhysicalGroups()}
    cells = np.concatenate([groups[name].reshape(-1, 10)[:, :4] for name in RADII])
    sides = np.sort(np.concatenate([np.delete(cells, k, axis=1) for k in range(4)]), axis=1)
    faces, counts = np.unique(sides, axis=0, return_counts=True)
    named = [groups[name].reshape(-1, 6)[:, :3] for name in ("outer", "symmetry x", "symmetry z")]
    assert counts.max() == 2
    assert np.array_equal(faces[counts == 1], np.unique(np.sort(np.concatenate(named), axis=1), axis=0))


def test_same_specification_gives_the_same_mesh():
    one, other = build_ball(COARSE), build_ball(COARSE)
    assert np.array_equal(one.getNodes()[1], other.getNodes()[1])
    for group in one.getPhysicalGroups():
        assert np.array_equal(one.getElements(*group)[2][0], other.getElements(*group)[2][0])


def test_kept_ball_is_the_one_that_was_made(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made = build_domain(COARSE, COMM)
    monkeypatch.setattr(domains, "build_ball", lambda spec: 1 / 0)
    kept = build_domain(COARSE, COMM)
    assert np.array_equal(made.mesh.geometry.x, kept.mesh.geometry.x)
    assert (made.cells, made.facets, made.quality) == (kept.cells, kept.facets, kept.quality)


def test_elements_are_small_where_contact_begins():
    at = (7.0, 9.5 - math.sqrt(100 - 49 - 4), 2.0)
    model = build_ball(BallSpec(size_um=5.0, zones=(Zone(at, 0.3, 1.0),)))
    x = model.getNodes()[1].reshape(-1, 3)
    (outer,) = (tag for dim, tag in model.getPhysicalGroups(2) if model.getPhysicalName(dim, tag) == "outer")
    triangles = model.getElements(2, outer)[2][0].reshape(-1, 6)[:, :3] - 1
    edges = np.linalg.norm(x[triangles] - x[np.roll(triangles, 1, axis=1)], axis=2).mean(axis=1)
    away = np.linalg.norm(x[triangles].mean(axis=1) - at, axis=1)
    assert 0.2 < edges[away < 1.0].mean() < 0.4
    assert edges[away > 8.0].mean() > 1.0


def test_straight_elements_have_straight_edges():
    domain = build_domain(BallSpec(size_um=5.0, order=1), COMM)
    assert domain.mesh.geometry.x.shape[0] == domain.mesh.topology.index_map(0).size_global
    assert domain.quality["min_scaled_jacobian"] == 1.0


def test_quality_counts_elements_and_bounds_their_shape(coarse):
    q = coarse.quality
    assert q["cells"] == sum(q[f"cells_{name}"] for name in coarse.cells) == len(coarse.cell_tags.values)
    assert 0.3 < q["min_scaled_jacobian"] < 1.0
    assert 0.05 < q["min_shape_quality"] < q["mean_shape_quality"] < 1.0
    assert q["min_edge_um"] == pytest.approx(0.1, rel=1e-12)
    assert q["max_aspect_ratio"] > 10  # of the lamina


def test_shape_of_a_regular_and_of_a_corner_tetrahedron_is_the_textbook_one():
    regular = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    shape, aspect, edges = shape_measures(np.stack([regular, CORNERS]))
    root = math.sqrt(3.0)
    assert shape == pytest.approx([1.0, 3 / (3 + root) / (root / 2)], rel=1e-14)
    assert aspect == pytest.approx([math.sqrt(1.5), math.sqrt(2.0) * root], rel=1e-14)
    assert sorted(edges[1]) == pytest.approx([1.0] * 3 + [math.sqrt(2.0)] * 3, rel=1e-14)


def determinant(points: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Of a second-order tetrahedron (10, 3) at barycentric coordinates (n, 4), by its definition."""
    found = []
    for bary in at:
        by_lambda = np.zeros((10, 4))
        by_lambda[range(4), range(4)] = 4 * bary - 1
        for node, (a, b) in enumerate(ENDS, 4):
            by_lambda[node, [a, b]] = 4 * bary[b], 4 * bary[a]
        gradient = (by_lambda[:, 1:] - by_lambda[:, :1]).T @ points
        found.append(np.linalg.det(gradient))
    return np.array(found)


def test_jacobian_coefficients_are_those_of_the_bernstein_basis():
    rng = np.random.default_rng(1)
    points = STRAIGHT + 0.1 * rng.standard_normal((5, 10, 3))
    at = rng.dirichlet([1, 1, 1, 1], 40)
    powers = [(i, j, k) for i in range(4) for j in range(i, 4) for k in range(j, 4)]
    bernstein = np.empty((len(at), 20))
    for column, corners in enumerate(powers):
        counts = [corners.count(c) for c in range(4)]
        bernstein[:, column] = 6 / math.prod(map(math.factorial, counts)) * np.prod(at ** np.array(counts), axis=1)
    for tetrahedron, coefficients in zip(points, jacobian_coefficients(points), strict=True):
        np.testing.assert_allclose(bernstein @ coefficients, determinant(tetrahedron, at), atol=1e-13)


def test_jacobian_coefficients_see_an_inversion_between_the_nodes():
    points = STRAIGHT.copy()
    points[[8, 9]] = [[-0.5, 0.5, 0.0], [0.3, 0.4, 0.0]]
    bary = np.concatenate([np.eye(4), [(np.eye(4)[a] + np.eye(4)[b]) / 2 for a, b in ENDS]])
    assert determinant(points, bary).min() > 0.15
    along = np.linspace(0, 1, 21)[:, None]
    assert determinant(points, along * np.eye(4)[0] + (1 - along) * np.eye(4)[1]).min() < -0.05
    assert jacobian_coefficients(points[None]).min() < -0.05


def test_nodes_keep_their_places_in_dolfinx(coarse):
    points, known = domains.fenicsx.cell_points(coarse.mesh), volumes(COARSE)
    by_cell = 4 * jacobian_coefficients(points).mean(axis=1) / 6
    for name, number in coarse.cells.items():
        assert by_cell[coarse.cell_tags.find(number)].sum() == pytest.approx(known[name], rel=1e-12)


def test_inverted_element_is_a_mesh_error_with_number_and_place():
    model = build_ball(COARSE)
    x = model._arrays["x"].reshape(-1, 3)
    inside = np.linalg.norm(x - [2.0, 9.0, 2.0], axis=1).argmin()
    x[inside] = [5.0, 9.0, 5.0]
    with pytest.raises(MeshError, match=r"not positive all over \d+ of \d+ elements, centred at \([\d.]+, [\d.]+, "):
        from_gmsh(model, COMM)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"shape": "eighth"}, 'shape: must be "quarter", "half" or "full"; got \'eighth\''),
        ({"interfaces": (("a", 2.0), ("b", 1.0))}, "interfaces: radii must grow"),
        ({"interfaces": (("", 2.0),)}, "interfaces: every layer needs a name"),
        ({"nucleus_radius_um": 10.0}, "nucleus_radius_um: must lie between"),
        ({"size_um": 0.0}, "size_um: must be positive"),
        ({"order": 3}, "order: must be 1 or 2"),
        ({"thin_layers": 0}, "thin_layers: must be an integer"),
        ({"zones": (Zone((0.0, -0.5)),)}, "zones: a zone must lie at x, y, z"),
        ({"zones": (Zone((0.0, 9.5, 0.0)),)}, "zones: a zone must lie at x, y, z apart from the centre"),
        ({"zones": (Zone((0.0, -0.5, 0.0), -1.0),)}, "zones: sizes and radii must be positive"),
    ],
)
def test_bad_specification_gets_one_message(change, said):
    with pytest.raises(InputError) as caught:
        BallSpec(**change)
    assert str(caught.value).startswith(f"BallSpec: {said}")


def test_failure_of_gmsh_is_a_mesh_error(monkeypatch):
    monkeypatch.setattr(ball_mesh, "shells_of", lambda spec: [np.array([radius]) for radius in (9.5, 4.9, 9.9)])
    with pytest.raises(MeshError, match="Gmsh could not mesh the geometry"):
        build_ball(COARSE)


def test_meshing_a_ball_leaves_ctrl_c_alone():
    handler = signal.getsignal(signal.SIGINT)
    build_ball(COARSE)
    assert signal.getsignal(signal.SIGINT) is handler

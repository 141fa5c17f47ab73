import math
import signal
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cellmech.errors import InputError, MeshError
from cellmech.mesh.disc import DiscSpec
from cellmech.mesh.disc_script import disc_script
from cellmech.mesh.elements import jacobian_coefficients
from cellmech.mesh.geometry import build_disc, build_ring, write_reference_geometries

MESHES = Path(__file__).parents[2] / "meshes"
TO_DOLFINX = [0, 1, 2, 4, 5, 3]  # Gmsh numbers the edges 01, 12, 20
MERGED = DiscSpec(interfaces=(("nucleus", 5.0), ("cytoplasm", 10.0)), touch=())
SPECS = {
    "half": DiscSpec(),
    "full": DiscSpec("full"),
    "off centre": DiscSpec("full", centre=(3.0, 9.5), touch=((-2.0, 0.9), (7.0, 0.3))),
    "two across": DiscSpec(thin_layers=2),
    "coarse": DiscSpec(size_um=2.0),
    "merged": MERGED,
    "nucleus inside a layer": DiscSpec(interfaces=(("cell", 10.0),)),
    "membrane unstructured": DiscSpec(size_um=0.3),
}


@dataclass
class Nodes:
    """What Gmsh holds: node coordinates, and per group the nodes of its elements."""

    x: np.ndarray
    triangles: dict[str, np.ndarray]
    edges: dict[str, np.ndarray]

    def jacobian(self, name: str) -> np.ndarray:
        return jacobian_coefficients(self.x[self.triangles[name][:, TO_DOLFINX]])

    def area(self, name: str) -> float:
        return self.jacobian(name).mean(axis=1).sum() / 2

    def length(self, name: str) -> float:
        a, b, m = np.moveaxis(self.x[self.edges[name]], 1, 0)
        points, weights = np.polynomial.legendre.leggauss(5)
        speeds = [np.linalg.norm((b - a) / 2 + s * (a + b - 2 * m), axis=1) for s in points]
        return float((weights @ np.array(speeds)).sum())


def nodes_of(model) -> Nodes:
    tags, x, _ = model.mesh.getNodes()
    assert sorted(tags) == list(range(1, len(tags) + 1))
    found = Nodes(x.reshape(-1, 3)[np.argsort(tags), :2], {}, {})
    for dim, number in model.getPhysicalGroups():
        rows = []
        for entity in model.getEntitiesForPhysicalGroup(dim, number):
            (kind,), _, (nodes,) = model.mesh.getElements(dim, entity)
            assert kind == {1: 8, 2: 9}[dim]
            rows.append(nodes.reshape(-1, 3 * dim).astype(int) - 1)
        groups = found.edges if dim == 1 else found.triangles
        groups[model.getPhysicalName(dim, number)] = np.concatenate(rows)
    return found


@pytest.fixture(scope="module", params=SPECS)
def built(request):
    spec = SPECS[request.param]
    with build_disc(spec) as model:
        return spec, nodes_of(model)


@pytest.fixture(scope="module")
def half():
    with build_disc(DiscSpec()) as model:
        return nodes_of(model)


def part(spec: DiscSpec) -> float:
    return 1.0 if spec.shape == "full" else 0.5


def test_areas_of_layers_are_those_of_annuli(built):
    spec, nodes = built
    assert list(nodes.triangles) == [name for name, _ in spec.interfaces]
    inner = 0.0
    for name, outer in spec.interfaces:
        exact = part(spec) * math.pi * (outer**2 - inner**2)
        # The quadratic arc's error goes like the fourth power of the angle it spans.
        assert nodes.area(name) == pytest.approx(exact, rel=1e-6 if spec.size_um <= 0.6 else 1e-4)
        inner = outer


def test_lengths_of_circles_and_axis_are_exact(built):
    spec, nodes = built
    rel = 1e-6 if spec.size_um <= 0.6 else 1e-4
    assert nodes.length("outer") == pytest.approx(part(spec) * 2 * math.pi * 10, rel=rel)
    assert nodes.length("nucleus_outline") == pytest.approx(part(spec) * 2 * math.pi * 5, rel=rel)
    assert set(nodes.edges) == {"outer", "nucleus_outline"} | ({"axis"} if spec.shape == "half" else set())
    if spec.shape == "half":
        assert nodes.length("axis") == pytest.approx(20.0, rel=1e-14)
        assert np.all(nodes.x[nodes.edges["axis"], 0] == spec.centre[0])


def test_every_node_of_a_circle_lies_on_it(built):
    spec, nodes = built
    for name, radius in (("outer", 10.0), ("nucleus_outline", 5.0)):
        r = np.linalg.norm(nodes.x[nodes.edges[name]] - spec.centre, axis=-1)
        np.testing.assert_allclose(r, radius, rtol=0, atol=1e-13)


def test_jacobians_are_positive_all_over(built):
    _, nodes = built
    for name in nodes.triangles:
        assert nodes.jacobian(name).min() > 0


def test_every_interface_has_a_vertex_at_its_bottom_and_top(built):
    spec, nodes = built
    vertices = cKDTree(nodes.x[np.unique(np.concatenate(list(nodes.triangles.values()))[:, :3])])
    x, y = spec.centre
    for radius in (5.0, *(radius for _, radius in spec.interfaces)):
        distance, _ = vertices.query([[x, y - radius], [x, y + radius]])
        assert distance.max() < 1e-13


@pytest.mark.parametrize("across", [1, 2, 3])
def test_thin_layers_have_edges_on_concentric_circles(across):
    with build_disc(DiscSpec(thin_layers=across)) as model:
        nodes = nodes_of(model)
    triangles = nodes.triangles["lamina"]
    r = np.linalg.norm(nodes.x[triangles] - DiscSpec().centre, axis=-1)
    layers = 4.9 + 0.1 * np.arange(2 * across + 1) / (2 * across)
    assert np.abs(r[..., None] - layers).min(axis=-1).max() < 1e-11
    assert set(np.abs(np.unique(r.round(9))[:, None] - layers).argmin(axis=1)) == set(range(2 * across + 1))
    # Straight inner edges would give 0.28 with one element across and inverted elements with two.
    jacobian = nodes.jacobian("lamina")
    assert (jacobian.min(axis=1) / jacobian.max(axis=1)).min() > 0.9


def test_lamina_takes_few_elements(half):
    """One across; elements as long as they are thick would be 310."""
    assert len(half.triangles["lamina"]) < 150
    longest = np.linalg.norm(np.ptp(half.x[half.triangles["lamina"][:, :3]], axis=1), axis=1)
    assert longest.max() > 2 * 0.1


def test_table_1_has_fewer_than_1250_elements_most_of_them_below_the_centre(half):
    centres = np.concatenate([half.x[rows[:, :3]].mean(axis=1) for rows in half.triangles.values()])
    assert 1150 < len(centres) < 1250
    below = centres[:, 1] < 9.5
    assert 0.65 < below.mean() < 0.9


def test_elements_follow_the_sizes_asked_for():
    spec = DiscSpec(size_um=0.6, contact_size_um=0.1, outline_size_um=0.1)
    with build_disc(spec) as model:
        nodes = nodes_of(model)

    def mean_edge(group: str, low: float, high: float) -> float:
        a, b = np.moveaxis(nodes.x[nodes.edges[group][:, :2]], 1, 0)
        y = (a + b)[:, 1] / 2
        return float(np.linalg.norm(b - a, axis=1)[(low < y) & (y < high)].mean())

    assert mean_edge("outer", -0.2, -0.05) == pytest.approx(0.1, rel=0.1)  # at the contact edge
    assert mean_edge("outer", -0.5, -0.45) == pytest.approx(0.12, rel=0.1)  # within it, as all along the rim
    assert mean_edge("outer", 12.0, 19.5) == pytest.approx(0.12, rel=0.1)
    assert mean_edge("nucleus_outline", 4.5, 4.7) == pytest.approx(0.1, rel=0.2)
    edges = np.concatenate(list(nodes.triangles.values()))[:, [[0, 1], [1, 2], [2, 0]]]
    lengths = np.linalg.norm(np.diff(nodes.x[edges], axis=2), axis=-1)
    assert lengths.max() < 1.6 * 0.9


def test_full_mesh_is_its_own_mirror_image_and_contains_the_half_mesh(half):
    with build_disc(DiscSpec("full")) as model:
        full = nodes_of(model)
    distance, image = cKDTree(full.x).query(full.x * [-1, 1])
    assert distance.max() < 1e-12
    cells = np.concatenate(list(full.triangles.values()))
    assert {frozenset(cell) for cell in cells} == {frozenset(cell) for cell in image[cells]}
    distance, _ = cKDTree(full.x).query(half.x)
    assert distance.max() < 1e-12
    assert len(cells) == 2 * sum(len(rows) for rows in half.triangles.values())


def test_same_specification_gives_the_same_mesh_in_another_process(half):
    code = (
        "import signal, sys, numpy as np\n"
        "from cellmech.mesh.geometry import DiscSpec, build_disc\n"
        "with build_disc(DiscSpec()) as model:\n"
        "    tags, x, _ = model.mesh.getNodes()\n"
        "    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler  # Gmsh's import resets it\n"
        "    sys.stdout.buffer.write(x.reshape(-1, 3)[np.argsort(tags), :2].tobytes())\n"
    )
    out = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        check=True,
        cwd=MESHES.parent,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # this process may ignore it
    )
    assert out.stderr == b""
    np.testing.assert_array_equal(np.frombuffer(out.stdout).reshape(-1, 2), half.x)


def test_gmsh_prints_nothing_and_leaves_ctrl_c_alone(capfd):
    handler = signal.getsignal(signal.SIGINT)
    with build_disc(MERGED):
        assert signal.getsignal(signal.SIGINT) is handler
    assert signal.getsignal(signal.SIGINT) is handler
    assert capfd.readouterr() == ("", "")


def test_first_order_mesh_has_straight_triangles():
    with build_disc(DiscSpec("full", order=1)) as model:
        kinds = {int(kind) for dim, tag in model.getEntities() for kind in model.mesh.getElements(dim, tag)[0]}
    assert kinds == {1, 2}


def test_failure_of_gmsh_is_a_mesh_error(monkeypatch):
    monkeypatch.setattr("cellmech.mesh.geo_script.GeoScript.text", lambda self: "Plane Surface(1) = {7};")
    with pytest.raises(MeshError, match="Gmsh could not mesh"), build_disc(DiscSpec()):
        pass


def test_ring_has_exact_area_and_named_sides():
    with build_ring(1.0, (("inside", 1.1), ("outside", 2.0)), size_um=0.2) as model:
        nodes = nodes_of(model)
    assert nodes.area("inside") == pytest.approx(math.pi / 4 * (1.1**2 - 1), rel=1e-5)
    assert nodes.area("outside") == pytest.approx(math.pi / 4 * (4 - 1.1**2), rel=1e-5)
    assert nodes.length("inner") == pytest.approx(math.pi / 2, rel=1e-5)
    assert nodes.length("outer") == pytest.approx(math.pi, rel=1e-5)
    assert np.all(nodes.x[nodes.edges["axis_x"], 1] == 0) and np.all(nodes.x[nodes.edges["axis_y"], 0] == 0)
    assert len(nodes.triangles["inside"]) < 60  # structured
    assert min(nodes.jacobian(name).min() for name in nodes.triangles) > 0


def test_reference_geometries_are_up_to_date(tmp_path):
    for written in write_reference_geometries(tmp_path):
        assert (MESHES / written.name).read_text() == written.read_text()


@pytest.mark.parametrize("shape", ["half", "full"])
def test_reference_geometry_opened_in_gmsh_is_the_mesh_we_compute_on(shape, tmp_path):
    spec = DiscSpec(shape)
    path = tmp_path / "disc.geo"
    path.write_text(disc_script(spec))
    with build_disc(spec) as model:
        ours = nodes_of(model)
        import gmsh

        gmsh.open(str(path))
        gmsh.model.mesh.generate(2)
        viewed = nodes_of(gmsh.model)
    for name in ours.triangles:
        corners, seen = (np.unique(n.triangles[name][:, :3]) for n in (ours, viewed))
        if (shape, name) == (
            "full",
            "nucleoplasm",
        ):  # meshed in another order there: Gmsh may place some points elsewhere
            assert len(seen) == pytest.approx(len(corners), rel=0.02)
            continue
        distance, _ = cKDTree(viewed.x[seen]).query(ours.x[corners])
        assert len(corners) == len(seen)
        assert distance.max() < 1e-6


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"shape": "quarter"}, "shape"),
        ({"interfaces": ()}, "interfaces"),
        ({"interfaces": (("a", 5.0), ("b", 5.0))}, "interfaces"),
        ({"interfaces": (("a", -5.0), ("b", 5.0))}, "interfaces"),
        ({"interfaces": (("", 10.0),)}, "interfaces"),
        ({"interfaces": (('say "a"', 10.0),)}, "interfaces"),
        ({"nucleus_radius_um": 10.0}, "nucleus_radius_um"),
        ({"size_um": 0.0}, "size_um"),
        ({"size_um": math.nan}, "size_um"),
        ({"contact_size_um": 0.0}, "contact_size_um"),
        ({"outline_size_um": -1.0}, "outline_size_um"),
        ({"contact_zone_um": -1.0}, "contact_zone_um"),
        ({"order": 3}, "order"),
        ({"thin_layers": 0}, "thin_layers"),
    ],
)
def test_specification_that_breaks_a_rule_is_refused(change, key):
    with pytest.raises(InputError) as caught:
        replace(DiscSpec(), **change)
    assert caught.value.key == key

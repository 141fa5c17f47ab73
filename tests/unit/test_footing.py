"""How wide contacts are expected to be, that the mesh follows them, and that a case says where it does not."""

import math

import numpy as np
import pytest
from mpi4py import MPI

import cellmech
from cellmech.cell.description import describe_model
from cellmech.cell.footing import Profile, feet, half_width
from cellmech.cell.layering import mesh_plan
from cellmech.cell.setup import Setup
from cellmech.fem.outline import Outline
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Pillar
from cellmech.runs.progress import results_table
from cellmech.scene.files import read_scene
from cellmech.solver import resolution
from cellmech.solver.resolution import doubts, missed, missed_pull

DISC = Pillar(0.0, 0.0, 10.0, 10.0, 2.0)
ON_THE_FLAT = Profile(DISC, None, 0.0, 1, 1.0)
PUSH = Contact("surface", 50.0, 1e-4).pressure_at


def scene_of(**tables):
    return read_scene({"time": {"history": False}, **tables}, "test")


def setup_of(**tables):
    scene = scene_of(**tables)
    return Setup(scene, MPI.COMM_SELF, mesh_plan(scene))


def narrow(half_width_um, **keys):
    return {"half_width_um": half_width_um, **keys}


@pytest.mark.parametrize("load", [1e-3, 1e-1])
def test_half_width_is_that_of_hertz_on_a_stiff_penalty(load):
    """a^2 = 4 P R/(pi E*), for half-widths of a hundredth and a tenth of the radius."""
    found = half_width(load, ON_THE_FLAT, 6.0, lambda d: 1e9 * max(d, 0.0), 10.0)
    assert found == pytest.approx(math.sqrt(4 * load * 10.0 / (math.pi * 6.0)), rel=0.01)


def test_half_width_of_a_light_load_is_the_penalty_s():
    """p = kappa d on the parabola x^2/2R bears P = 2 kappa a^3/3R."""
    found = half_width(1e-9, ON_THE_FLAT, 6.0, lambda d: 50.0 * max(d, 0.0), 10.0)
    assert found == pytest.approx((1.5 * 1e-9 * 10.0 / 50.0) ** (1 / 3), rel=0.01)


def test_scale_at_the_edge_of_a_box_is_much_less_than_its_width():
    (round_top,) = feet(scene_of(pillar=[narrow(1.0, exponent=2)]), 3.0, PUSH)
    (box,) = feet(scene_of(pillar=[narrow(1.0, exponent=50)]), 3.0, PUSH)
    assert round_top.scale_um == pytest.approx(np.mean(round_top.edges), rel=0.5)
    assert 0.9 < box.edges[0] < box.edges[1] < 1.0 and box.scale_um < 0.03


@pytest.mark.parametrize(
    "tables", [{}, {"load": {"factor": 2.0}}, {"pillar": [narrow(7.0)]}, {"mesh": {"size_um": 6.0}}]
)
def test_mesh_of_wide_contacts_stays_as_it_is(tables):
    assert setup_of(**tables).spec.footprints == ()


@pytest.mark.parametrize(
    ("tables", "wide"),
    [
        ({"pillar": [narrow(0.25)]}, 0.16),
        ({"pillar": [narrow(1.0, exponent=50)]}, 0.977),
        ({"load": {"factor": 1e-6}}, 0.0215),
        ({"pillar": [narrow(0.25), narrow(0.25, x_um=1.0, height_um=9.4)]}, 0.16),
        ({"cell": {"shape": "full"}, "pillar": [narrow(0.25)]}, 0.16),
        ({"pillar": [narrow(0.25)], "mesh": {"order": 2}}, 0.16),
    ],
)
def test_mesh_follows_a_contact_that_is_narrower_than_its_zones(tables, wide):
    """Edges of the outline where the solved contact ends: five or more in a half-width."""
    setup = setup_of(**tables)
    nodes = Outline(setup.domain, setup.body.space, "outer").reference[:, :2]
    at = nodes.mean(axis=1)
    near = np.abs(np.hypot(*(at - [0.0, setup.centre[1] - 10.0]).T) - wide) < 0.15 * wide
    assert np.linalg.norm(np.diff(nodes, axis=1), axis=-1)[near].max() < wide / 4


def test_pillar_touched_after_the_first_has_a_fine_mesh_too():
    """Beside the first and lower by 0.05 µm: its image in the left half needs none."""
    pillars = [narrow(0.3), narrow(0.3, x_um=1.5, height_um=9.5 - 1.5**2 / 20 - 0.05)]
    spec = setup_of(pillar=pillars).spec
    assert [foot.at[0] for foot in spec.footprints] == pytest.approx([0.0, 1.5], abs=0.1)
    far = [narrow(0.3), narrow(0.3, x_um=1.5, height_um=4.0)]
    assert len(setup_of(pillar=far).spec.footprints) == 1


def test_depth_on_a_narrow_pillar_is_the_converged_one():
    """0.3935 µm on meshes of 19,592 and 53,846 unknowns; 0.4027 where the mesh did not follow."""
    result = cellmech.solve(scene_of(pillar=[narrow(0.25)]))
    assert result.number("contact.max_depth_um") == pytest.approx(0.3935, rel=2e-3)
    assert result.result["model"]["warnings"].keys() == {"penalty"}


def test_contact_that_the_mesh_has_missed_is_told_of(monkeypatch):
    """In the log, in the result, in the table."""
    monkeypatch.setattr("cellmech.cell.meshing.follow", lambda spec, *others: spec)
    result = cellmech.solve(scene_of(title="missed", pillar=[narrow(0.25)]))
    text = result.result["model"]["warnings"]["contact mesh"]
    assert text.startswith("the mesh is too coarse for 1 of 1 contacts: 0.")
    assert f"warning: contact mesh: {text}" in (result.folder / "run.log").read_text()
    assert f"case in doubt: contact mesh: {text}" in results_table(["case"], [result.result]).splitlines()


def test_contact_that_the_mesh_has_resolved_is_not_doubted():
    assert cellmech.solve(scene_of()).result["model"]["warnings"] == {}
    assert results_table(["case"], [cellmech.solve(scene_of()).result]).count("\n") == 1


def test_coarse_mesh_is_told_of_before_it_is_solved():
    tables = {"mesh": {"size_um": 6.0}}
    assert "2.5 times the 2.4 um" in describe_model(setup_of(**tables)).warnings["mesh"]
    assert "mesh" not in describe_model(setup_of()).warnings


def test_contact_too_narrow_for_any_mesh_is_told_of_before_it_is_solved():
    light = {"load": {"factor": 1e-12}, "contact": {"penalty_Pa_per_um": 1e9, "smoothing_um": 1e-9}}
    assert "are not made smaller than" in describe_model(setup_of(**light)).warnings["contact mesh"]


def test_force_between_the_solvers_points_is_measured_and_told_of(monkeypatch):
    """Two points an edge see little of a narrow contact; thirty see all of it, on the same mesh."""

    def settled(degree):
        contact = {"quadrature_degree": degree, "penalty_Pa_per_um": 5e5}
        setup = setup_of(contact=contact, time={"history": False}, mesh={"size_um": 6.0}, load={"factor": 1e-3})
        run = setup.create_run(lambda line: None)
        run.run(lambda step: None)
        return run

    poor, good = settled(2), settled(30)
    assert missed(good) < 1e-3 and missed(poor) > 0.1
    monkeypatch.setattr(resolution, "stretches", lambda run, axis: [])  # edges enough
    assert "% of its force lie between the points" in doubts(poor, 0.0)["contact mesh"]
    assert "contact mesh" not in doubts(good, 0.0)


def test_pull_between_the_solvers_points_is_told_of():
    """Two points an edge as long as the range see what part of the pull they happen to; thirty see all of it."""

    def stuck(degree):
        tables = {"contact": {"quadrature_degree": degree}, "adhesion": {"work_uJ_m2": 0.2, "range_um": 0.1}}
        setup = setup_of(time={"history": False}, mesh={"size_um": 6.0}, **tables)
        run = setup.create_run(lambda line: None)
        run.run(lambda step: None)
        return missed_pull(run), doubts(run, 0.0)

    (poor, told), (good, untold) = stuck(2), stuck(30)
    assert poor > 0.05 and "% of its pull lie between the points" in told["adhesion mesh"]
    assert good < 1e-3 and "adhesion mesh" not in untold


def test_force_of_the_volume_form_between_the_points_is_told_of(monkeypatch):
    """A band much thinner than an element is felt at few of its points."""

    def share(**contact):
        contact = {"form": "volume", "volume_width_um": 0.02} | contact
        setup = setup_of(contact=contact, time={"history": False}, mesh={"size_um": 6.0}, load={"factor": 0.01})
        run = setup.create_run(lambda line: None)
        run.run(lambda step: None)
        return missed(run), doubts(run, 0.0)

    monkeypatch.setattr(resolution, "stretches", lambda run, axis: [])  # edges enough
    (poor, told), (good, untold) = share(), share(volume_width_um=0.5)
    assert poor > 0.02 and "% of its force lie between the points" in told["contact mesh"]
    assert good < 0.02 and "contact mesh" not in untold


def test_edge_of_a_box_that_may_lie_anywhere_does_not_fill_the_mesh():
    """A stiff cell between two boxes: elements of a nanometre all along were 50,000 triangles, and minutes of Gmsh."""
    box = {"y_um": -10.0, "height_um": 9.5, "half_width_um": 1.77, "exponent": 20.0}
    tables = {"layer": {"cytosol": {"young_Pa": 5e9}}, "load": {"factor": 21.6}, "mesh": {"order": 2, "size_um": 3.0}}
    setup = setup_of(pillar=[box | {"x_um": 4.0}], time={"history": False}, **tables)
    (foot,) = setup.spec.footprints
    assert foot.least_um == pytest.approx((foot.edges[1] - foot.edges[0]) / 400, rel=1e-12)
    assert setup.number_of_cells < 15_000
    assert "are not made smaller than" in describe_model(setup).warnings["contact mesh"]


def test_mirror_image_of_a_pillar_is_not_told_to_be_left_out():
    """Half a cell meets its own pillar only; the other half meets the image."""
    model = describe_model(setup_of(pillar=[{"x_um": 7.0, "half_width_um": 3.0}]))
    assert model.modelled["pillar 0 mirrored"].startswith("meets the mirrored half")
    assert not [label for label in model.left_out if "pillar" in label]
    far = describe_model(setup_of(pillar=[{"x_um": 50.0, "half_width_um": 3.0}]))
    assert {"pillar 0", "pillar 0 mirrored"} < far.left_out.keys()

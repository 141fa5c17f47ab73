"""Meshes that are kept: the same to the last bit, made anew where they are damaged, few."""

import os
import subprocess
import sys

import numpy as np
import pytest
from mpi4py import MPI

from cellmech.fem import domain
from cellmech.mesh import geometry, store
from cellmech.mesh.disc import DiscSpec

COARSE = DiscSpec(size_um=6.0)


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def never(spec):
    """In the place of Gmsh."""
    raise AssertionError("meshed again")


@pytest.mark.parametrize("shape", ["half", "full"])
@pytest.mark.parametrize("order", [1, 2])
def test_kept_mesh_is_the_one_that_was_made(shape, order, monkeypatch):
    spec = DiscSpec(shape, size_um=6.0, order=order)
    made = domain.build_domain(spec, MPI.COMM_SELF)
    monkeypatch.setattr(domain, "build_disc", never)
    kept = domain.build_domain(spec, MPI.COMM_SELF)
    assert np.array_equal(made.mesh.geometry.x, kept.mesh.geometry.x)
    for tags in ("cell_tags", "facet_tags"):
        one, other = getattr(made, tags), getattr(kept, tags)
        assert np.array_equal(one.indices, other.indices)
        assert np.array_equal(one.values, other.values)
    assert (made.cells, made.facets, made.quality) == (kept.cells, kept.facets, kept.quality)


def test_kept_mesh_is_of_its_specification_only(monkeypatch):
    domain.build_domain(COARSE, MPI.COMM_SELF)
    monkeypatch.setattr(domain, "build_disc", never)
    with pytest.raises(RuntimeError, match="meshed again"):
        domain.build_domain(DiscSpec(size_um=6.1), MPI.COMM_SELF)


@pytest.mark.parametrize("keep", [lambda whole: whole[:-1], lambda whole: b"", lambda whole: whole[:40] + b"?" * 4])
def test_damaged_mesh_is_made_anew(keep, tmp_path):
    made = domain.build_domain(COARSE, MPI.COMM_SELF)
    (file,) = (tmp_path / "cellmech" / "meshes").iterdir()
    whole = file.read_bytes()
    file.write_bytes(keep(whole))
    assert store.kept(COARSE) is None
    again = domain.build_domain(COARSE, MPI.COMM_SELF)
    assert np.array_equal(made.mesh.geometry.x, again.mesh.geometry.x)
    assert store.kept(COARSE) is not None


def test_disk_that_refuses_a_mesh_costs_only_time(tmp_path):
    (tmp_path / "cellmech").mkdir()
    (tmp_path / "cellmech" / "meshes").write_text("a file where the folder should be")
    with geometry.build_disc(COARSE) as model:
        store.keep(COARSE, model)
    assert store.kept(COARSE) is None


def test_oldest_meshes_are_dropped(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "MOST", 2)
    specs = [DiscSpec(size_um=6.0 + k) for k in range(3)]
    for k, spec in enumerate(specs):
        domain.build_domain(spec, MPI.COMM_SELF)
        for file in (tmp_path / "cellmech" / "meshes").iterdir():
            os.utime(file, ns=(file.stat().st_mtime_ns - 10**9 * (3 - k),) * 2)
    assert [store.kept(spec) is not None for spec in specs] == [False, True, True]


def test_kept_mesh_needs_no_gmsh():
    domain.build_domain(COARSE, MPI.COMM_SELF)
    code = (
        "import sys; from mpi4py import MPI\n"
        "from cellmech.fem.domain import build_domain; from cellmech.mesh.disc import DiscSpec\n"
        "build_domain(DiscSpec(size_um=6.0), MPI.COMM_SELF); assert 'gmsh' not in sys.modules\n"
        "build_domain(DiscSpec(size_um=6.5), MPI.COMM_SELF); assert hasattr(sys.modules['gmsh'], 'lib')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

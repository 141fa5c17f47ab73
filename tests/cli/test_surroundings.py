"""Variables, files and streams of others: the same numbers, or one line that names the cause."""

import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from cli.programs import ENVIRONMENT, PATIENCE_S

SCENE = "[mesh]\nsize_um = 5.0\n[time]\nhistory = false\n"
OUT = Path("out/s/result.json")
STUDY = (sys.executable, "-m", "cellmech.study")
STEP = {"SLURM_STEP_ID": "0", "SLURM_STEPID": "0", "SLURM_JOBID": "134", "SLURM_JOB_ID": "134"}
STEP |= {"SLURM_NODELIST": "node1", "SLURM_NTASKS": "4", "SLURM_PROCID": "0", "SLURM_NNODES": "1"}
ALONE = {name: value for name, value in ENVIRONMENT.items() if not name.startswith(("OMPI_COMM", "PMIX", "SLURM"))}


def call(*command, closed=(), **variables):
    """Run a command with more variables and with some of the streams 0, 1, 2 closed."""
    redirected = " ".join(f"{number}>&-" if number else "<&-" for number in closed)
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    shell = ["sh", "-c", f'exec "$@" {redirected}', "sh", *command]
    return subprocess.run(shell, env=ALONE | variables, timeout=PATIENCE_S, check=False, **pipes)


def numbers():
    """What a solved case says, without what differs from run to run."""
    result = json.loads(OUT.read_text(encoding="utf-8"))
    assert result["status"] == "solved", result["reason"]
    return {key: result[key] for key in ("nucleus", "contact", "energy", "dofs")}


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """The numbers of an undisturbed run."""
    here = os.getcwd()
    os.chdir(tmp_path_factory.mktemp("right"))
    try:
        Path("s.toml").write_text(SCENE)
        done = call(*STUDY, "s.toml", "--out", "out", "--quiet")
        assert done.returncode == 0, done.stderr
        return numbers()
    finally:
        os.chdir(here)


@pytest.fixture
def scene(folder):
    Path("s.toml").write_text(SCENE)
    return folder


def test_numbers_are_the_same_in_a_shell_of_srun(scene, right):
    done = call(*STUDY, "s.toml", "--out", "out", "--quiet", **STEP)
    assert (done.returncode, done.stderr) == (0, "")
    assert numbers() == right


@pytest.mark.parametrize("arguments", [["--help"], ["s.toml", "--list"], ["bad.toml", "--check"]])
def test_what_needs_no_mpi_starts_none(scene, arguments):
    Path("bad.toml").write_text("[cell]\npoisson = 0.5")
    code = "import sys; from cellmech.study import main; status = main(); print('mpi4py.MPI' in sys.modules, status)"
    done = call(sys.executable, "-c", code, *arguments, **STEP)
    assert done.stdout.splitlines()[-1] == f"False {2 if '--check' in arguments else 0}"


def test_processes_of_srun_that_cannot_find_each_other_are_refused_by_one_of_them(scene):
    said = [call(*STUDY, "s.toml", "--out", "out", **STEP | {"SLURM_PROCID": "2"})]
    Path("slurmstepd").symlink_to("/bin/sh")  # whose children srun has started
    said.append(call("./slurmstepd", "-c", '"$@"; exit $?', "sh", *STUDY, "s.toml", "--out", "out", **STEP))
    assert [one.returncode for one in said] == [2, 2]
    assert said[0].stderr == ""
    assert said[1].stderr.count("\n") == 1 and "srun --mpi=pmix" in said[1].stderr
    assert not OUT.exists()


@pytest.mark.parametrize("closed", [(1,), (0, 1), (0, 1, 2)], ids=["out", "in and out", "all"])
def test_numbers_are_the_same_with_streams_closed(scene, right, closed):
    done = call(*STUDY, "s.toml", "--out", "out", closed=closed)
    assert (done.returncode, done.stderr) == (0, "")
    assert numbers() == right


@pytest.mark.parametrize(
    "variables",
    [
        {"PETSC_OPTIONS": "-cellmech_pc_type none -cellmech_ksp_type gmres -log_view -fp_trap -mat_type baij"},
        {"OMPI_MCA_btl": "bogus", "OMPI_MCA_pml": "ucx", "TMPDIR": "/proc"},
        {"_PYTHON_SYSCONFIGDATA_NAME": "_sysconfigdata_x86_64_conda_cos6_linux_gnu"},
        {"LC_ALL": "C", "PYTHONOPTIMIZE": "2", "PYTHONWARNINGS": "error"},
    ],
    ids=lambda variables: next(iter(variables)),
)
def test_numbers_are_the_same_whatever_variables_say(scene, right, variables):
    done = call(*STUDY, "s.toml", "--out", "out", "--quiet", **variables)
    assert (done.returncode, len(done.stdout.splitlines()), done.stderr) == (0, 1, "")
    assert numbers() == right


def test_numbers_are_the_same_whatever_files_say(scene, right):
    Path(".petscrc").write_text("-cellmech_pc_type none\n-log_view\n")
    for name in ("dolfinx_jit_parameters", "dolfinx_jit_options", "ffcx_parameters", "ffcx_options"):
        Path(f"{name}.json").write_text("no JSON")
    done = call(*STUDY, "s.toml", "--out", "out", "--quiet")
    assert (done.returncode, len(done.stdout.splitlines()), done.stderr) == (0, 1, "")
    assert numbers() == right


def test_options_of_others_are_kept_from_a_case_and_are_theirs_again(scene, right):
    code = (
        "import petsc4py; petsc4py.init(['-cellmech_pc_type', 'none']); from petsc4py import PETSc; import cellmech; "
    )
    code += "cellmech.solve('s.toml', 'out/s'); print(PETSc.Options().getString('cellmech_pc_type'))"
    done = call(sys.executable, "-c", code)
    assert (done.returncode, done.stdout, done.stderr) == (0, "none\n", "")
    assert numbers() == right


@pytest.mark.parametrize("inside", [False, True], ids=["solved", "imported too"])
def test_numbers_are_the_same_in_another_thread(scene, right, inside):
    code = "import threading\n" + ("" if inside else "import cellmech; cellmech.solve\n")
    code += "def go():\n    import cellmech\n    cellmech.solve('s.toml', 'out/s')\n"
    code += "thread = threading.Thread(target=go)\nthread.start()\nthread.join()\n"
    done = call(sys.executable, "-c", code)
    assert done.stderr == ""
    assert numbers() == right


@pytest.mark.parametrize("how", ["sys.stdout = sys.stderr = None", "sys.stdout.close()"])
def test_library_needs_no_standard_output(scene, right, how):
    done = call(sys.executable, "-c", f"import sys; {how}; import cellmech; cellmech.solve('s.toml', 'out/s')")
    assert (done.returncode, done.stderr) == (0, "")
    assert numbers() == right


def test_limit_on_memory_that_leaves_no_room_is_named(scene):
    """OpenBLAS asks for its own again and again, for ever."""
    done = call("sh", "-c", 'ulimit -v 600000; exec "$@"', "sh", *STUDY, "s.toml", "--out", "out")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and "ulimit -v) is 600000 kB" in done.stderr


@pytest.mark.parametrize(
    "words",
    [["-m", "cellmech", "run", "s.toml"], ["-m", "cellmech.plots", "fig1"], ["-m", "cellmech.report", "out"]],
    ids=["run", "plot", "report"],
)
def test_other_numpy_than_dolfinx_was_built_with_is_named(scene, words):
    """As pip brings it along with pandas where nothing holds it back."""
    found = metadata.version("numpy")
    other = f"{int(found.split('.')[0]) + 1}.0.0"
    (scene / f"site/numpy-{other}.dist-info").mkdir(parents=True)
    (scene / f"site/numpy-{other}.dist-info/METADATA").write_text(f"Name: numpy\nVersion: {other}\n")
    done = call(sys.executable, *words, PYTHONPATH=f"{scene}/site:{ENVIRONMENT['PYTHONPATH']}")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and f"NumPy {other}" in done.stderr and found in done.stderr
    assert "pip uninstall" in done.stderr


def test_import_names_the_other_numpy(scene):
    (scene / "site/numpy-9.0.0.dist-info").mkdir(parents=True)
    (scene / "site/numpy-9.0.0.dist-info/METADATA").write_text("Name: numpy\nVersion: 9.0.0\n")
    code = "import cellmech\ntry:\n    cellmech.solve\nexcept cellmech.CellmechError as error:\n    print(error)"
    done = call(sys.executable, "-c", code, PYTHONPATH=f"{scene}/site:{ENVIRONMENT['PYTHONPATH']}")
    assert (done.returncode, done.stderr) == (0, "") and "NumPy 9.0.0" in done.stdout


def test_few_open_files_are_named(scene):
    done = call("sh", "-c", 'ulimit -n 12; exec "$@"', "sh", *STUDY, "s.toml", "--out", "out")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and "Too many open files" in done.stderr


@pytest.mark.slow
def test_compiler_and_its_options_are_not_the_environments(scene, right):
    """Compiled anew, to the same digits."""
    Path("home").mkdir()
    Path("home/.pydistutils.cfg").write_text("[build_ext]\ncompiler=mingw32\n")
    conda = {"CC": "/home/me/miniconda3/bin/x86_64-conda-linux-gnu-cc", "CFLAGS": "-Ofast", "CPATH": str(scene)}
    conda |= {"LDFLAGS": "--bogus", "LDSHARED": "no", "HOME": str(scene / "home"), "COMPILER_PATH": "/nowhere"}
    done = call(*STUDY, "s.toml", "--out", "out", "--quiet", **conda, XDG_CACHE_HOME=str(scene / "cache"))
    assert (done.returncode, done.stderr) == (0, "")
    assert numbers() == right


def test_number_of_threads_leaves_compiled_equations_apart(scene):
    """Tables of shape functions differ in their last digits, and become part of the code: each has its own."""
    marks = "from cellmech.fem.fenicsx import tables_mark; from cellmech.fem.jit import _compiling\n"
    marks += "from mpi4py import MPI\n"
    marks += "with _compiling(MPI.COMM_SELF) as found: print(tables_mark() in str(found['cffi_extra_compile_args']))"
    assert call(sys.executable, "-c", marks, XDG_CACHE_HOME=str(scene / "cache")).stdout == "True\n"
    tables = "from cellmech.fem import fenicsx; print(fenicsx.tables_mark())"
    kernels = [{}, {"OPENBLAS_CORETYPE": "Prescott"}, {"OPENBLAS_CORETYPE": "Prescott"}]
    told = [call(sys.executable, "-c", tables, **kernel).stdout for kernel in kernels]
    assert told[1] == told[2] and len(told[0]) == len(told[1]) == 17


def test_missing_compiler_is_named_and_the_case_tried_again(scene):
    code = "import sys, sysconfig; sysconfig.get_config_vars()['CC'] = 'no-such-cc'\n"
    code += "from cellmech.study import main\nsys.exit(main())"
    cache = {"XDG_CACHE_HOME": str(scene / "cache")}
    for _ in range(2):
        done = call(sys.executable, "-c", code, "s.toml", "--out", "out", "--quiet", **cache)
        assert done.returncode == 1
        assert done.stderr.count("\n") == 1
        assert (
            "s: failed: the compiler fails: no-such-cc is not installed. Equations are compiled with it" in done.stderr
        )
    assert "tried again" in Path("out/s/run.log").read_text()


def test_a_closed_pipe_is_an_error_after_petsc_has_started_too():
    """Its own handler ended the process: where a drawing process died early, or nobody read on."""
    code = """
import os
import cellmech.fem.fenicsx
from petsc4py import PETSc
reading, writing = os.pipe()
os.close(reading)
try:
    os.write(writing, b"x")
except BrokenPipeError:
    print("told")
"""
    done = call(sys.executable, "-c", code)
    assert (done.returncode, done.stdout, done.stderr) == (0, "told\n", "")

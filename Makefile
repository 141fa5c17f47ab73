# `make study` and `make test` are all a fresh Debian 12 or 13 machine needs: each does the set-up that is missing first.
# N: number of MPI ranks; ARGS: further arguments, e.g. make study ARGS="--set load.factor=2".
N ?= 2
ARGS ?=
PYTHON := .venv/bin/python
STUDY := mpirun -n $(N) $(PYTHON) -m cellmech.study
PLOTS := $(PYTHON) -m cellmech.plots

# One thread a rank: the ranks are the parallelism.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
# Open MPI 4 (Debian 12) and 5 (Debian 13, PRTE_): allow root, more ranks than cores and runs side by side (no pinning to
# the first cores; a waiting rank yields its core); no network, and no copies that containers forbid, which only warn.
export OMPI_ALLOW_RUN_AS_ROOT := 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM := 1
export OMPI_MCA_rmaps_base_oversubscribe := 1
export PRTE_MCA_rmaps_default_mapping_policy := :oversubscribe
export OMPI_MCA_hwloc_base_binding_policy := none
export PRTE_MCA_hwloc_default_binding_policy := none
export OMPI_MCA_mpi_yield_when_idle := 1
export OMPI_MCA_btl := ^tcp
export OMPI_MCA_btl_vader_single_copy_mechanism := none
# VTK draws off-screen without looking for an X server.
export VTK_DEFAULT_OPENGL_WINDOW := vtkEGLRenderWindow
# Nothing from outside Debian and .venv gets in.
export PYTHONNOUSERSITE := 1
unexport PYTHONPATH PYTHONHOME PETSC_DIR PETSC_ARCH SLEPC_DIR

.DEFAULT_GOAL := help
.PHONY: help setup study test fig1 fig2 fig3 lint check bench clean
MAKEFLAGS += --no-print-directory

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z0-9 ]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## install what is missing: Debian packages, then .venv
	@tools/setup.sh

study: setup ## the main job: the four constitutive laws under Table 1, into results/fig2
	$(STUDY) $(ARGS)

test: setup ## all tests, the MPI ones included
	$(PYTHON) -m pytest $(ARGS)

fig1: setup ## Figure 1: the initial geometry
	$(PLOTS) fig1 --out results/figures

fig2 fig3: setup ## Figure 2: curves, Figure 3: deformed cells; cases already solved are not solved again
	$(STUDY) studies/fig2.toml
	$(PLOTS) $@ --results results/fig2 --out results/figures

lint: setup ## ruff and mypy
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy

check: lint test ## lint, then all tests

bench: setup ## speed against a plain FEniCSx script
	$(PYTHON) benchmarks/speed.py $(ARGS)

clean: ## remove caches; results and .venv stay
	rm -rf build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -path ./.venv -prune -o -name __pycache__ -type d -exec rm -rf {} +

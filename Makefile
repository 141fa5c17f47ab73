# `make study` and `make test` are all a fresh Debian 12 or 13 machine needs: each does the set-up that is missing first.
# N: number of MPI ranks. RESULTS: folder of all results. SETTINGS: overrides for every case, such as
# SETTINGS="mesh.size_um=4 load.factor=2". ARGS: further arguments of a study or of the tests, such as ARGS=--fresh.
N ?= 2
RESULTS ?= results
SETTINGS ?=
ARGS ?=
FIGURES = $(RESULTS)/figures
SETUP := tools/setup.sh
PYTHON := .venv/bin/python
STUDY := mpirun -n $(N) $(PYTHON) -m cellmech.study
# For what has figures of its own:
RUN := $(STUDY) --no-pictures
PLOTS := $(PYTHON) -m cellmech.plots
PAPER := $(PYTHON) -m studies.paper
WITH = $(if $(SETTINGS),--set $(SETTINGS)) $(ARGS)

# The paper's 57 runs; what has the same cases and takes them over; all that is drawn and tabulated.
RUNS := fig2 fig4 fig6 fig7
TAKEN_OVER := fig3 fig5 table3
DRAWN := fig1 fig2 fig3 fig4 fig5 fig6 fig7 table1 table2 table3 table-fig2
AUDITS := audit audit-pairs
BETWEEN := drivers-map drivers-ridges drivers-lattice

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
.NOTPARALLEL:
.PHONY: help setup study test paper paper-runs taken-over figures-smoke compare report audit calibrate
.PHONY: fig1 fig2 fig3 fig4 fig5 fig6 fig7 table1 table2 table3 table-fig2 lint check movie speed speed-error clean
.PHONY: readings effective geometries drivers drivers-lattice lattice verify accuracy defaults second-code mutants fuzz campaign needs locking hard-cases container-check
MAKEFLAGS += --no-print-directory
# A case that failed fails its study, and the figures that show the others and say so. So where goals follow each other
# here, --keep-going tries them all, and then make fails.

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z0-9 -]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## install what is missing: Debian packages, then .venv
	@$(SETUP)

study: setup ## the main job: the four constitutive laws under Table 1, into results/fig2
	$(STUDY) studies/fig2.toml --out $(RESULTS)/fig2 $(WITH)

test: setup ## the tests, the MPI ones included; the slowest verification is for make verify
	$(PYTHON) -m pytest $(ARGS)

verify: setup ## every case with a known answer, the slow ones too, as one table into results/verify
	$(PYTHON) -m pytest -m "" --ladder $(RESULTS)/verify --no-header -q $(ARGS)

paper: ## the whole paper: 57 runs, every figure and table, the comparison, the report
	@$(MAKE) --keep-going paper-runs taken-over $(DRAWN:%=draw-%) compare report

paper-runs: setup ## the paper's 57 runs, without pictures
	$(RUN) $(RUNS:%=studies/%.toml) --out $(RESULTS) $(WITH)

taken-over: setup
	$(RUN) $(TAKEN_OVER:%=studies/%.toml) --out $(RESULTS) $(WITH)

# Cases that are solved already, in whichever study, are not solved again.
fig1: draw-fig1 ## Figure 1: the initial geometry
fig2: ## Figure 2: stress and strain against time, four laws
fig3: ## Figure 3: deformed cells, four laws
fig4: ## Figure 4: maps over the fluid fractions, 25 runs
fig5: ## Figure 5: deformed cells at the largest strains of Figures 4 and 6
fig6: ## Figure 6: maps over the moduli, 25 runs
fig7: ## Figure 7: deformed cells in S1, S2, S3
table1: draw-table1 ## Table 1: the parameters, beside the paper's
table2: draw-table2 ## Table 2: what S1, S2, S3 are
table-fig2: draw-table-fig2 ## the numbers of Figure 2 beside the paper's
table3: ## Table 3: stress, strains and shape index in S1, S2, S3

fig2 fig3 fig4 fig5 fig6 fig7 table3:
	@$(MAKE) --keep-going run-$@ draw-$@

run-%: setup
	$(RUN) studies/$*.toml --out $(RESULTS)/$* $(WITH)

draw-fig1 draw-table1 draw-table2: draw-%: setup
	$(PLOTS) $* --out $(FIGURES)

draw-table-fig2: setup
	$(PLOTS) table-fig2 --results $(RESULTS)/fig2 --out $(FIGURES)

draw-%: setup
	$(PLOTS) $* --results $(RESULTS)/$* --out $(FIGURES)

audit compare report: setup
	$(PAPER) $@ --results $(RESULTS)

compare: ## every printed number beside ours, as Markdown and CSV
report: ## one page with every figure, the comparison and the runs

audit: audit-runs ## which open inputs bring which printed numbers, one and two at a time
# That some of these runs have no solution is what they are to show.
audit-runs: setup
	-$(RUN) $(AUDITS:%=studies/%.toml) --out $(RESULTS) $(WITH)

# The reading of the paper that fits best, as studies.paper.readings names it.
EFFECTIVE := twice-6
readings: setup ## readings of the paper, each on every row that it prints, and fits that predict what they have not seen
	-mpirun -n $(N) $(PAPER) readings --results $(RESULTS)
	$(PAPER) fit-readings --results $(RESULTS)

effective: setup ## all 57 runs in the reading that fits best, with figures and comparison, into results/readings
	-mpirun -n $(N) $(PAPER) readings --only $(EFFECTIVE) --whole --results $(RESULTS)
	@$(MAKE) --keep-going draw-fig2 draw-fig4 draw-fig6 draw-table3 compare RESULTS=$(RESULTS)/readings/$(EFFECTIVE)
	$(PLOTS) fig3 --results $(RESULTS)/readings/$(EFFECTIVE)/fig2 --out $(RESULTS)/readings/$(EFFECTIVE)/figures
	$(PLOTS) fig7 --results $(RESULTS)/readings/$(EFFECTIVE)/table3 --out $(RESULTS)/readings/$(EFFECTIVE)/figures

geometries: setup ## Table 1 as a cylinder, as a turned ball and as a ball in space, side by side
	-@$(MAKE) --keep-going run-geometries  # two laws are no stable ball, and say so
	$(PAPER) geometries --results $(RESULTS)

drivers: setup ## what deforms the nucleus: weight, adhesion, contractile actin, and pairs of them; pictures and report
	@$(MAKE) run-drivers
	$(PYTHON) -m cellmech.report $(RESULTS)/drivers --draw

drivers-lattice: setup ## the same between two ridges and between four pillars in 3-D, and the map over adhesion: an hour or two
	@$(MAKE) --keep-going $(BETWEEN:%=run-%)
	$(PLOTS) map $(RESULTS)/drivers-map --out $(FIGURES) --stem drivers-map
	for study in $(BETWEEN); do $(PYTHON) -m cellmech.report $(RESULTS)/$$study --draw || exit 1; done

lattice: setup ## a ball between four square pillars in 3-D: picture, film from all sides, files for ParaView, report
	@$(MAKE) run-lattice
	$(PLOTS) shape --case $(RESULTS)/lattice/lattice --out $(RESULTS)/lattice/figures
	$(PLOTS) turntable --case $(RESULTS)/lattice/lattice --out $(RESULTS)/lattice/figures
	$(PLOTS) paraview --case $(RESULTS)/lattice/lattice --out $(RESULTS)/lattice/figures
	$(PYTHON) -m cellmech.report $(RESULTS)/lattice

calibrate: setup ## fit the load to the print: what it gives, law by law, and the largest that Saint-Venant bears
	mpirun -n $(N) $(PAPER) calibrate --results $(RESULTS) $(if $(SETTINGS),--set $(SETTINGS))

figures-smoke: ## all of `make paper` on a coarse mesh, in minutes, into results/smoke
	@$(MAKE) paper RESULTS=results/smoke SETTINGS="mesh.size_um=6 time.rtol=1e-2"

movie: run-movie ## a film of Table 1's cell as the load comes on, displacements magnified
	$(PLOTS) movie --case $(RESULTS)/movie/movie --magnify 15 --out $(FIGURES)

lint: setup ## ruff, mypy, and which room imports which
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy
	$(dir $(PYTHON))lint-imports

check: lint test ## lint, then the tests

# Some cases are there to stop: the table judges every verdict.
hard-cases: setup ## what is hard to solve, or must stop: verdicts, with the plain script beside them
	-$(RUN) studies/hard-cases.toml --out $(RESULTS)/hard-cases $(WITH)
	$(PYTHON) benchmarks/hard_cases.py --results $(RESULTS)/hard-cases

speed-error: setup ## speed against error, beside a plain FEniCSx script: table and plot
	$(PYTHON) benchmarks/speed_error.py --out $(RESULTS)/speed-error $(ARGS)

speed: setup ## whether the package has become slower: its cost over the plain script's, beside the stored ratios
	$(PYTHON) benchmarks/ratios.py $(ARGS)

accuracy: setup ## the error of every number of the paper's 57 runs, from refined runs, and one table of it
	$(RUN) $(RUNS:%=studies/%.toml) --out $(RESULTS) --accuracy $(WITH)
	$(PYTHON) benchmarks/accuracy_table.py --results $(RESULTS) --out $(RESULTS)/accuracy

defaults: setup ## error against cost of other meshes, smoothings and quadratures than the default
	$(PYTHON) benchmarks/accuracy.py --out $(RESULTS)/defaults $(ARGS)

second-code: setup ## the settled cell by a second finite-element code (installs NGSolve into .venv), compared
	@$(PYTHON) -c 'import ngsolve' 2>/dev/null || $(PYTHON) -m pip install --quiet --no-input \
		--disable-pip-version-check --editable '.[benchmark]'
	$(PYTHON) benchmarks/second_code.py $(ARGS)

mutants: setup ## make the program wrong on purpose, one mistake at a time: a named test must turn red
	$(PYTHON) tools/mutants.py --jobs $(N) $(ARGS)

fuzz: setup ## 10,000 hostile files through --check, 300 odd scenes solved: counts and faults into results/fuzz
	$(PYTHON) tools/fuzz.py --out $(RESULTS)/fuzz $(ARGS)

campaign: setup ## 1,000 random scenes over all scales solved and checked against statics, into results/campaign
	$(PYTHON) tools/campaign.py --jobs $(N) --out $(RESULTS)/campaign $(ARGS)

needs: setup ## what each optional part costs and changes where it does nothing
	$(PYTHON) benchmarks/needs.py --out $(RESULTS)/needs $(ARGS)

container-check: setup ## build the container image and check it, also without Docker (buildah, as root); ARGS="--tests all"
	$(PYTHON) tools/container_check.py --work $(RESULTS)/container $(ARGS)

locking: setup ## P2 alone beside the mixed form as nu -> 0.5, into results/locking
	$(PYTHON) benchmarks/locking.py --out $(RESULTS)/locking $(ARGS)

notebook: setup ## the example in a notebook, docs/example.ipynb (installs Jupyter and pandas into .venv)
	@$(PYTHON) -c 'import jupyterlab, nbformat, pandas' 2>/dev/null || $(PYTHON) -m pip install --quiet --no-input \
		--disable-pip-version-check --editable '.[notebook]'
	$(PYTHON) -m jupyterlab docs/example.ipynb $(ARGS)

.PHONY: docs notebook
docs: setup ## the documentation as web pages into build/docs (installs Sphinx into .venv)
	@$(PYTHON) -c 'import furo, ipykernel, myst_nb, sphinx' 2>/dev/null || $(PYTHON) -m pip install --quiet --no-input \
		--disable-pip-version-check --editable '.[docs]'
	$(PYTHON) tools/scene_reference.py
	$(PYTHON) tools/columns.py
	$(PYTHON) -m sphinx -W --keep-going -b html -d build/doctrees docs build/docs $(ARGS)

clean: ## remove caches; results and .venv stay
	rm -rf build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -path ./.venv -prune -o -name __pycache__ -type d -exec rm -rf {} +

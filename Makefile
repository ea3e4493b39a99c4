# `make demo` and `make test` install everything they need.
SHELL := /bin/bash
.DEFAULT_GOAL := help
PYTHON := .venv/bin/python
# Large packages are never compiled from source: that takes an hour, and fails in the end.
PIP := .venv/bin/pip install -q --disable-pip-version-check -c constraints.txt \
	--only-binary numpy,scipy,highspy,numba,llvmlite,vtk,gmsh,pandas,shapely
# From Debian 13 on, python3-h5py has the module, and python3-h5py-mpi what it imports.
APT := python3-dolfinx python3-venv python3-netcdf4 python3-h5py python3-h5py-mpi \
	libopenblas0-pthread libegl1 libgl1 libglu1-mesa libopengl0 \
	libxcursor1 libxft2 libxinerama1 libxrender1 libfontconfig1

# Problems are small: threads slow each other down.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

# Imported modules are compiled once, for all workers and the processes of tests.
unexport PYTHONDONTWRITEBYTECODE

# Folder of the Debian of `make test-debian13`, reused by later calls.
DEBIAN13 := /var/tmp/archfem-debian13

# One worker a core; idle workers take over tests from others.
SPREAD := -n auto --dist worksteal

.PHONY: help setup demo test test-slow test-debian13 hard bench archbench archbench-quick wasm docs notebooks pictures verification fuzz mutants lint clean

help:  ## list the targets
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

setup: .venv/ready  ## install what is needed (system packages, .venv)

.venv/ready: Makefile pyproject.toml constraints.txt
	@.ci/packages.sh $(APT)
	@/usr/bin/python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "archfem needs Python 3.11 or newer; /usr/bin/python3 here is older"; exit 1; }
	@echo "making .venv (about a minute)"
	@/usr/bin/python3 -m venv --system-site-packages .venv
	$(PIP) -e '.[dev]'
	@touch $@

# Time stepping code is compiled once, on all cores; otherwise each test worker would compile it.
.venv/compiled: .venv/ready $(shell find archfem -name '*.py')
	$(PYTHON) -m archfem compile
	@touch $@

demo: .venv/ready  ## run the shipped ring on a strong earthquake: results in out/ring
	$(PYTHON) -m archfem run meshes/ring.toml --out out/ring

test: .venv/compiled  ## the default tests, on all cores
	$(PYTHON) -m pytest $(SPREAD)

test-slow: .venv/compiled  ## the tests marked slow: longer ones, and further cases
	$(PYTHON) -m pytest $(SPREAD) -m slow

test-debian13:  ## the default tests in a fresh Debian 13 (root, debootstrap, 4 GB in DEBIAN13)
	.ci/debian.sh trixie $(DEBIAN13) make test

hard: .venv/compiled  ## the suite of hard cases, one line a case: outcome, effort, energy drift, error
	cd tests && ../$(PYTHON) -m hard

mutants: .venv/compiled  ## changes in the physics, COUNT=60 of them, that the tests should detect
	cd tests && ../$(PYTHON) -m mutants --count $(or $(COUNT),60) --seed $(or $(SEED),0)

fuzz: .venv/compiled  ## malformed input by the thousand, a table; COUNT=100 for a short run, SEED=1 for another
	cd tests && ../$(PYTHON) -m fuzz --seed $(or $(SEED),0) $(if $(COUNT),--count $(COUNT))

bench: .venv/bench  ## speed beside error, against OpenSees and a bare compiled loop
	$(PYTHON) tests/benchmarks/run.py

archbench: .venv/compiled  ## every program on every scene of Arch-Bench, its table and figures (10 min)
	$(PYTHON) -m archbench.run --install
	$(PYTHON) -m archbench.table
	$(PYTHON) -m archbench.figures

archbench-quick: .venv/compiled  ## archfem on the scenes of Arch-Bench against its stored answers
	$(PYTHON) -m archbench.run --quick

wasm: .venv/ready  ## the kernels of pages, as WebAssembly (2 min); after a change of their sources
	$(PYTHON) docs/page_kernels.py
	$(PYTHON) docs/try_page.py

.venv/bench: .venv/ready
	$(PIP) -e '.[dev,bench]'
	@touch $@

docs: .venv/docs  ## the documentation as pages: docs/build/html/index.html
	$(PYTHON) -m sphinx -q -W --keep-going -b html docs docs/build/html

notebooks: .venv/docs .venv/compiled  ## run the notebooks, and save their outputs
	$(PYTHON) docs/execute.py

pictures: .venv/docs .venv/compiled  ## the pictures of the pages: bridge, gallery, film, theory, bench
	$(PYTHON) docs/execute.py notebooks/03_a_roman_bridge.py
	$(PYTHON) docs/pictures.py
	$(PYTHON) docs/figures.py
	$(PYTHON) -m archbench.figures

verification: .venv/compiled  ## the verification table of the documentation, written by the tests
	$(PYTHON) -m pytest $(SPREAD) -m "" --verified=docs/verification.json

.venv/docs: .venv/ready
	$(PIP) -e '.[dev,docs,notebooks]'
	@touch $@

lint: .venv/ready  ## style and types
	.venv/bin/ruff check . && .venv/bin/ruff format --check . && .venv/bin/mypy archfem archbench

clean:  ## remove the environment and all results
	rm -rf .venv out

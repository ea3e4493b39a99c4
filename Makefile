# `make demo` and `make test` each do all of their own set-up.
SHELL := /bin/bash
.DEFAULT_GOAL := help
PYTHON := .venv/bin/python
# What is large is never compiled from source: that takes an hour, and fails in the end.
PIP := .venv/bin/pip install -q --disable-pip-version-check -c constraints.txt \
	--only-binary numpy,scipy,numba,llvmlite,vtk,gmsh,pandas,shapely
APT := python3-dolfinx python3-venv python3-netcdf4 python3-h5py-mpi libopenblas0-pthread \
	libegl1 libgl1 libglu1-mesa libopengl0 libxcursor1 libxft2 libxinerama1 libxrender1 libfontconfig1

# Small dense and sparse problems: threads only get in each other's way.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

# What is imported is compiled once, for all workers and the processes that tests start.
unexport PYTHONDONTWRITEBYTECODE

# Where `make test-debian13` makes its Debian, and finds it again.
DEBIAN13 := /var/tmp/archfem-debian13

# A worker a core, and whoever is done takes over from others.
SPREAD := -n auto --dist worksteal

.PHONY: help setup demo test test-slow test-debian13 hard bench docs notebooks verification fuzz mutants lint clean

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

# What time steps need is compiled once, on all cores: test workers would each do it for themselves.
.venv/compiled: .venv/ready $(shell find archfem -name '*.py')
	$(PYTHON) -m archfem compile
	@touch $@

demo: .venv/ready  ## run the shipped ring on a synthetic earthquake: results in out/ring
	$(PYTHON) -m archfem run meshes/ring.toml --out out/ring || test $$? = 3  # 3: in doubt, as said

test: .venv/compiled  ## the default tests, on all cores
	$(PYTHON) -m pytest $(SPREAD)

test-slow: .venv/compiled  ## the tests that take minutes
	$(PYTHON) -m pytest $(SPREAD) -m slow

test-debian13:  ## the default tests in a Debian 13 made for them (root, debootstrap, 4 GB in DEBIAN13)
	.ci/debian.sh trixie $(DEBIAN13) make test

hard: .venv/compiled  ## the suite of hard cases, a line each: outcome, effort, energy drift, error
	cd tests && ../$(PYTHON) -m hard

mutants: .venv/compiled  ## changes in the physics, COUNT=60 of them, that the tests should notice
	cd tests && ../$(PYTHON) -m mutants --count $(or $(COUNT),60) --seed $(or $(SEED),0)

fuzz: .venv/compiled  ## odd input by the thousand, a table; COUNT=100 for a short run, SEED=1 for another
	cd tests && ../$(PYTHON) -m fuzz --seed $(or $(SEED),0) $(if $(COUNT),--count $(COUNT))

bench: .venv/bench  ## speed beside error, against OpenSees and a bare compiled loop
	$(PYTHON) tests/benchmarks/run.py

.venv/bench: .venv/ready
	$(PIP) -e '.[dev,bench]'
	@touch $@

docs: .venv/docs  ## the documentation as pages: docs/build/html/index.html
	$(PYTHON) -m sphinx -q -W --keep-going -b html docs docs/build/html

notebooks: .venv/docs .venv/compiled  ## run the notebooks, and keep what they show
	$(PYTHON) docs/execute.py

verification: .venv/compiled  ## the table of what tests verify, for the documentation
	$(PYTHON) -m pytest $(SPREAD) -m "" --verified=docs/verification.json

.venv/docs: .venv/ready
	$(PIP) -e '.[dev,docs,notebooks]'
	@touch $@

lint: .venv/ready  ## style and types
	.venv/bin/ruff check . && .venv/bin/ruff format --check . && .venv/bin/mypy archfem

clean:  ## remove the environment and all results
	rm -rf .venv out

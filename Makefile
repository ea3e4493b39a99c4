# `make demo` and `make test` each do all of their own set-up.
SHELL := /bin/bash
.DEFAULT_GOAL := help
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo "sudo -E")
PYTHON := .venv/bin/python
APT := python3-dolfinx python3-venv python3-netcdf4 python3-h5py-mpi libopenblas0-pthread \
	libegl1 libgl1 libglu1-mesa libopengl0 libxcursor1 libxft2 libxinerama1 libxrender1 libfontconfig1

# Small dense and sparse problems: threads only get in each other's way.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

# A worker a core, and whoever is done takes over from others.
SPREAD := -n auto --dist worksteal

.PHONY: help setup demo test test-slow hard fuzz mutants bench lint clean

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: .venv/ready  ## install what is needed (system packages, .venv)

.venv/ready: Makefile pyproject.toml constraints.txt
	@command -v apt-get >/dev/null || { echo "archfem's set-up needs Debian's apt-get: on other systems install FEniCSx, then 'pip install -e .'"; exit 1; }
	@[ "$$(id -u)" = 0 ] || command -v sudo >/dev/null || { echo "installing system packages needs root or sudo: $(APT)"; exit 1; }
	@dpkg -s $(APT) >/dev/null 2>&1 || { $(SUDO) apt-get update -q \
		&& DEBIAN_FRONTEND=noninteractive $(SUDO) apt-get install -y -q --no-install-recommends $(APT); } \
		|| { echo "the packages could not be installed (Debian 12 has them all): $(APT)"; exit 1; }
	@/usr/bin/python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "archfem needs Python 3.11, as on Debian 12; /usr/bin/python3 here is older"; exit 1; }
	/usr/bin/python3 -m venv --system-site-packages .venv
	.venv/bin/pip install -q --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

# What time steps need is compiled once, on all cores: test workers would each do it for themselves.
.venv/compiled: .venv/ready $(shell find archfem -name '*.py')
	$(PYTHON) -m archfem compile
	@touch $@

demo: .venv/ready  ## run the shipped ring on a synthetic earthquake: results in out/ring
	$(PYTHON) -m archfem run meshes/ring.toml --out out/ring

test: .venv/compiled  ## the default tests, on all cores
	$(PYTHON) -m pytest $(SPREAD)

test-slow: .venv/compiled  ## the tests that take minutes
	$(PYTHON) -m pytest $(SPREAD) -m slow

hard: .venv/compiled  ## the suite of hard cases, a line each: outcome, effort, energy drift, error
	cd tests && ../$(PYTHON) -m hard

fuzz: .venv/compiled  ## odd input by the thousand, a table; COUNT=100 for a short run, SEED=1 for another
	cd tests && ../$(PYTHON) -m fuzz --seed $(or $(SEED),0) $(if $(COUNT),--count $(COUNT))

bench: .venv/bench  ## speed beside error, against OpenSees and a bare compiled loop
	$(PYTHON) tests/benchmarks/run.py

.venv/bench: .venv/ready
	.venv/bin/pip install -q --disable-pip-version-check -c constraints.txt -e '.[dev,bench]'
	@touch $@

lint: .venv/ready  ## style and types
	.venv/bin/ruff check . && .venv/bin/ruff format --check . && .venv/bin/mypy archfem

clean:  ## remove the environment and all results
	rm -rf .venv out

#!/usr/bin/env bash
# Install missing Debian packages: packages.sh NAME... Elsewhere print the alternatives.
set -euo pipefail
say() { printf '%s\n' "$@" >&2; }

# If none is missing, neither root nor this Debian is needed.
dpkg -s "$@" >/dev/null 2>&1 && exit 0

system="this system" ID="" VERSION_ID=""
if [ -r /etc/os-release ]; then . /etc/os-release; system=${PRETTY_NAME:-$ID}; fi
if [ "$ID" != debian ] || { [ "$VERSION_ID" ] && [ "$VERSION_ID" -lt 12 ]; }; then
	say "make sets archfem up on Debian 12 and 13, and this is $system. Here, one of these does:" \
		"  conda env create -f environment.yml && conda activate archfem       FEniCSx from conda-forge" \
		"  docker build -t archfem . && docker run --rm -it archfem            Debian 13 in a container" \
		"  python3 -m venv .venv && .venv/bin/pip install -e '.[dev]'          without FEniCSx: rigid stones only" \
		"then 'python -m pytest' runs the tests, and 'archfem doctor' says what is missing."
	exit 1
fi
case $VERSION_ID in 12|13) ;; *) say "archfem is tried on Debian 12 and 13, and this is $system: going on" ;; esac

root=(env DEBIAN_FRONTEND=noninteractive)
if [ "$(id -u)" != 0 ]; then
	if ! command -v sudo >/dev/null || ! sudo -v; then
		say "installing packages needs root or sudo; ask whoever has it for: apt-get install $*"
		exit 1
	fi
	root=(sudo env DEBIAN_FRONTEND=noninteractive)
fi
say "installing packages of $system (the first time 300 MB and about a minute)"
if ! { "${root[@]}" apt-get update -qq && "${root[@]}" apt-get install -y -qq --no-install-recommends "$@" >/dev/null; }; then
	say "apt-get could not install them, see above; Debian 12 and 13 have them all: $*"
	exit 1
fi

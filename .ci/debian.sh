#!/usr/bin/env bash
# Run `make test` of this tree in its own Debian, created in a folder if missing:
#   debian.sh SUITE FOLDER [COMMAND...]       e.g. debian.sh trixie /var/tmp/archfem-trixie make demo
# Needs root, debootstrap and 4 GB. Remove it with: rm -rf --one-file-system FOLDER
set -euo pipefail
suite=$1 folder=$2
shift 2
[ $# -gt 0 ] || set -- make test
tree=$(cd "$(dirname "$0")/.." && pwd)

if [ "$(id -u)" != 0 ]; then
	echo "a Debian in a folder can be made and entered by root alone: sudo make test-debian13" >&2
	exit 1
fi
if ! command -v debootstrap >/dev/null; then
	echo "debootstrap is missing, which makes a Debian in a folder: apt-get install debootstrap" >&2
	exit 1
fi

within() {
	chroot "$folder" env -i DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root \
		PATH=/usr/sbin:/usr/bin:/sbin:/bin PIP_CERT=/etc/ssl/certs/ca-certificates.crt "$@"
}
known() {  # what this machine knows of the network: names, certificates, where pip looks
	cp -L /etc/resolv.conf /etc/hosts "$folder/etc/"
	if [ -f /etc/pip.conf ]; then cp /etc/pip.conf "$folder/etc/"; fi
	if [ -f /etc/ssl/certs/ca-certificates.crt ] && [ -d "$folder/etc/ssl/certs" ]; then
		cp /etc/ssl/certs/ca-certificates.crt "$folder/etc/ssl/certs/"
	fi
}
leave() { for each in dev/shm dev/pts sys proc; do umount "$folder/$each" 2>/dev/null || true; done; }

if [ ! -x "$folder/usr/sbin/policy-rc.d" ]; then
	mirror=${MIRROR:-http://deb.debian.org/debian}
	# debootstrap keeps this folder until it has ended, and fails over an unfinished system
	if [ -d "$folder/debootstrap" ]; then rm -rf --one-file-system "$folder"; fi
	echo "making Debian $suite in $folder (about a minute)" >&2
	debootstrap --variant=minbase "$suite" "$folder" "$mirror" >/dev/null
	printf '#!/bin/sh\nexit 101\n' >"$folder/usr/sbin/policy-rc.d"  # no service starts
	chmod +x "$folder/usr/sbin/policy-rc.d"
fi
leave  # what a killed run has left
trap leave EXIT
mount -t proc proc "$folder/proc"
mount -t sysfs -o ro sysfs "$folder/sys"
mount -t devpts devpts "$folder/dev/pts"
mkdir -p "$folder/dev/shm" && mount -t tmpfs tmpfs "$folder/dev/shm"
known
if [ ! -f "$folder/made" ]; then
	within apt-get update -qq
	within apt-get install -y -qq --no-install-recommends make ca-certificates >/dev/null
	known
	touch "$folder/made"
fi
mkdir -p "$folder/archfem"
# files of an earlier tree would be tested too; the environment stays
find "$folder/archfem" -mindepth 1 -maxdepth 1 ! -name .venv -exec rm -rf {} +
tar -C "$tree" --exclude=./.venv --exclude=./.git --exclude=./out --exclude=__pycache__ -c . \
	| tar -C "$folder/archfem" -x
within env -C /archfem "$@"

#!/usr/bin/env bash
# Makes the base image of Dockerfile from Debian's packages if no image registry is reachable.
# Needs root, debootstrap and a Docker engine. Uses the mirror that apt uses on this machine.
set -euo pipefail

say() { echo "base-image.sh: $*" >&2; }
fail() { say "error: $1"; exit "${2:-1}"; }

if [[ ${1:-} == --help || ${1:-} == -h || $# -gt 1 ]]; then
  echo "usage: docker/base-image.sh [IMAGE]      debian:bookworm-slim (default) or debian:trixie-slim" >&2
  [[ $# == 1 ]] && exit 0 || exit 2
fi
image=${1:-debian:bookworm-slim}
codename=bookworm
[[ $image != *trixie* ]] || codename=trixie

((EUID == 0)) || fail "debootstrap needs root"
command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap"
docker version >/dev/null 2>&1 || fail "no Docker engine answers (see: docker version)"

# shellcheck disable=SC2016  # apt's variable, not the shell's
mirror="$(apt-get indextargets --format '$(CODENAME) $(SITE)' 'Created-By: Packages' 'Origin: Debian' \
  'Component: main' 2>/dev/null | awk '$1 !~ /-/ { print $2; exit }')"
mirror=${mirror:-http://deb.debian.org/debian}

folder="$(mktemp -d)"
trap 'rm -rf --one-file-system "$folder"' EXIT
say "making $image with debootstrap from $mirror, half a minute or more"
if ! debootstrap --variant=minbase "$codename" "$folder/root" "$mirror" >"$folder/log" 2>&1; then
  tail -n 5 "$folder/log" >&2
  fail "debootstrap failed"
fi
# Like the slim image of the registry: no documentation, no package lists.
rm -rf "$folder"/root/var/cache/apt/* "$folder"/root/var/lib/apt/lists/* \
  "$folder"/root/usr/share/{doc,info,locale,man}/*
tar -C "$folder/root" -c . | docker import --change 'CMD ["bash"]' - "$image" >/dev/null
say "made $image"

#!/usr/bin/env bash
# ./sls docs: Doxygen for the headers, Sphinx for the index and the package. A warning or a broken link is an error.
# usage: docs/api/build.sh BUILD [OUT]      OUT: default BUILD/docs, replaced
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
cd "$root"
build="$(realpath "$1")"
SLS_BUILD="$build"
SLS_DOCS="$(realpath --canonicalize-missing "${2:-$build/docs}")"
SLS_VERSION="$(sed -n 's/^project(sls VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)"
export SLS_BUILD SLS_DOCS SLS_VERSION

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
rm -rf "$SLS_DOCS"
mkdir -p "$SLS_DOCS"
/usr/bin/python3 -BP docs/api/make_pages.py "$scratch/pages" "$SLS_DOCS"
/usr/bin/python3 -BP -m sphinx -W --keep-going -q -b html -c docs/api -d "$scratch/trees" "$scratch/pages" "$SLS_DOCS"
doxygen docs/api/Doxyfile
/usr/bin/python3 -BP docs/api/check_links.py "$SLS_DOCS"

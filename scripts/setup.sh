#!/bin/sh
# Installs what building and testing Diaphan needs, on Debian 12 and its kin. Asks dpkg first: where nothing is missing nothing is
# done, and no network is needed.
set -eu
cd "$(dirname "$0")/.."

# compiler, build system, and what the front door itself calls
packages="gcc g++ clang libclang-rt-14-dev libc6-dev make cmake pkg-config git ca-certificates"
# libraries: JSON, compressed glTF, rays, GL without a window, pictures
packages="$packages libjansson-dev libmeshoptimizer-dev libembree-dev libepoxy-dev libegl-dev libgl1-mesa-dri"
packages="$packages libpng-dev libopenexr-dev"
# charts and contact sheets: drawing, and a font to draw texts with
packages="$packages libcairo2-dev libfontconfig-dev fonts-dejavu-core"
# tests: unit tests, JSON on the command line, SVG and HTML, a shader compiler that is nobody's driver
packages="$packages libcmocka-dev jq libxml2-utils glslang-tools"
# the scanned mesh of the demo
packages="$packages glmark2-data"

if ! command -v dpkg-query >/dev/null 2>&1; then
    echo "setup: this is no Debian; install what corresponds to: $packages nodejs npm" >&2
    exit 0
fi

missing=
for package in $packages; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
        missing="$missing $package"
    fi
done

# Node.js often comes from elsewhere than Debian; any will do
command -v node >/dev/null 2>&1 || missing="$missing nodejs"
command -v npm >/dev/null 2>&1 || missing="$missing npm"

if [ -n "$missing" ]; then
    if [ "$(id -u)" -eq 0 ]; then
        root=
    elif command -v sudo >/dev/null 2>&1; then
        root=sudo
    else
        echo "setup: needs root or sudo to install:$missing" >&2
        exit 1
    fi
    echo "setup: installing$missing"
    # a fresh machine's package lists may be missing or old
    $root env DEBIAN_FRONTEND=noninteractive apt-get update -q
    # shellcheck disable=SC2086
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends $missing
fi

# The Khronos glTF validator, for one test; without it that test is skipped and says so.
if [ -f tests/validator/package.json ] && [ ! -d tests/validator/node_modules/gltf-validator ]; then
    echo "setup: installing the glTF validator"
    if [ -f tests/validator/package-lock.json ]; then action=ci; else action=install; fi
    (cd tests/validator && npm "$action" --no-audit --no-fund --loglevel=error --fetch-retries=1) ||
        echo "setup: the glTF validator could not be had; its test will be skipped" >&2
fi
echo "setup: everything is there"

#!/usr/bin/env bash
# The core library builds without threads and without any other library of the project. Arguments: source folder, C compiler.
set -euo pipefail
source=$1 cc=$2
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
cmake -S "$source" -B "$root" -DCMAKE_C_COMPILER="$cc" -DCMAKE_BUILD_TYPE=Debug -DDPH_THREADS=OFF -DDPH_IMAGE=OFF \
    -DDPH_RENDER=OFF -DDPH_TRACE=OFF -DDPH_CLI=OFF -DDPH_TESTS=OFF >"$root/log" 2>&1 &&
    cmake --build "$root" >>"$root/log" 2>&1 || { cat "$root/log"; exit 1; }
# nothing of GL, of rays, of pictures or of threads is asked for
if nm -u "$root/src/libdiaphan.a" | grep -E ' (egl|gl[A-Z]|rtc|png_|exr_|pthread_)'; then
    echo "the core needs the above"
    exit 1
fi

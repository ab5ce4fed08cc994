#!/usr/bin/env bash
# Builds and runs the tests twice, plainly with gcc and under clang's address and undefined-behaviour sanitizers, warnings being
# errors in both, and ends with one line that counts them. Called by `make test`.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
failed=0

build() { # folder, cmake options
    local folder=$1
    shift
    cmake -S . -B "$folder" -DDPH_WERROR=ON "$@" >"$logs/configure" 2>&1 || { cat "$logs/configure"; return 1; }
    cmake --build "$folder" -j "$jobs" >"$logs/build" 2>&1 || { cat "$logs/build"; return 1; }
}

check() { # name, folder, ctest options
    local name=$1 folder=$2
    shift 2
    ctest --test-dir "$folder" --output-on-failure -j "$jobs" "$@" | tee "$logs/$name" || failed=1
}

count() { # pattern: lines of all runs that match
    cat "$logs"/run-* | grep -c "$1" || true
}

echo "== gcc"
build build
check run-plain build

echo "== clang, address and undefined-behaviour sanitizers"
CC=clang CXX=clang++ build build-sanitize -DDPH_SANITIZE=ON
export UBSAN_OPTIONS=print_stacktrace=1
check run-sanitize build-sanitize --label-exclude once

passed=$(count ' Passed ')
skipped=$(count '\*\*\*Skipped')
bad=$(count '\*\*\*\(Failed\|Exception\|Timeout\|Not Run\)')
echo "diaphan: $passed tests passed, $bad failed, $skipped skipped (in two builds: gcc, and clang with sanitizers)"
exit $failed

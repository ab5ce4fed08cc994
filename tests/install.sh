#!/usr/bin/env bash
# Installs the build into a folder of its own, builds the example against what is there, once through the CMake package and once
# through pkg-config, and runs it. Arguments: build folder, source folder, C compiler.
set -euo pipefail
build=$1 source=$2 cc=$3
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT

cmake --install "$build" --prefix "$root/usr" >"$root/log" || { cat "$root/log"; exit 1; }
for file in bin/diaphan include/diaphan/diaphan.h share/diaphan/diaphan.glsl; do
    [ -e "$root/usr/$file" ] || { echo "not installed: $file"; exit 1; }
done
# moved elsewhere it has to work as well
mv "$root/usr" "$root/moved"
"$root/moved/bin/diaphan" --version

libdir=$(dirname "$(find "$root/moved" -name 'libdiaphan.*' | head -n 1)")
export LD_LIBRARY_PATH=$libdir # for a build of shared libraries
export PKG_CONFIG_PATH=$libdir/pkgconfig

expect() {
    echo "$1: $2"
    [[ $2 =~ middle:\ 19\.[34] ]]
}

cmake -S "$source/examples" -B "$root/example" -DCMAKE_PREFIX_PATH="$root/moved" -DCMAKE_C_COMPILER="$cc" >"$root/log" 2>&1 &&
    cmake --build "$root/example" >>"$root/log" 2>&1 || { cat "$root/log"; exit 1; }
expect cmake "$("$root/example/bake_sphere")"

# every component can be found and linked
mkdir "$root/all"
cat >"$root/all/main.c" <<'C'
#include <diaphan/diaphan.h>
#include <diaphan/image.h>
#include <diaphan/render.h>
#include <diaphan/trace.h>
int main(void)
{
    struct dph_image image;
    dph_rays_destroy(NULL);
    return !dph_method_at(0) || !dph_image_init(&image, 1, 1, NULL) || (dph_image_finish(&image), 0);
}
C
cat >"$root/all/CMakeLists.txt" <<'C'
cmake_minimum_required(VERSION 3.22)
project(user LANGUAGES C)
find_package(diaphan REQUIRED COMPONENTS trace render)
add_executable(user main.c)
target_link_libraries(user PRIVATE diaphan::diaphan-render diaphan::diaphan-trace diaphan::diaphan-image)
C
cmake -S "$root/all" -B "$root/all/build" -DCMAKE_PREFIX_PATH="$root/moved" -DCMAKE_C_COMPILER="$cc" >"$root/log" 2>&1 &&
    cmake --build "$root/all/build" >>"$root/log" 2>&1 || { cat "$root/log"; exit 1; }
"$root/all/build/user"

# shellcheck disable=SC2046
"$cc" -std=c11 "$source/examples/bake_sphere.c" -o "$root/bake_sphere" $(pkg-config --cflags --libs diaphan) -lm
expect pkg-config "$("$root/bake_sphere")"
# shellcheck disable=SC2046
"$cc" -std=c11 "$root/all/main.c" -o "$root/all/plain" $(pkg-config --cflags --libs diaphan-render diaphan-trace)
"$root/all/plain"

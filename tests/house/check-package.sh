#!/bin/sh
# Builds the examples against an installed library, through its CMake package or through pkg-config, and runs them.
# Each example checks its own results.
# usage: check-package.sh cmake|pkgconfig INSTALLED EXAMPLES BUILD CC CXX
set -eu
how=$1 installed=$2 examples=$3 build=$4/$1 cc=$5 cxx=$6
rm -rf "$build"
mkdir -p "$build"
if [ "$how" = cmake ]; then
    cmake -S "$examples" -B "$build" -G Ninja -DCMAKE_PREFIX_PATH="$installed" -DCMAKE_C_COMPILER="$cc" \
        -DCMAKE_CXX_COMPILER="$cxx" >"$build/log" ||
        { cat "$build/log"; exit 1; }
    cmake --build "$build"
else
    description=$(find "$installed" -name facetree.pc)
    PKG_CONFIG_PATH=$(dirname "$description")
    export PKG_CONFIG_PATH
    libraries=$(pkg-config --variable=libdir facetree)
    for source in "$examples"/*.c; do
        # shellcheck disable=SC2046 # flags are words
        $cc -std=c11 -O2 -Wall -Wextra -Werror "$source" -o "$build/$(basename "$source" .c)" $(pkg-config --cflags --libs facetree) \
            -Wl,-rpath,"$libraries" -lm
    done
    # gcc 12 wrongly reports inlined code of OpenMesh as uninitialised.
    # shellcheck disable=SC2046
    $cxx -std=c++17 -O2 -Wall -Wextra -Wshadow -Werror -Wno-maybe-uninitialized "$examples/openmesh.cpp" -o "$build/openmesh" \
        $(pkg-config --cflags --libs facetree openmesh) -Wl,-rpath,"$libraries" -lm
fi
cd "$build"
for source in "$examples"/*.c "$examples"/*.cpp; do
    name=$(basename "$source")
    "./${name%.*}"
done

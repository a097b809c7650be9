#!/bin/sh
# Configures and builds a preset and runs its tests; the preset `fuzz` is built only.
# usage: suite.sh PRESET [CTEST-ARGUMENT...]
set -eu
preset=$1
shift
if command -v ccache >/dev/null; then
    export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
cmake --preset "$preset"
cmake --build --preset "$preset"
[ "$preset" = fuzz ] || ctest --preset "$preset" -j "$(nproc)" "$@"

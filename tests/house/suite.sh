#!/bin/sh
# Configures and builds a preset and runs its tests. The preset `fuzz` has no tests of its own, and `tsan` leaves out long tests
# whose code other tests run with several threads. Uses ccache if it is installed.
# usage: suite.sh PRESET [CTEST-ARGUMENT...]
set -eu
preset=$1
shift
if command -v ccache >/dev/null; then
    export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
tests=ON
[ "$preset" != fuzz ] || tests=OFF
cmake --preset "$preset" -DFACETREE_TESTS=$tests
cmake --build --preset "$preset"
[ "$preset" = fuzz ] || ctest --preset "$preset" -j "$(nproc)" "$@"

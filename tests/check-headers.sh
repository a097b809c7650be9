#!/bin/sh
# Checks that each public header compiles alone, as C11 and as C++17. A C++ header compiles as C++17 only, and is skipped
# if the library that it adapts is not installed.
# usage: check-headers.sh INCLUDE_FOLDER CC CXX
include=$1 cc=$2 cxx=$3 bad=0
for header in "$include"/facetree/*.h; do
    $cc -std=c11 -Wall -Wextra -Wpedantic -Wstrict-prototypes -Werror -I "$include" -fsyntax-only -x c "$header" || bad=1
    $cxx -std=c++17 -Wall -Wextra -Wpedantic -Werror -I "$include" -fsyntax-only -x c++ "$header" || bad=1
done
for header in "$include"/facetree/*.hpp; do
    name=$(basename "$header" .hpp)
    case $name in openmesh) needs=OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh ;; *) needs= ;; esac
    if [ -n "$needs" ] && ! echo "#include <$needs>" | $cxx -std=c++17 -fsyntax-only -x c++ - 2>/dev/null; then continue; fi
    $cxx -std=c++17 -Wall -Wextra -Wshadow -Wpedantic -Werror -I "$include" -fsyntax-only -x c++ "$header" || bad=1
done
exit $bad

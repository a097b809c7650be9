#!/bin/sh
# Each public header compiles alone, as C11 and as C++17.
# usage: check-headers.sh INCLUDE_FOLDER CC CXX
include=$1 cc=$2 cxx=$3 bad=0
for header in "$include"/facetree/*.h; do
    $cc -std=c11 -Wall -Wextra -Wpedantic -Wstrict-prototypes -Werror -I "$include" -fsyntax-only -x c "$header" || bad=1
    $cxx -std=c++17 -Wall -Wextra -Wpedantic -Werror -I "$include" -fsyntax-only -x c++ "$header" || bad=1
done
exit $bad

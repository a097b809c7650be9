#!/bin/sh
# Checks rules of style that a search can find. Prints each line that breaks a rule, and fails if there is one.
# usage: check-words.sh [ROOT]
cd "${1:-$(dirname "$0")/..}" || exit 2
bad=0
sources() { find base mesh dual cluster partition bvh scene radiosity simplify "$@" -name '*.c' -o -name '*.h' -o -name '*.cpp' 2>/dev/null | sort; }
# forbid WHY PATTERN FILE...
forbid() {
    why=$1 pattern=$2
    shift 2
    [ $# -gt 0 ] || return 0
    if found=$(grep -nHE -e "$pattern" -- "$@"); then
        printf '%s\n' "$found" | sed "s|\$|   <- $why|"
        bad=1
    fi
}
everything=$(find base mesh dual cluster partition bvh scene radiosity simplify tools include tests bench examples docs cmake \
    CMakeLists.txt CMakePresets.json README.md CHANGELOG.md run test .ci -type f 2>/dev/null |
    grep -vE '^tests/check-words\.sh$|^tests/fuzz/(seeds|models)/|\.(png|svg|glb|ply|fct)$' | sort)
library=$(sources)
parallel='^base/parallel\.c$'
forbid 'unfinished work' '\b(TODO|FIXME|XXX|HACK)\b' $everything
forbid 'a path of one machine' '(^|[^A-Za-z0-9_.)}])/(work|root|home)/' $everything
forbid 'threads are made in base/parallel.c alone' '#[ 	]*pragma[ 	]+omp|\bpthread_|<threads\.h>|\bthrd_' \
    $(printf '%s\n' $library | grep -v "$parallel")
forbid 'the library never prints, exits or aborts' '\b(printf|puts|putchar|abort|exit|perror) *\(|\bfprintf *\( *(stdout|stderr)' \
    $library
forbid 'no hidden source of chance' '\b(s?rand|random|drand48) *\(' $library
forbid 'only base/env.c reads a clock' '\b(clock_gettime|gettimeofday|time|clock) *\(' \
    $(printf '%s\n' $library | grep -v '^base/env\.c$')
forbid 'an assertion that cannot fail' 'assert_(true|int_equal|non_null) *\( *(1|true) *[,)]' $everything
exit $bad

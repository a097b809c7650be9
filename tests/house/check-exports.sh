#!/bin/sh
# Checks that the shared library exports exactly the functions that the public headers declare with FCT_API.
# usage: check-exports.sh LIBRARY INCLUDE_FOLDER
found=$(mktemp) declared=$(mktemp)
trap 'rm -f "$found" "$declared"' EXIT
nm -D --defined-only --format=posix "$1" | cut -d ' ' -f 1 | sort -u >"$found"
cat "$2"/facetree/*.h | tr '\n' ' ' | grep -oE 'FCT_API[^;(]*\(' | grep -oE 'fct_[a-z0-9_]+ *\($' | tr -d ' (' | sort -u >"$declared"
[ -s "$declared" ] || { echo "no declarations in $2"; exit 1; }
diff "$declared" "$found" >/dev/null && exit 0
echo "< declared, not exported; > exported, not declared:"
diff "$declared" "$found" | grep '^[<>]'
exit 1

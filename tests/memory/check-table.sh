#!/bin/sh
# Checks that the tables of test_memory have each function of the public headers that returns an fct_result, and no others.
# usage: check-table.sh TEST_MEMORY INCLUDE_FOLDER
listed=$(mktemp) declared=$(mktemp)
trap 'rm -f "$listed" "$declared"' EXIT
"$1" --list | sort -u >"$listed"
cat "$2"/facetree/*.h | tr '\n' ' ' | grep -oE 'FCT_API +fct_result +fct_[a-z0-9_]+ *\(' | grep -oE 'fct_[a-z0-9_]+ *\($' |
    tr -d ' (' | sort -u >"$declared"
[ -s "$declared" ] || { echo "no declarations in $2"; exit 1; }
diff "$declared" "$listed" >/dev/null && exit 0
echo "< declared, not tested; > tested, not declared:"
diff "$declared" "$listed" | grep '^[<>]'
exit 1

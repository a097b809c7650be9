#!/bin/sh
# Runs the benchmark of queries on small meshes: the program fails unless Embree gives the same answers, but for rays at rims.
# usage: check.sh PROGRAMS WORK
set -eu
programs=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
for name in sphere terrain; do "$programs/facetree" make $name --triangles 1280 --quiet -o "$work/$name.ply"; done
"$programs/bench_queries" -n 1024 -p 500 -c 10 -i 16 -g 8 -b 8 -f 60 -r 2 -o "$work/rows.csv" "$work/sphere.ply" "$work/terrain.ply" \
    >"$work/table.txt"
# rows NAME COUNT: of both meshes, without the header
rows() {
    found=$(grep -c ",$1," "$work/rows.csv" || true)
    [ "$found" -eq "$2" ] || { echo "check: expected $2 rows '$1', found $found" >&2; exit 1; }
}
rows primary 16         # four sides, one and two threads
rows 'incoherent any' 16
rows 'box points' 12
rows touching 8
rows distance 8
rows 'all hits' 4
rows 'except a face' 8
rows inside 2
rows Hausdorff 2
rows 'eight nearest' 4
rows 'faces in ball' 4
rows 'faces in box' 4
rows 'all pairs' 4
rows within 4
rows relation 2
rows 'first contact' 4
rows 'slow path' 8
rows refit 2
rows 'self pairs' 2
rows 'distance field' 8
rows 'falling bodies' 2
if grep -q ' 0\.0 pairs' "$work/table.txt"; then echo 'check: no bodies touch' >&2; exit 1; fi
echo "all sides give the same answers"

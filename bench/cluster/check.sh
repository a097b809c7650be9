#!/bin/sh
# Runs the measuring programs on small meshes with figures that are known in closed form.
# usage: check.sh PROGRAMS WORK
set -eu
programs=$1 work=$2
tree=$programs/bench_cluster_tree shapes=$programs/bench_cluster_shapes
rm -rf "$work"
mkdir -p "$work"
# expect WHAT JSON KEY VALUE TOLERANCE
expect() {
    found=$(printf '%s' "$2" | sed -n "s/.*\"$3\": \([-+0-9.e]*\).*/\1/p")
    awk -v a="$found" -v b="$4" -v t="$5" 'BEGIN { exit !(a != "" && a - b <= t && b - a <= t) }' ||
        { echo "check: $1: expected $3 $4, found '$found'" >&2; exit 1; }
}
make() { "$programs/facetree" make "$1" --triangles "$2" --quiet -o "$work/$1.ply"; }

# A flat square in one cluster has no deviation, and perimeter^2 / (4 pi area) = 4 / pi.
make grid 2048
one=$("$tree" "$work/grid.ply" rounds 1 1)
expect "a square" "$one" deviation 0 1e-6
expect "a square" "$one" fit 0 1e-9
expect "a square" "$one" irregularity 1.27324 1e-4
# A closed surface in one cluster has the area vector 0. The mean squared deviation from any unit normal is 2.
make sphere 1280
one=$("$tree" "$work/sphere.ply" greedy 1 1)
expect "a sphere" "$one" deviation 2 1e-4
expect "a sphere" "$one" irregularity 0 1e-6
# A plane through the centre of a unit sphere: mean squared distance 1/3, squared diagonal 12.
expect "a sphere" "$one" fit 0.02778 3e-4
# With one cluster per face, all clusters are flat.
one=$("$tree" "$work/sphere.ply" rounds 2 1280)
expect "single faces" "$one" clusters 1280 0
expect "single faces" "$one" deviation 0 1e-6
# Cubes with one cluster per side have no deviation. Each shape has the requested number of faces, also after a shuffle.
"$shapes" cubes 120 "$work/cubes.ply"
expect "cubes" "$("$tree" "$work/cubes.ply" rounds 1 60)" deviation 0 1e-6
for shape in strip fan loose books; do
    "$shapes" $shape 500 "$work/$shape.ply"
    expect "$shape" "$("$tree" "$work/$shape.ply" rounds 1)" faces 500 0
done
"$shapes" subdivide 2 "$work/cubes.ply" "$work/finer.ply"
expect "subdivided cubes" "$("$tree" "$work/finer.ply" rounds 1)" faces 1920 0
"$programs/facetree" info "$work/finer.ply" | grep -q '^boundary_edges *0$' || { echo "check: subdivision tears edges" >&2; exit 1; }
make torso 3000
"$shapes" shuffle 5 "$work/torso.ply" "$work/shuffled.ply"
expect "a shuffled torso" "$("$programs/facetree" compare --json --samples 1 "$work/torso.ply" "$work/shuffled.ply")" e_max 0 1e-9
# The program fails unless all trees of boxes contain their faces and give the same answers.
"$programs/bench_cluster_boxes" "$work/torso.ply" 1 | grep -q '"aligned"'
"$programs/bench_cluster_boxes" "$work/cubes.ply" 1 | grep -q '"obbtree"'
echo "the measuring programs measure what they say"

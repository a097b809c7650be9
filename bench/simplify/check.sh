#!/bin/sh
# Runs the judge on small meshes whose figures are known, and the measuring programs that are built.
# usage: check.sh PROGRAMS WORK
set -eu
programs=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
cd "$work"
judge() { "$programs/bench_simplify_judge" 10 100000 "$@"; }
# expect WHAT JSON KEY VALUE [TOLERANCE]
expect() {
    found=$(printf '%s' "$2" | sed -n "s/.*\"$3\": \([-+0-9.e]*\).*/\1/p")
    awk -v a="$found" -v b="$4" -v t="${5:-0}" 'BEGIN { exit !(a != "" && a - b <= t && b - a <= t) }' ||
        { echo "check: $1: expected $3 $4, found '$found'" >&2; exit 1; }
}
# counts WHAT JSON DUPLICATES FLAT FOLDS NONMANIFOLD BORDERS: all defects; counts_new: those that the first mesh does not have
counts() { expect "$1" "$2" duplicates $3; expect "$1" "$2" flat $4; expect "$1" "$2" folds $5; expect "$1" "$2" nonmanifold $6; expect "$1" "$2" borders $7; }
counts_new() { expect "$1" "$2" new_duplicates $3; expect "$1" "$2" new_flat $4; expect "$1" "$2" new_folds $5; expect "$1" "$2" new_nonmanifold $6; expect "$1" "$2" new_borders $7; }
# obj NAME 'x y z' ... : faces ...
obj() {
    file=$1.obj kind=v
    shift
    for row; do
        if [ "$row" = : ]; then kind=f; else echo "$kind $row"; fi
    done >"$file"
}

# A square beside one that is .1 higher: the mean squared distance is .01, and the squared diagonal is 2.
obj square '0 0 0' '1 0 0' '1 1 0' '0 1 0' : '1 2 3' '1 3 4'
obj higher '0 0 .1' '1 0 .1' '1 1 .1' '0 1 .1' : '1 2 3' '1 3 4'
one=$(judge square.obj higher.obj)
expect "a higher square" "$one" e_avg .005 1e-8
expect "a higher square" "$one" e_max .0707107 1e-6
expect "a higher square" "$one" drift .0707107 1e-6
counts "a higher square" "$one" 0 0 0 0 4
counts_new "a higher square" "$one" 0 0 0 0 4 # .1 is farther than 2 % of the diagonal
# The same as what facetree compare says.
"$programs/facetree" make torso --triangles 3000 --quiet -o torso.ply
"$programs/bench_simplify_facetree" default torso.ply 300 1 small.ply >small.json
expect "a simplified torso" "$(cat small.json)" reached 300
one=$(judge torso.ply small.ply)
other=$("$programs/facetree" compare torso.ply small.ply --samples 10 --seed 1 --json)
for pair in e_avg:e_avg_relative e_max:e_max_relative; do
    value=$(printf '%s' "$other" | sed -n "s/.*\"${pair#*:}\": *\([-+0-9.e]*\).*/\1/p")
    expect "a simplified torso" "$one" "${pair%:*}" "${value:-none}" "$(awk -v x="${value:-0}" 'BEGIN { print 1e-4 * x }')"
done
counts "a simplified torso" "$one" 0 0 0 0 0

# Two faces at an edge with 25 degrees between them are folded, with 27 degrees not; the apex is at (cos, sin) of the angle.
obj fold25 '0 0 0' '0 0 1' '1 0 .3' '.9063078 .4226183 .6' : '1 2 3' '2 1 4'
obj fold27 '0 0 0' '0 0 1' '1 0 .3' '.8910065 .4539905 .6' : '1 2 3' '2 1 4'
obj flat180 '0 0 0' '0 0 1' '1 0 .3' '-1 0 .6' : '1 2 3' '2 1 4'
counts "25 degrees" "$(judge flat180.obj fold25.obj)" 0 0 1 0 4
counts "27 degrees" "$(judge flat180.obj fold27.obj)" 0 0 0 0 4
counts_new "25 degrees, as before" "$(judge fold25.obj fold25.obj)" 0 0 0 0 0
expect "25 degrees, not before" "$(judge flat180.obj fold25.obj)" new_folds 1
# Angles count from the first apex, which is opposite: the two others are at 170 and -170 degrees. All faces wind in one direction.
obj wound '0 0 0' '0 0 1' '-1 0 .5' '.9848078 .1736482 .3' '.9848078 -.1736482 .6' : '1 2 5' '1 2 3' '1 2 4'
counts "across 180 degrees" "$(judge flat180.obj wound.obj)" 0 0 1 1 6

# Three faces at one edge, the third of them new. Its third corner is far from the borders of the first two.
obj three '0 0 0' '0 0 1' '1 0 .3' '-1 0 .6' '0 -1 .5' : '1 2 3' '2 1 4' '1 2 5'
one=$(judge flat180.obj three.obj)
counts "three faces" "$one" 0 0 0 1 6
counts_new "three faces" "$one" 0 0 0 1 2
counts_new "three faces, as before" "$(judge three.obj three.obj)" 0 0 0 0 0

# Duplicates count once each, in either direction, and make no fold, border or edge of three faces.
obj twice '0 0 0' '1 0 0' '1 1 0' '0 1 0' : '1 2 3' '1 3 4' '3 2 1' '2 3 1'
one=$(judge square.obj twice.obj)
expect "the input of duplicates" "$(judge twice.obj square.obj)" input_duplicates 2
counts duplicates "$one" 2 0 0 0 4
counts_new duplicates "$one" 2 0 0 0 0
# Faces without area: a repeated corner, two vertices at one place, corners on a line that is not an axis.
obj thin '0 0 0' '1 0 0' '1 1 0' '0 1 0' '0 0 0' '.1 .3 .7' '.2 .6 1.4' '.4 1.2 2.8' : '1 2 3' '1 3 4' '1 1 2' '1 5 3' '6 7 8'
counts "faces without area" "$(judge square.obj thin.obj)" 0 3 0 0 7
# A face without area makes no fold, but it is a third face at its edge.
obj third '0 0 0' '1 0 0' '1 1 0' '0 1 0' '.5 .5 0' : '1 2 3' '1 3 4' '1 3 5'
counts "a third face without area" "$(judge square.obj third.obj)" 0 1 0 1 6
# A needle has area.
obj needle '0 0 0' '1 0 0' '.5 1e-6 0' : '1 2 3'
expect "a needle" "$(judge square.obj needle.obj)" flat 0
# Vertices at one place are one point: a square of two loose triangles has four borders, two squares have seven.
obj loose '0 0 0' '1 0 0' '1 1 0' '0 0 0' '1 1 0' '0 1 0' : '1 2 3' '4 5 6'
one=$(judge square.obj loose.obj)
counts "doubled vertices" "$one" 0 0 0 0 4
expect "doubled vertices" "$one" e_max 0 1e-12
# One corner is .1 too far: the border drifts by .1 and the diagonal is the root of 2.
obj moved '0 0 0' '1.1 0 0' '1 1 0' '0 1 0' : '1 2 3' '1 3 4'
expect "a moved corner" "$(judge square.obj moved.obj)" drift .0707107 1e-6
"$programs/facetree" make box --quiet -o box.ply
expect "a moved corner, the other way" "$(judge moved.obj square.obj)" drift .0672673 1e-6
# The hypotenuse of half a square has its ends on the old border and its middle far from it.
obj half '0 0 0' '1 0 0' '0 1 0' : '1 2 3'
expect "half a square" "$(judge square.obj half.obj)" new_borders 1
# A defect is new beyond 2 % of the diagonal (.02828), and beyond half of its longest side (.04 / 2).
obj up277 '0 0 .0277' '1 0 .0277' '1 1 .0277' '0 1 .0277' : '1 2 3' '1 3 4'
obj up290 '0 0 .029' '1 0 .029' '1 1 .029' '0 1 .029' : '1 2 3' '1 3 4'
expect "within 2 %" "$(judge square.obj up277.obj)" new_borders 0
expect "beyond 2 %" "$(judge square.obj up290.obj)" new_borders 4
obj corner '0 0 0' '1 0 0' '1 1 0' '0 1 0' '2 0 0' '2.04 0 0' '2 .04 0' : '1 2 3' '1 3 4' '5 6 7'
obj up194 '2 0 .0194' '2.04 0 .0194' '2 .04 .0194' : '1 2 3'
obj up206 '2 0 .0206' '2.04 0 .0206' '2 .04 .0206' : '1 2 3'
expect "within half a side" "$(judge corner.obj up194.obj)" new_borders 0
expect "beyond half a side" "$(judge corner.obj up206.obj)" new_borders 2 # the hypotenuse is longer
expect "a border that is gone" "$(judge square.obj box.ply)" drift -1
counts "a box" "$(judge box.ply box.ply)" 0 0 0 0 0

# A colour that is .3 darker everywhere in one channel has an RMS of .3 / sqrt 3 over the channels.
ply() {
    echo ply; echo 'format ascii 1.0'; echo 'element vertex 4'
    for p in x y z red green blue; do echo "property float $p"; done
    echo 'element face 2'; echo 'property list uchar int vertex_indices'; echo end_header
    for p in '0 0 0' '1 0 0' '1 1 0' '0 1 0'; do echo "$p $1"; done
    echo '3 0 1 2'; echo '3 0 2 3'
}
ply '.5 .8 .2' >bright.ply
ply '.5 .5 .2' >dark.ply
expect "a darker square" "$(judge bright.ply dark.ply)" color_rms .173205 1e-5
"$programs/bench_simplify_shapes" paint torso.ply painted.ply
expect "painted" "$(judge painted.ply painted.ply)" color_rms 0 1e-6

# A cube without noise is a cube: 12,288 triangles, closed; with 1 % noise, no vertex is farther than 1 % of the diagonal.
"$programs/bench_simplify_shapes" cube 0 cube.ply
one=$(judge box.ply cube.ply)
expect "a cube" "$one" faces 12288
counts "a cube" "$one" 0 0 0 0 0
"$programs/bench_simplify_shapes" cube 1 noisy.ply
one=$(judge cube.ply noisy.ply)
expect "a cube with noise" "$one" e_max .0095 .00051
counts "a cube with noise" "$one" 0 0 0 0 0

# Every library reaches the target on a closed mesh, and gives a mesh near the original. Those that are not built are left out.
for side in meshopt:default cgal:plane cgal:triangle openmesh:default facetree:norefit facetree:subset facetree:shape; do
    program=$programs/bench_simplify_${side%:*}
    [ -x "$program" ] || continue
    one=$("$program" "${side#*:}" torso.ply 300 1 out.ply)
    expect "$side" "$one" reached 299 1
    one=$(judge torso.ply out.ply)
    expect "$side" "$one" faces 299 1
    expect "$side" "$one" e_avg 5e-5 5e-5
done
# A library that takes manifolds only refuses three faces at an edge.
for side in cgal:plane openmesh:default; do
    [ -x "$programs/bench_simplify_${side%:*}" ] || continue
    "$programs/bench_simplify_${side%:*}" "${side#*:}" three.obj 1 1 | grep -q '"refused": "not an oriented manifold"' ||
        { echo "check: $side takes three faces at an edge" >&2; exit 1; }
done
echo "the judge counts what is there"

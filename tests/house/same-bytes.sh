#!/usr/bin/env bash
# Runs a fixed set of commands with every variant, with one and eight threads, on emulated old processors, and with a second
# program, if one is given, that another compiler built. All runs must write files with the same bytes. The comparison ignores
# times and memory in text output.
# usage: same-bytes.sh PROGRAM [OTHER_PROGRAM]
set -u
program=$(realpath "$1")
other=${2:+$(realpath "$2")}
here=$(mktemp -d "${TMPDIR:-/tmp}/facetree-bytes-XXXXXX")
trap 'rm -rf "$here"' EXIT
cd "$here" || exit 2
bad=0 runs=0

# make_inputs FOLDER TRIANGLES: a mesh, a scene, and rays, points and poses on all sides of the mesh (.6 x .95 x .4, on y = 0).
make_inputs() {
    mkdir -p "$1" && cd "$1" || exit 2
    "$program" make bust -o mesh.ply --triangles "$2" --quiet || exit 2
    "$program" make cornell -o cornell --triangles 100 --quiet || exit 2
    awk 'BEGIN { for (i = 0; i < 400; ++i) printf "%.6f %.6f 3 %.6f %.6f -1\n", sin(i) / 3, .5 + cos(3 * i) / 2, sin(7 * i) / 20, cos(5 * i) / 20 }' >rays.txt
    awk 'BEGIN { for (i = 0; i < 400; ++i) printf "%.6f %.6f %.6f\n", sin(i) / 3, .5 + cos(3 * i), sin(7 * i) / 3 }' >points.txt
    awk 'BEGIN { for (i = 0; i < 400; ++i) printf "%.9f %.9f 0 %.6f %.9f %.9f 0 %.6f 0 0 1 %.6f\n",
        cos(i), -sin(i), sin(i) / 2, sin(i), cos(i), cos(3 * i), sin(7 * i) / 3 }' >poses.txt
    cat >stretched.json <<END
{"models": {"m": "mesh.ply"}, "materials": {"white": {"reflectance": 0.5}},
 "instances": [{"model": "m", "material": "white", "transform": [1, 0.3, 0, 0, 0, 0.7, 0.1, 0, 0.2, 0, 1.4, 0, 0, 0, 0, 1]},
               {"model": "m", "material": "white", "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.4, 0, 0, 1]}]}
END
    cd "$here" || exit 2
}

# write_outputs INPUTS FOLDER BAKE_OPTIONS COMMAND...: COMMAND is the program, with its emulator if there is one.
write_outputs() {
    local in=$here/$1 out=$2 light=$3 method cost measure
    shift 3
    mkdir -p "$out"
    { # a failure leaves a file out, which the comparison finds
        for method in rounds greedy; do
            for cost in increment mean; do
                "$@" cluster "$in/mesh.ply" -o "$out/$method-$cost.fct" --method $method --cost $cost --quiet
            done
        done
        "$@" cluster "$in/mesh.ply" -o "$out/points.fct" --fit-measure points --quiet
        "$@" partition "$in/mesh.ply" -k 40 --refine 5 -o "$out/refined.txt" --quiet
        "$@" partition "$in/mesh.ply" --charts 60 -o "$out/charts.txt" --quiet
        "$@" meshlets "$in/mesh.ply" -o "$out/meshlets.bin" --quiet
        "$@" boxes "$in/mesh.ply" -k 30 -o "$out/boxes.txt" --quiet
        "$@" raycast "$in/mesh.ply" --rays "$in/rays.txt" -o "$out/hits.txt" --quiet
        "$@" raycast "$in/mesh.ply" --rays "$in/rays.txt" --all -o "$out/all-hits.txt" --quiet
        "$@" raycast "$in/stretched.json" --rays "$in/rays.txt" --all -o "$out/scene-hits.txt" --quiet
        "$@" closest "$in/mesh.ply" --points "$in/points.txt" -o "$out/closest.txt" --quiet
        "$@" closest "$in/stretched.json" --points "$in/points.txt" -o "$out/stretched.txt" --quiet
        "$@" closest "$in/mesh.ply" --points "$in/points.txt" --signed -o "$out/signed.txt" --quiet
        for measure in pairs contacts distance; do
            "$@" collide "$in/mesh.ply" "$in/mesh.ply" --poses "$in/poses.txt" --$measure -o "$out/$measure.txt" --quiet
        done
        # shellcheck disable=SC2086 # a list of words
        "$@" bake "$in/cornell/scene.json" $light --light radiosity,direct,error -o "$out/lit.ply" --also "$out/lit.glb" --quiet
        "$@" simplify "$in/mesh.ply" --ratio .2 -o "$out/fewer.ply" --progressive "$out/fewer.fpm" --quiet
        "$@" simplify "$out/lit.ply" --ratio .3 -o "$out/fewer-lit.glb" --save-state "$out/fewer-lit.fst" --quiet
        "$@" simplify "$out/lit.ply" --primitive face --ratio .1 -o "$out/fewer-faces.ply" --quiet
        "$@" compare "$in/mesh.ply" "$out/fewer.ply" --samples 2 | grep -vE 'seconds|bytes' >"$out/compare.txt"
    } 2>"$out.err"
}

# compare NAME FIRST
compare() {
    runs=$((runs + 1))
    diff -rq "$2" "$1" >"$1.diff" && return
    bad=1
    echo "FAILED: $1 differs from $2:"
    cat "$1.diff" "$1.err"
}

fine="--error 1e-3" coarse="--error 1e-2 --max-edge .5" # an emulated processor is 40 times slower
make_inputs inputs 12000
make_inputs small 1500
FACETREE_SIMD=baseline write_outputs inputs first "$fine" "$program"
[ "$(find first -type f -size +0 | wc -l)" = 26 ] || { echo "expected 26 files of the first run, found:"; ls -l first; cat first.err; exit 1; }
variants=baseline
FACETREE_SIMD=avx2 "$program" --version >/dev/null 2>&1 && variants="baseline avx2"
threads() { "$@" --threads "$count"; }
for variant in $variants; do
    for count in 1 8; do
        FACETREE_SIMD=$variant write_outputs inputs "$variant-$count-threads" "$fine" threads "$program"
        compare "$variant-$count-threads" first
    done
    [ -z "$other" ] && continue
    FACETREE_SIMD=$variant write_outputs inputs "$variant-other-compiler" "$fine" "$other"
    compare "$variant-other-compiler" first
done
# --max-memory is below the size of the mesh, so the hierarchy is built in parts.
for variant in $variants; do
    FACETREE_SIMD=$variant "$program" make bust -o large.ply --triangles 300000 --quiet
    FACETREE_SIMD=$variant "$program" cluster large.ply -o "large-$variant.fct" --max-memory 60M --quiet
    runs=$((runs + 1))
    [ -s "large-$variant.fct" ] && cmp large-baseline.fct "large-$variant.fct" || bad=1
done
write_outputs small small-first "$coarse" "$program"
if command -v qemu-x86_64 >/dev/null; then
    for processor in Nehalem core2duo; do
        write_outputs small "$processor" "$coarse" qemu-x86_64 -cpu "$processor" "$program"
        compare "$processor" small-first
    done
else
    echo "qemu-x86_64 is not installed: no old processor was emulated"
    [ $bad = 0 ] && exit 77
fi
echo "$runs comparisons"
exit $bad

# tests/render/test_command.sh: `facetree render` from outside. Every kind of input makes a PNG of the requested size, with the
# same bytes on every run. Errors give the right exit code and leave no file.
# usage: test_command.sh PROGRAM [SANITIZERS]
facetree=$1 sanitizers=${2:-}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 2
bad=0
fail() { echo "FAILED: $*"; bad=1; }
# Width, height and colour type from the header of a PNG.
header() { od -An -tu1 -j16 -N10 "$1" | awk '{ print ($1 * 16777216 + $2 * 65536 + $3 * 256 + $4) "x" ($5 * 16777216 + $6 * 65536 + $7 * 256 + $8), $10 }'; }
# The size of a file in bytes: a blank picture compresses to few.
bytes() { wc -c <"$1"; }
# draws NAME LEAST-BYTES ARGUMENT...: a picture of 120x90 that is not blank
draws() {
    name=$1 least=$2
    shift 2
    "$facetree" render "$@" --size 120x90 --quiet -o "$name.png" || { fail "render $*: exit code $?"; return; }
    "$facetree" render "$@" --size 120x90 --quiet --threads 1 -o again.png || fail "render $* again: exit code $?"
    cmp -s "$name.png" again.png || fail "render $*: another picture the second time"
    [ "$(header "$name.png")" = "120x90 2" ] || fail "render $*: header $(header "$name.png")"
    [ "$(bytes "$name.png")" -ge "$least" ] || fail "render $*: only $(bytes "$name.png") bytes, a blank picture?"
}
# refuses CODE ARGUMENT...: one line on stderr, that exit code, no file
refuses() {
    wanted=$1
    shift
    rm -f out.png
    "$facetree" render "$@" -o out.png 2>errors
    code=$?
    [ $code -eq "$wanted" ] || fail "render $*: exit code $code, expected $wanted"
    [ "$(wc -l <errors)" -eq 1 ] || fail "render $*: $(wc -l <errors) lines on stderr"
    [ ! -e out.png ] || fail "render $*: left a file"
}

"$facetree" make sphere --triangles 500 -o sphere.ply --quiet || exit 2
"$facetree" make cornell -o cornell --quiet || exit 2
scene=cornell/scene.json
[ -f $scene ] || scene=cornell
"$facetree" cluster sphere.ply -o sphere.fct --quiet || exit 2
printf 'OFF\n0 0 0\n' >empty.off
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float radiosity_r\nproperty float radiosity_g\nproperty float radiosity_b\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n3 0 1 2\n' >lit.ply

draws sphere 2000 sphere.ply
draws flat 2000 sphere.ply --shading flat
draws wires 4000 sphere.ply --wireframe
draws tree 2000 sphere.fct
draws clusters 3000 sphere.fct --clusters 20
draws clusters_of_mesh 3000 sphere.ply --clusters 20
draws boxes 2000 sphere.fct --boxes 20
draws scene 1000 "$scene"
draws scene_clusters 1000 "$scene" --clusters 30
draws scene_boxes 1000 "$scene" --boxes 30
draws camera 1000 sphere.ply --scene "$scene" --background '#102030'
draws eye 1000 sphere.ply --camera 0,0,3,0,0,0,40
draws lit 1000 lit.ply
"$facetree" bake "$scene" -o errors.glb --light radiosity,error --quality draft --also errors.ply --quiet || exit 2
for kind in ply glb; do
    draws errors_$kind 1500 errors.$kind --scene "$scene" --show error
    cmp -s errors_$kind.png scene.png && fail "the error of a $kind looks like light"
done
draws coarse 1500 errors.ply --scene "$scene" --show error --range 50
cmp -s errors_ply.png coarse.png && fail "--range makes no difference"
cmp -s errors_ply.png errors_glb.png || fail "errors of .ply and .glb differ"
"$facetree" render errors.ply --show error --range 12.5 --size 400x300 --json -o out.png | grep -q '"range": 12.5' || fail "no range in the JSON"
draws empty 100 empty.off
for view in corner front back left right top bottom; do draws $view 1500 sphere.ply --view $view --up z; done
for tone in soft filmic clamp; do draws $tone 1000 lit.ply --tone $tone --exposure 3; done
cmp -s clusters.png clusters_of_mesh.png || fail "clusters of a mesh are not those of its hierarchy"
cmp -s soft.png clamp.png && fail "tone curves make no difference"
cmp -s sphere.png flat.png && fail "smooth and flat shading are the same"
"$facetree" render sphere.ply --size 120x90 --samples 1 --quiet -o rough.png
[ "$(bytes rough.png)" -lt "$(bytes sphere.png)" ] || fail "samples make no difference"
"$facetree" render sphere.ply --size 33x44 --background none --quiet -o clear.png
[ "$(header clear.png)" = "33x44 6" ] || fail "a transparent picture: header $(header clear.png)"
"$facetree" render sphere.ply --size 33x44 --background none -o - >piped.png && cmp -s clear.png piped.png || fail "a piped picture is another"
"$facetree" render sphere.ply --size 33x44 --json -o out.png | grep -q '"faces": 5' || fail "no faces in the JSON"

refuses 64 sphere.ply --size 0x10
refuses 64 sphere.ply --size 10
refuses 64 sphere.ply --size 99999x10
refuses 64 sphere.ply --clusters 0
refuses 64 sphere.ply --clusters 3 --boxes 3
refuses 64 sphere.ply --camera 1,2,3
refuses 64 sphere.ply --camera 0,0,0,0,0,0
refuses 64 sphere.ply --camera 0,0,1,0,0,nan
refuses 64 sphere.ply --camera 0,0,3,0,0,0 --view top
refuses 64 sphere.ply --tone warm
refuses 64 sphere.ply --background blue
refuses 64 sphere.ply --samples 65
refuses 64 sphere.ply other.ply
refuses 64 sphere.ply --show noise
refuses 64 sphere.ply --range 5
refuses 64 errors.ply --show error --range 0
refuses 64 errors.ply --show error --clusters 5
refuses 64 errors.ply --show error --shading flat
for input in sphere.ply sphere.fct lit.ply "$scene"; do
    refuses 65 "$input" --show error
    grep -q 'bake --light radiosity,error' errors || fail "$input without error: $(cat errors)"
done
refuses 66 missing.ply
refuses 66 sphere.ply --scene missing.json
refuses 65 empty.off --clusters 3
# The memory of a sanitizer does not fit into the limit.
[ -n "$sanitizers" ] || refuses 75 sphere.ply --max-memory 1M
"$facetree" render sphere.ply -o no-such-folder/out.png 2>errors
[ $? -eq 73 ] || fail "an unwritable output"
exit $bad

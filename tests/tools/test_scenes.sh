# tests/tools/test_scenes.sh: bake, probes, rays and counts of scenes, and mistakes in scene files.
source "$(dirname "$0")/support.sh"
sphere 12 | awk 'NF == 4 { print $1, $2, $4, $3; next } { print }' >inside.off # looks inwards
cube 1 >cube.off

scene() { # scene MATERIAL [INSTANCE] [MODEL]
    cat <<END
{
  "models": {"room": "${3:-inside.off}", "box": "cube.off"},
  "materials": {"wall": $1},
  "instances": [
    {"name": "room", "model": "room", "material": "wall"${2:-}}
  ]
}
END
}
furnace='{"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}'
scene "$furnace" >furnace.json
expect 0 info furnace.json --json
keys faces objects instances materials
holds "$(value faces) == 528 && $(value instances) == 1 && $(value emitting_instances) == 1"

{ printf '\357\273\277'; cat furnace.json; } >marked.json
expect 0 info marked.json --json
check "a byte order mark" test "$(value faces)" = 528

# A texture: its picture is a render. The cube has no texture coordinates, the square has.
printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n' >square.obj
expect 0 render cube.off -o cube.png --size 64x48
scene '{"texture": "cube.png", "emission": 1}' '}, {"name": "lid", "model": "room", "material": "wall",
    "translate": [0, 1, 1], "rotate": {"axis": [1, 0, 0], "degrees": 180}' square.obj >painted.json
expect 0 info painted.json
check "info lists textures" grep -q '^textures cube.png  *64 48$' out
expect 0 bake painted.json -o painted.ply --max-edge .2 --json
check "bake counts textures" test "$(value textures)" = 1
expect 0 bake painted.json -o plain.ply --max-edge .2 --no-textures --json
check "--no-textures uses none" test "$(value textures)" = 0
check "and gives another result" sh -c '! cmp -s painted.ply plain.ply'
expect 0 render painted.json -o painted.png --size 32x32
scene '{"texture": "cube.png", "emission": 1}' >bare.json
expect 0 bake bare.json -o bare.ply --max-edge 1
check "a texture without coordinates is reported" grep -q 'a texture but no texture coordinates' err

# A closed furnace: radiosity 1 / (1 - rho) = 2 everywhere.
printf '# position, normal\n0 0 -1  0 0 1\n0 0 0  1 0 0\n' >probes.txt
expect 0 bake furnace.json -o lit.ply --probe probes.txt --json
keys method converged passes elements links rays seconds open solve push total peak_bytes touched_bytes power emitted absorbed escaped error_estimate probes radiosity irradiance
keys objects check_rays error outputs
check "it converged" test "$(value converged)" = true
tr -d ' \n' <out >flat
radiosity=$(sed 's/.*"probes":\[{"position":\[[^]]*\],"radiosity":\[\([^],]*\),.*/\1/' flat)
holds "$radiosity > 1.96 && $radiosity < 2.04"
holds "($(value emitted) - $(value absorbed) - $(value escaped)) ^ 2 < ($(value emitted) / 100) ^ 2"
check "the probe lies on the room" grep -q '"object": "room"' out
expect 0 info lit.ply --json
check "the bake has colours" test "$(value vertex_colors)" = true
printf "# a comment\n0 0 -1  0 0 1\n\n0 0 0  0 0 0\n" >bad-probes.txt
expect 65 bake furnace.json --probe bad-probes.txt
says "bad-probes.txt:4: expected a normal"
expect 0 bake furnace.json --probe - <probes.txt
check "probes without -o are printed" grep -q '^probe 0 0 -1: radiosity' out
expect 0 bake furnace.json -o lit.glb --visibility embree --final direct --error 5e-5 --exposure .5 --max-edge .5 --quiet
expect 0 bake furnace.json -o lit.glb --final none --json
expect 0 bake furnace.json --method reference --samples 64 --probe probes.txt --json
check "the method is named" test "$(value method)" = reference

expect 0 make cornell -o cornell --triangles 100 --quiet

# A target for the error: bakes until the estimate is there, with more rays each time.
budgets() {
    expect 0 bake cornell/scene.json -o lit.ply --max-edge .15 --error 3% --json
    holds "$(value error_estimate) > 0 && $(value error_estimate) <= .03"
    holds "$(value error) < 2e-5 && $(value check_rays) > 1000"
    check "objects have errors" grep -q '"object": "tall_block"' out

    # A limit on the links: the same bytes for any number of threads, a warning, and the power balance, whose noise
    # here is .3 %.
    expect 0 bake cornell/scene.json -o full.ply --final none --json
    check "no limit by default" test "$(value links_limited)" = false
    links=$(value links)
    expect 0 bake cornell/scene.json -o half.ply --final none --max-links $((links / 2)) --threads 1 --json
    says "links are too few for this scene"
    check "the limit is named" test "$(value max_links)" = $((links / 2)) -a "$(value links_limited)" = true
    holds "$(value links) <= $links / 2 && $(value links) > $links / 2 - 16 && $(value link_error) > 2e-5"
    holds "$(value link_error) < 8e-5"
    holds "($(value absorbed) + $(value escaped)) / $(value emitted) > .99 && ($(value absorbed) + $(value escaped)) / $(value emitted) < 1.01"
    expect 0 bake cornell/scene.json -o half2.ply --final none --max-links $((links / 2)) --threads 2 --quiet
    check "threads do not matter" cmp half.ply half2.ply
}
[ "$scale" != 1 ] || budgets # other tests run this code with sanitizers
expect 64 bake cornell/scene.json --probe probes.txt --error 2%
expect 64 bake cornell/scene.json -o x.ply --max-links 999
expect 64 bake cornell/scene.json -o x.ply --max-links 1000.5
expect 64 bake cornell/scene.json -o lit.ply --method reference --error 2%
expect 64 bake cornell/scene.json -o lit.ply --error 0%
expect 64 bake cornell/scene.json -o - --error 2%

# A baked .glb is a scene again: its white materials keep their reflectance.
[ "$scale" = 1 ] && edge=.06 || edge=.15
expect 0 bake cornell/scene.json -o again.glb --max-edge $edge --json
absorbed=$(value absorbed)
expect 0 bake again.glb -o twice.ply --max-edge $edge --json
holds "$(value absorbed) > .98 * $absorbed && $(value absorbed) < 1.02 * $absorbed"
expect 0 bake furnace.json -o - --quiet
check "a PLY on standard output" test "$(head -c 3 out)" = ply
for bad in '0 0 0 1 0' '0 0 0 0 0 x' '0 0 0 0 0 0' '0 0 nan 0 0 1'; do
    echo "$bad" >bad.txt
    expect 65 bake furnace.json --probe bad.txt
    says "bad.txt"
done
expect 66 bake furnace.json --probe missing.txt

# Other quantities: in the furnace E = 2, direct 1 and indirect 1; the first one makes the colours.
expect 0 bake furnace.json -o some.ply --light irradiance,direct,indirect --source --json
check "the outputs are listed" grep -q '"irradiance",' out
head -n 25 some.ply | grep -a '^property' | tr '\n' ' ' >layout
check "the layout" grep -q 'uchar blue property float irradiance_r .* direct_b property float indirect_r .*indices property int source_face property list uchar float source_uv $' layout
check "no radiosity" test "$(grep -c radiosity layout)" = 0
expect 0 bake furnace.json -o plain.ply --light radiosity
expect 0 bake furnace.json -o lit.ply
check "radiosity is the default" cmp -s plain.ply lit.ply
expect 0 compare some.ply lit.ply --json # both are 2
holds "$(value color_rms) < .02"
expect 0 bake furnace.json -o some.glb --light direct,radiosity
for name in _DIRECT _RADIOSITY KHR_materials_unlit; do check "$name" grep -qa "$name" some.glb; done
expect 0 info some.glb
expect 0 bake furnace.json -o some.ply --light radiosity,error --json
check "the error is listed" grep -q '"error"' out
check "its property" grep -qa '^property float error$' some.ply
expect 0 simplify some.ply --ratio .5 -o fewer.ply
check "simplify keeps it" grep -qa '^property float error$' fewer.ply
check "lit.ply has none" test "$(grep -ca 'property float error' lit.ply)" = 0
expect 0 bake furnace.json -o some.glb --light radiosity,error
check "its attribute" grep -qa _ERROR some.glb
expect 64 bake furnace.json -o x.ply --light error,radiosity
says "found 'error'"
expect 64 bake furnace.json -o x.ply --light irradiance,error
says "needs it"
expect 65 bake furnace.json -o x.ply --light radiosity,error --method reference
expect 65 bake furnace.json -o x.ply --light radiosity,error --final none
expect 64 bake furnace.json -o x.ply --light direct,direct
says "'direct' twice"
expect 64 bake furnace.json -o x.ply --light ''
expect 64 bake furnace.json -o x.ply --light albedo
expect 65 bake furnace.json -o x.ply --light direct --final none
expect 65 bake furnace.json -o x.ply --light indirect --method reference
says "radiosity and irradiance"
check "no file" test ! -e x.ply

# --keep-mesh: the faces of the input; colours of faces in every format.
for how in vertex corner face; do
    for form in ply off glb obj; do
        expect 0 bake furnace.json -o kept.$form --keep-mesh $how --quality draft
        expect 0 info kept.$form --json
        holds "$(value faces) == 528"
        [ $how = corner ] || [ $how$form = faceglb ] || [ $how$form = faceobj ] || holds "$(value vertices) == 266"
    done
    expect 0 compare kept.glb lit.ply --json
    holds "$(value color_rms) < .06"
done
expect 0 info kept.glb --json
holds "$(value vertices) == 3 * 528"
expect 64 bake furnace.json -o kept.ply --keep-mesh edge
expect 65 bake furnace.json -o kept.ply --keep-mesh face --light irradiance

# A folder receives one file per object.
cat >two.json <<'END'
{"models": {"room": "inside.off", "box": "cube.off"},
 "materials": {"wall": {"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}, "grey": {"reflectance": [0.3, 0.3, 0.3]}},
 "instances": [{"name": "room", "model": "room", "material": "wall"},
               {"name": "left/box", "model": "box", "material": "grey", "translate": [-0.4, 0, 0], "scale": 0.2},
               {"name": "right", "model": "box", "material": "grey", "translate": [0.4, 0, 0], "scale": 0.2}]}
END
expect 0 bake two.json -o lit/ --json
check "a file an object" test "$(ls lit | tr '\n' ' ')" = "left_box.ply right.ply room.ply "
for file in lit/*.ply; do expect 0 info "$file"; done
printf '0 0 0 1 0 0\n0 0 0 0 0 1\n9 9 9 1 0 0\n' >rays.txt
expect 0 raycast two.json --rays rays.txt
check "rays through a scene" test "$(awk '{ print $1 < 0 ? -1 : $1 }' out | tr '\n' ' ')" = "2 0 -1 "
expect 0 raycast two.json --rays rays.txt --all
check "all hits in a scene" test "$(awk '$1 != p { print $1, $2 < 0 ? -1 : $2; p = $1 }' p=-1 out | tr '\n' ' ')" = "0 2 1 0 2 -1 "
check "all hits of a scene are sorted" sort -s -c -k 1,1n -k 4,4g out
expect 0 raycast two.json --rays rays.txt --all --json
holds "$(value rays_hit) == 2 && $(value hits) >= 2"
expect 65 raycast two.json --rays rays.txt --attributes uv
says 'two.json: model "'
expect 0 raycast two.json --rays rays.txt --occlusion --backend embree
check "occlusion in a scene" test "$(tr '\n' ' ' <out)" = "1 1 0 "
echo '.1 0 0' >points.txt
expect 0 closest two.json --points points.txt
check "nearest point of a scene" test "$(awk '{ print $1 }' out)" = 2
holds "$(awk '{ print $6 }' out) > .199 && $(awk '{ print $6 }' out) < .201"

# --- Mistakes: one line that names the file, exit code 65 or 66, no output ---
refused() {
    local wanted=$1 file=$2
    expect "$wanted" bake "$file" -o bad.glb
    says "$file"
    expect "$wanted" info "$file"
    expect "$wanted" raycast "$file" --rays rays.txt
    check "no output of $file" test ! -e bad.glb
}
grey='{"reflectance": [0.5, 0.5, 0.5]}'
: >empty.json
echo '{"models": {' >cut.json
echo 'words' >words.json
echo '[]' >array.json
echo '{}' >nothing.json
scene '{"reflectance": [1, 0.5, 0.5]}' >one.json
scene '{"reflectance": [1.5, 0.5, 0.5]}' >more.json
scene '{"reflectance": [-0.1, 0.5, 0.5]}' >less.json
scene '{"reflectance": [0.5, 0.5]}' >two-numbers.json
scene '{"reflectance": "red"}' >word.json
scene '{"reflectance": [0.5, 0.5, 0.5], "emission": [-1, 0, 0]}' >negative.json
scene '{"reflectance": [0.5, 0.5, 0.5], "emission": [1e999, 0, 0]}' >infinite.json
scene '{"reflectance": [0.5, 0.5, 0.5], "emission": [NaN, 0, 0]}' >nan.json
scene '{"reflectence": [0.5, 0.5, 0.5]}' >misspelt.json
scene "$grey" ', "transform": [1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]' >singular.json
scene "$grey" ', "transform": [1,0,0,0, 0,1,0,0]' >eight.json
scene "$grey" ', "scale": 0' >flat.json
scene "$grey" ', "material": "gold"' >double.json
scene "$grey" | sed 's/"material": "wall"/"material": "gold"/' >gold.json
scene "$grey" | sed 's/"model": "room"/"model": "hall"/' >hall.json
for file in empty cut words array nothing one more less two-numbers word negative infinite nan misspelt singular eight flat gold hall; do
    refused 65 $file.json
done
expect 65 bake cut.json -o bad.glb
check "a place in the file" grep -qE 'cut.json:[0-9]+' err
scene "$grey" '' missing.off >missing.json
expect 66 bake missing.json -o bad.glb
says "missing.off"
expect 66 bake nowhere.json -o bad.glb
says "nowhere.json"
echo broken >broken.off
scene "$grey" '' broken.off >broken.json
expect 65 bake broken.json -o bad.glb
says "broken.off"
printf 'mtllib nowhere.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n' >no-mtl.obj
expect 0 render no-mtl.obj -o grey.png --size 16x16
says '1 material libraries cannot be read ("nowhere.mtl" first)'
printf 'newmtl a\nKd .5 .5 .5\nKe 1 1 1\n' >nowhere.mtl
expect 0 bake no-mtl.obj -o good.glb
check "no output" test ! -e bad.glb
# JSON that does not fit into the budget is refused before it is parsed.
{ printf '{"models": {"a": "'; head -c 20000000 /dev/zero | tr '\0' x; printf '"}}'; } >long.json
{ printf '{"models": ['; yes '[],' | head -n 300000; printf '[]]}'; } >wide.json
for file in long wide; do
    for command in info 'bake -o big.glb'; do
        expect 75 $command $file.json --max-memory 60M
        says "$file.json"
    done
    expect 65 info $file.json
done
rm -f long.json wide.json
leftovers
finish

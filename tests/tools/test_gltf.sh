# tests/tools/test_gltf.sh: glTF files in every command: .glb and .gltf mean the same; warnings; files outside of the folder.
source "$(dirname "$0")/support.sh"

# The unit square in buffer.bin: four corners as floats, then six indices as bytes.
square='\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0\0\0\0\0\0\0\200?\0\0\200?\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0\0\1\2\0\2\3\0\0'
mkdir in
printf "$square" >in/buffer.bin
cp in/buffer.bin outside.bin
# document BUFFER [MEMBERS]: two nodes with the square; the second one is twice as large.
document() {
    cat <<END
{"asset": {"version": "2.0"}, "buffers": [{$1}], ${2:-}
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 6}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"}],
 "materials": [{"name": "lamp", "doubleSided": false, "emissiveFactor": [1, 0.5, 0.25],
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.4, 0.3, 1]}}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
 "nodes": [{"name": "a", "mesh": 0}, {"name": "b", "mesh": 0, "scale": [2, 2, 2], "translation": [0, 0, -1]}],
 "scenes": [{"nodes": [0, 1]}], "scene": 0}
END
}
size() { printf "\\x$(printf %02x $(($1 % 256)))\\x$(printf %02x $(($1 / 256)))\\0\\0"; }
# pack FILE: the document on standard input and the square as a GLB.
pack() {
    local text padded
    text=$(cat)
    padded=$(((${#text} + 3) / 4 * 4))
    { printf 'glTF\2\0\0\0'; size $((28 + padded + 56)); size $padded; printf "JSON%-${padded}s" "$text"; size 56
      printf 'BIN\0'; printf "$square"; } >"$1"
}
document '"uri": "buffer.bin"' >in/s.gltf
document '"byteLength": 56' | pack in/s.glb

# Both forms give the same bytes in every command.
printf '.2 .2 1 0 0 -1\n' >rays.txt
printf '.2 .2 1\n' >points.txt
for form in gltf glb; do
    expect 0 info in/s.$form --json
    holds "$(value faces) == 4 && $(value vertices) == 8 && $(value area) == 5"
    holds "$(value objects) == 2 && $(value materials) == 2 && $(value emitting_instances) == 2"
    check "no warnings" test "$(value warnings)" = '[]'
    expect 0 cluster in/s.$form -o $form.fct
    expect 0 partition in/s.$form -k 2 -o $form.txt
    expect 0 boxes in/s.$form -k 2 -o $form.json
    expect 0 meshlets in/s.$form -o $form.off
    expect 0 simplify in/s.$form --faces 2 -o $form.ply
    expect 0 raycast in/s.$form --rays rays.txt -o $form.hits
    expect 0 closest in/s.$form --points points.txt -o $form.near
    expect 0 render in/s.$form -o $form.png --size 40x30
    expect 0 render in/s.$form --clusters 2 -o $form-k.png --size 40x30
    expect 0 bake in/s.$form -o $form-lit.ply --json
    holds "($(value emitted) - 8.75) ^ 2 < 1e-6" # (1 + .5 + .25) times the area 1 + 4
    expect 0 compare in/s.$form gltf.fct --samples 2
done
for file in .txt .json .off .ply .hits .near .png -k.png -lit.ply; do
    check "the same $file" cmp -s gltf$file glb$file
done
sed 's/"emissiveFactor[^]]*],/"emissiveFactor": [0, 0, 0],/' in/s.gltf >in/dark.gltf
expect 65 bake in/dark.gltf -o dark.ply
says "nothing emits light"
says "emissiveFactor"
check "no output" test ! -e dark.ply

# A file with baked light is a mesh.
expect 0 bake in/s.glb -o lit.glb
expect 0 info lit.glb --json
check "a bake is a mesh" test "$(value kind)" = mesh
expect 0 render lit.glb -o lit.png --size 40x30
check "it shows its light" test "$(cmp -s lit.png glb.png; echo $?)" = 1

# A baked .glb keeps nodes and materials; --merge does not. Both are the same mesh with the same light.
expect 0 bake in/s.gltf -o kept.glb --also kept.ply --json
expect 0 bake in/s.gltf -o one.glb --merge
check "the nodes" grep -qaF '"nodes":[{"name":"a","mesh":0},{"name":"b","scale":[2,2,2],"translation":[0,0,-1],"mesh":1}]' kept.glb
check "the material" grep -qaF '{"name":"lamp","doubleSided":false,"emissiveFactor"' kept.glb
check "not unlit" test "$(grep -ac KHR_materials_unlit kept.glb)" = 0
check "unlit" grep -qa KHR_materials_unlit one.glb
expect 0 compare kept.glb one.glb --samples 3 --json
holds "$(value e_max) < 1e-6 && $(value color_rms) < 1e-6"
expect 0 bake in/s.gltf -o one.ply
check "--also" cmp -s kept.ply one.ply
expect 0 simplify kept.glb --faces 40 -o few.glb
check "names stay" grep -qaF '"name":"b"' few.glb
expect 0 info few.glb --json
holds "$(value faces) <= 40 && $(value faces) > 0"
expect 0 bake - --format glb -o pipe.glb <in/s.glb
check "nodes of a pipe" grep -qaF '"nodes":[{"name":"a","mesh":0},{"name":"b"' pipe.glb
check "unlit" grep -qa KHR_materials_unlit pipe.glb
expect 73 bake in/s.gltf -o missing/x.glb

# Each feature that is left out has one warning, once, also with --quiet and in --json.
document '"uri": "buffer.bin"' '"animations": [{}], "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},' >in/more.gltf
expect 0 info in/more.gltf --json
check "two warnings" test "$(grep -c '^facetree: warning: ' err)" = 2
check "two in --json" test "$(grep -c '"in/more.gltf: 1 ' out)" = 2
expect 0 info in/more.gltf --json --quiet
check "--quiet is quiet" test ! -s err
check "two in --json" test "$(grep -c '"in/more.gltf: 1 ' out)" = 2
document '"uri": "buffer.bin"' '"extensionsRequired": ["KHR_lights_punctual"],' >in/must.gltf
for command in info "bake -o x.ply" "cluster -o x.fct" "render -o x.png"; do
    expect 65 $command in/must.gltf
    says "KHR_lights_punctual"
done
echo '{"asset": {"version": "1.0"}, "meshes": {}}' >in/old.gltf
expect 65 info in/old.gltf
says "glTF 1.0"

# Buffers outside of the folder, devices, and names that lead out.
for name in ../outside.bin "$here/outside.bin" %2e%2e/outside.bin; do
    document "\"uri\": \"$name\"" >in/out.gltf
    for command in "info --json" "cluster -o x.fct" "bake -o x.ply"; do
        expect 65 $command in/out.gltf
        says "--allow-outside"
        expect 0 $command in/out.gltf --allow-outside
    done
done
for name in /dev/zero /dev/tty; do
    document "\"uri\": \"$name\"" >in/device.gltf
    expect 65 info in/device.gltf
    expect 65 info in/device.gltf --allow-outside
    says "not a regular file"
done

# A pipe is read once.
expect 0 info - --format glb --json <in/s.glb
holds "$(value faces) == 4"
expect 0 render - --format glb -o pipe.png --size 40x30 <in/s.glb
rm -f x.*
leftovers
finish

# tests/tools/test_normals.sh: bake --normals: rules, outputs, messages and mistakes.
source "$(dirname "$0")/support.sh"

# obj NAME: an OBJ ball of four rings with a normal per vertex; its edges turn by more than 40 degrees.
sphere 4 >ball.off
obj() {
    awk -v bad="$1" 'NR > 2 && NF == 3 { print "v", $0; print "vn", n++ < bad ? "0 0 0" : $0 }
        NF == 4 { print "f " $2 + 1 "//" $2 + 1, $3 + 1 "//" $3 + 1, $4 + 1 "//" $4 + 1 }' ball.off
}
obj 0 >ball.obj
obj 1 >flawed.obj
cat >scene.json <<END
{
  "models": {"ball": "ball.obj", "bare": "ball.off"},
  "materials": {"grey": {"reflectance": 0.5}, "lamp": {"emission": 4}},
  "instances": [
    {"name": "ball", "model": "ball", "material": "grey"},
    {"name": "bare", "model": "bare", "material": "grey", "translate": [4, 0, 0]},
    {"name": "lamp", "model": "bare", "material": "lamp", "translate": [2, 0, 3], "scale": 0.3}
  ]
}
END
draft="--quality draft --max-edge 10"

# rules: the rule of each object.
rules() { tr -d ' \n' <out | grep -o '"normals":"[a-z]*"' | cut -d'"' -f4 | tr '\n' ' '; }
for rule in file crease=40 crease=180 flat; do
    expect 0 bake scene.json -o $rule/ $draft --keep-mesh corner --normals $rule --json
    case $rule in
    file) check "rules of files" test "$(rules)" = "file crease crease " ;;
    flat) check "flat" test "$(rules)" = "flat flat flat " ;;
    *) check "creases" test "$(rules)" = "crease crease crease " ;;
    esac
done
expect 0 bake scene.json -o default/ $draft --keep-mesh corner --json
check "file is the default" cmp -s default/ball.ply file/ball.ply
count() { expect 0 info "$1" --json && value vertices; }
check "no crease in the file" test "$(count file/ball.ply)" = 26
check "creases without normals" test "$(count file/bare.ply)" -gt 26
check "the same creases" cmp -s file/bare.ply crease=40/bare.ply
check "normals are ignored" test "$(count crease=40/ball.ply)" = "$(count crease=40/bare.ply)"
check "no crease" test "$(count crease=180/ball.ply)" = 26
check "three vertices per face" test "$(count flat/ball.ply)" = 144

# What is written: a .glb has normals, other files have them on request.
layout() { head -n 20 "$1" | grep -ac '^property float n[xyz]$'; }
check "a folder keeps its layout" test "$(layout file/ball.ply)" = 0
expect 0 bake scene.json -o plain.ply $draft --also also.glb
check "so does a file" test "$(layout plain.ply)" = 0
expect 0 bake scene.json -o some.ply $draft --light radiosity,normal --json
check "on request" test "$(layout some.ply)" = 3
check "listed" grep -q '"normal"' out
expect 0 bake scene.json -o some/ $draft --light radiosity,normal
check "in a folder too" test "$(layout some/ball.ply)" = 3
expect 0 bake scene.json -o kept.glb $draft --also kept.ply
expect 0 bake scene.json -o one.glb $draft --merge
for file in also.glb kept.glb one.glb; do check "NORMAL of $file" grep -qa '"NORMAL":' $file; done
check "none in --also" test "$(layout kept.ply)" = 0
for how in vertex corner face; do
    expect 0 bake scene.json -o kept.ply $draft --keep-mesh $how --light radiosity,normal
    check "kept normals" test "$(layout kept.ply)" = 3
    expect 0 bake scene.json -o kept.glb $draft --keep-mesh $how
    check "NORMAL of $how" grep -qa '"NORMAL":' kept.glb
done

# Normals that are not usable have one warning.
sed 's/ball.obj/flawed.obj/' scene.json >flawed.json
expect 0 bake flawed.json -o flawed.ply $draft --error 50%
check "one warning" test "$(grep -c '^facetree: warning: ' err)" = 1
says "5 of 144 normals"
expect 0 bake flawed.json -o flawed.ply $draft --normals flat
check "none" test ! -s err

# Mistakes.
for bad in 0 -1 181 nan inf x '' ' 40' 40x; do
    expect 64 bake scene.json -o x.ply --normals "crease=$bad"
    says "expected an angle over 0 and up to 180 degrees, found '$bad'"
done
for bad in smooth crease '' File; do
    expect 64 bake scene.json -o x.ply --normals "$bad"
    says "expected file, crease=DEG or flat, found '$bad'"
done
expect 64 bake scene.json -o x.ply --light normal
says "the first quantity makes the colours"
check "no file" test ! -e x.ply
finish

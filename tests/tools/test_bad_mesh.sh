# tests/tools/test_bad_mesh.sh: for a broken mesh file, every command that reads meshes prints one line, returns 65 or 66, and
# writes no output. All commands accept odd but valid meshes.
source "$(dirname "$0")/support.sh"
printf '0 0 9 0 0 -1\n0 0 -9 .1 .1 1\n' >rays.txt
printf '0 0 0\n1e3 1 1\n' >points.txt

# refused CODE FILE: checks that every command refuses the file. With sanitizers, whose programs start slowly, three of them do,
# because all commands share the readers.
refused() {
    local wanted=$1 file=$2
    expect "$wanted" info "$file"
    says "$file"
    expect "$wanted" cluster "$file" -o out.fct
    expect "$wanted" bake "$file" -o out.glb
    if [ "$scale" != 1 ]; then
        check "no output of $file" test -z "$(find . -name 'out.*')"
        return
    fi
    expect "$wanted" partition "$file" -k 1 -o out.txt
    expect "$wanted" boxes "$file" -k 1 -o out.json
    expect "$wanted" raycast "$file" --rays rays.txt -o out.txt
    expect "$wanted" closest "$file" --points points.txt -o out.txt
    expect "$wanted" simplify "$file" --faces 10 -o out.ply
    expect "$wanted" compare "$file" "$file"
    expect "$wanted" render "$file" -o out.png
    check "no output of $file" test -z "$(find . -name 'out.*')"
}

refused 66 missing.ply
refused 66 no/such/folder/mesh.obj
mkdir folder.ply
refused 66 folder.ply
: >empty.ply
: >empty.off
: >empty.stl
: >empty.glb
: >empty.om
for file in empty.*; do refused 65 "$file"; done
echo 'hello, this is no mesh' >words.ply
echo 'hello, this is no mesh' >words.off
echo 'hello, this is no mesh' >words.glb
for file in words.*; do refused 65 "$file"; done
cube 1 >cube.off
cp cube.off cube.xyz
refused 65 cube.xyz

"$program" simplify cube.off --faces 12 -o good.ply --quiet # a binary PLY to break
expect 0 info good.ply
size=$(stat -c %s good.ply)
for keep in 10 100 $((size / 2)) $((size - 1)); do
    head -c "$keep" good.ply >"short$keep.ply"
    refused 65 "short$keep.ply"
done
sed 's/^element vertex .*/element vertex 4000000000/' good.ply >lie1.ply
sed 's/^element face .*/element face 2000000000/' good.ply >lie2.ply
head -n 5 cube.off >short.off
sed 's/^8 12 0/8 99999999 0/' cube.off >lie.off
sed 's/^8 12 0/99999999 12 0/' cube.off >lie2.off
for file in lie*.ply short.off lie*.off; do refused 65 "$file"; done

triangle() { printf 'v %s 0 0\nv 1 0 0\nv 0 1 0\nf %s\n' "$1" "$2"; }
triangle nan '1 2 3' >nan.obj
triangle inf '1 2 3' >inf.obj
triangle 1e999 '1 2 3' >over.obj
triangle one '1 2 3' >text.obj
triangle 0 '1 2 4' >range.obj
triangle 0 '1 2 0' >zero.obj
triangle 0 '1 2 -4' >negative.obj
triangle 0 '1 2 x' >letter.obj
for file in nan inf over text range zero negative letter; do refused 65 $file.obj; done
expect 65 info text.obj
says "text.obj:1"
expect 65 info range.obj
says "range.obj:4"

# Hierarchy files: truncated, changed, of another format.
expect 0 cluster cube.off -o cube.fct
size=$(stat -c %s cube.fct)
for keep in 0 7 64 $((size / 2)) $((size - 1)); do
    head -c "$keep" cube.fct >"cut$keep.fct"
    refused 65 "cut$keep.fct"
done
cp good.ply foreign.fct
refused 65 foreign.fct
for place in 200 $((size / 3)) $((size / 2)) $((size - 20)); do
    cp cube.fct changed.fct
    byte=$(od -An -tu1 -j "$place" -N 1 cube.fct)
    printf "\\$(printf %o $((255 - byte)))" | dd of=changed.fct bs=1 seek="$place" conv=notrunc status=none
    run info changed.fct --verify
    checks=$((checks + 1))
    case $code in
    65) ;;
    0) cmp -s cube.fct changed.fct || echo "note: byte $place belongs to nothing that is checked" >&2 ;;
    *) fail "a changed byte at $place: exit code $code" ;;
    esac
done

# accepted FILE [dark]: checks that every command accepts the file. A bake of it finds no light. Unless `dark` is given, it can
# be baked in a scene where it emits light.
accepted() {
    local file=$1 faces
    expect 0 info "$file" --json
    faces=$(value faces)
    expect 0 cluster "$file" -o odd.fct --json
    holds "$(value faces) == $faces && $(value depth) <= 3 * log($faces) / log(2) + 1"
    expect 0 info odd.fct --verify
    expect 0 partition odd.fct -k $((faces < 3 ? 1 : 3)) -o odd.txt
    check "a label a face" test "$(wc -l <odd.txt)" = "$faces"
    expect 0 boxes odd.fct -k 1 -o odd.json
    expect 0 raycast odd.fct --check --count 2000 --json
    holds "$(value unexplained) == 0"
    expect 0 closest odd.fct --points points.txt
    expect 0 simplify "$file" --faces $((faces / 2)) -o odd.ply
    expect 0 compare "$file" odd.fct --samples 3
    run bake "$file" -o baked.ply
    check "a bake without light is refused" test "$code" = 65
    [ "${2:-}" != dark ] || { rm -f odd.*; return; }
    says "nothing emits light"
    cat >odd.json <<END
{"models": {"m": "$file"}, "materials": {"lamp": {"emission": 1}},
 "instances": [{"model": "m", "material": "lamp"}]}
END
    expect 0 bake odd.json -o baked.ply
    rm -f odd.* baked.ply
}
triangle 0 '1 2 3' >one.obj
accepted one.obj
{ cat one.obj; echo 'f 1 2'; echo 'f 3'; } >short.obj
accepted short.obj
expect 0 info short.obj
says "2 faces of fewer than 3 corners"
{ printf 'v 0 0 0\nv 1 1 1\nv 2 2 2\n'; for i in 1 2 3 4 5; do echo 'f 1 2 3'; echo 'f 1 1 2'; done; } >degenerate.obj
{ for i in 1 2 3 4 5 6; do printf 'v .5 .5 .5\n'; done; printf 'f 1 2 3\nf 4 5 6\n'; } >coincident.obj
for file in degenerate.obj coincident.obj; do
    expect 0 info $file --json
    holds "$(value degenerate_faces) == $(value faces)"
    expect 0 cluster $file -o odd.fct
    expect 0 info odd.fct --verify
    expect 0 partition odd.fct -k 2 -o odd.txt
    expect 0 raycast odd.fct --rays rays.txt
    check "degenerate faces are not hit" test "$(tr '\n' ' ' <out)" = "-1 -1 "
    expect 0 simplify $file --faces 1 -o odd.ply
    run bake $file -o baked.ply
    [ "$code" = 0 ] || [ "$code" = 65 ] || fail "bake of $file: exit code $code"
done
grid 24 >flat.off
accepted flat.off
for power in -30 30; do
    sphere 8 | awk -v p=$power 'NF == 3 && NR > 2 { printf "%.9g %.9g %.9g\n", $1 * 10 ^ p, $2 * 10 ^ p, $3 * 10 ^ p; next } { print }' >extent$power.off
    accepted extent$power.off dark # areas of such faces are beyond a float: no light is left
done
{ sphere 6; } >twice.off # every face a second time, turned over
awk 'NR == 2 { $2 *= 2; print; next } NF == 4 { print; print $1, $3, $2, $4; next } { print }' twice.off >duplicate.off
accepted duplicate.off
# A hierarchy file has vertex colours only.
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n' >red.ply
expect 0 cluster red.ply -o red.fct
says "red.ply: face colours are left out"
leftovers
finish

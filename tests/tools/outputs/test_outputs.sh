# tests/tools/outputs/test_outputs.sh: outputs that cannot be written give exit code 73 before long work, and the old file remains.
source "$(dirname "$0")/../support.sh"
cube 1 >cube.off
"$program" cluster cube.off -o cube.fct --quiet
printf '0 0 9 0 0 -1\n' >rays.txt
printf '0 0 1 0 0 1\n' >probes.txt

outputs() { # of each command that writes: with FILE as the output
    local file=$1
    echo "cluster cube.off -o $file.fct"
    echo "partition cube.off -k 2 -o $file.txt"
    echo "partition cube.off -k 2 -o $file.ply"
    echo "boxes cube.off -k 2 -o $file.json"
    echo "boxes cube.off -k 2 -o $file.glb"
    echo "raycast cube.off --rays rays.txt -o $file.txt"
    echo "closest cube.off --points points.txt -o $file.txt"
    echo "collide cube.off cube.off -o $file.txt"
    echo "simplify cube.off --faces 6 -o $file.obj"
    echo "bake cube.off -o $file.glb"
    echo "bake cube.off -o $file.ply"
    echo "render cube.off -o $file.png"
}
echo 0 0 1 >points.txt

while read -r line; do
    expect 73 $line
    says "cannot be written"
done < <(outputs no/such/folder/file)
for ending in fct txt ply json glb obj png; do mkdir "folder.$ending"; done
for line in 'partition cube.off -k 2 -o folder.txt' 'simplify cube.off --faces 6 -o folder.ply' 'boxes cube.off -k 2 -o folder.json' \
    'render cube.off -o folder.png'; do
    expect 73 $line
done
echo old >plain
expect 73 bake cube.off -o plain/
cp cube.off other.off
expect 73 cluster cube.off other.off -o plain
check "a file is no folder" test "$(cat plain)" = old

# A full disk: /dev/full accepts no bytes.
if [ -w /dev/full ]; then
    for ending in fct txt json; do ln -s /dev/full "full.$ending"; done
    expect 73 partition cube.off -k 2 -o full.txt
    expect 73 boxes cube.off -k 2 -o full.json
    expect 73 raycast cube.off --rays rays.txt -o full.txt
    expect 73 collide cube.off cube.off --contacts -o full.txt
    expect 73 cluster cube.off -o full.fct
    "$program" info cube.off >/dev/full 2>err
    code=$?
    check "standard output is full" test "$code" = 73
fi
# A limit on file sizes: the write fails half-way, and the old file remains.
sphere 60 >sphere.off
for line in 'cluster sphere.off -o old.fct' 'simplify sphere.off --ratio .9 -o old.ply' 'partition sphere.off -k 9 -o old.glb' \
    'partition sphere.off -k 3000 -o old.txt'; do
    file=${line##* }
    echo old >"$file"
    (ulimit -f 8; trap '' XFSZ; exec "$program" $line >out 2>err)
    code=$?
    check "a limit on files: 73, not $code: $line" test "$code" = 73
    check "the old $file stays" test "$(cat "$file")" = old
done
# An old file remains if the input is bad, and is replaced if it is good.
echo old >keep.ply
expect 66 simplify missing.off --faces 6 -o keep.ply
check "the old file stays" test "$(cat keep.ply)" = old
expect 0 simplify cube.off --faces 6 -o keep.ply
check "the file is replaced" test "$(head -c 3 keep.ply)" = ply
expect 0 partition cube.off -k 2 -o /dev/null
check "/dev/null is still a device" test -c /dev/null
if [ "$(id -u)" != 0 ]; then
    mkdir locked && chmod 555 locked
    expect 73 simplify cube.off --faces 6 -o locked/x.ply
fi

# --- Coordinates far from 0 ---
# near.off: a sphere of radius 1 cm. far.off: the same in UTM metres, with 17 digits.
sphere 16 | awk 'NF == 3 && NR > 2 { printf "%.16g %.16g %.16g\n", $1 / 100, $2 / 100, $3 / 100; next } { print }' >near.off
x0=500000.003 y0=4500000.007 z0=30
awk -v x=$x0 -v y=$y0 -v z=$z0 'NF == 3 && NR > 2 { printf "%.16g %.16g %.16g\n", x + $1, y + $2, z + $3; next } { print }' near.off >far.off
expect 0 info near.off --json
area=$(value area)
# same_area FILE: the area of near.off, within 1e-4.
same_area() {
    expect 0 info "$1" --json
    holds "($(value area) / $area - 1)^2 < 1e-8"
    keys origin
    lower=$(grep -A1 '"lower"' out | tail -n 1 | tr -d ' ,')
    holds "$lower > $x0 - .0101 && $lower < $x0 - .0099"
}
same_area far.off
# Every format with room for the digits keeps them.
for ending in ply off obj glb; do
    expect 0 simplify far.off -o "same.$ending" --faces 960
    same_area "same.$ending"
done
expect 0 simplify far.off -o floats.om --faces 960
says "lose digits"
expect 0 simplify same.ply -o again.ply --faces 960
same_area again.ply
expect 0 compare far.off same.ply --json
holds "$(value e_max) < 1e-8"
# Hierarchies, also out of core.
expect 0 cluster same.ply -o far.fct
same_area far.fct
expect 0 info far.fct --verify
expect 0 partition far.fct -k 7 -o parts.ply
same_area parts.ply
expect 0 cluster near.off -o near.fct
# moved FILE COLUMN: the numbers of COLUMN and the next two, without the offset.
moved() { awk -v c="$2" -v x=$x0 -v y=$y0 -v z=$z0 '{ printf "%.5f %.5f %.5f\n", $c - x, $(c + 1) - y, $(c + 2) - z }' "$1"; }
for i in 1 2 3 4 5 6 7 8 9; do awk -v i=$i 'BEGIN { printf "%.16g %.16g %.16g\n", .03 * cos(i), .03 * sin(i), .01 * sin(5 * i) }'; done >points
awk -v x=$x0 -v y=$y0 -v z=$z0 '{ printf "%.16g %.16g %.16g\n", x + $1, y + $2, z + $3 }' points >far-points
expect 0 closest near.fct --points points -o near-found
expect 0 closest far.fct --points far-points -o far-found
awk '{ printf "%.5f %.5f %.5f\n", $2, $3, $4 }' near-found | sed 's/-0.00000/0.00000/g' >expected
moved far-found 2 | sed 's/-0.00000/0.00000/g' >found
check "closest points move with the mesh" cmp -s expected found
awk '{ print $0, -$1, -$2, -$3 }' points >rays
paste -d ' ' far-points points | awk '{ print $1, $2, $3, -$4, -$5, -$6 }' >far-rays
expect 0 raycast near.fct --rays rays -o near-hits
expect 0 raycast far.fct --rays far-rays -o far-hits
check "rays move with the mesh" test "$(awk '{ printf "%s %.4f ", $1, $2 }' near-hits)" = "$(awk '{ printf "%s %.4f ", $1, $2 }' far-hits)"
expect 0 boxes far.fct -k 1 -o box.json
tr -d ' \n' <box.json | sed 's/.*"center":\[\([^]]*\)\].*/\1/; s/,/ /g' >center
check "the box is around the sphere" test "$(moved center 1 | awk '{ print ($1^2 + $2^2 + $3^2 < 1e-5) }')" = 1
expect 0 boxes far.fct -k 4 -o boxes.ply
expect 0 info boxes.ply --json
keys origin
expect 0 render same.ply -o far.png --size 32x32

leftovers
finish

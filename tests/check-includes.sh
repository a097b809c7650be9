#!/bin/sh
# Checks the order of the folders. Includes point left only, in the chain
#   base <- mesh <- dual <- cluster/merge, cluster/shape <- cluster/tree <- cluster/file <- cluster/large <- partition <- bvh
#   <- scene <- radiosity
# simplify includes base and mesh. Tools, tests of the program and examples include public headers alone. A subfolder outside
# cluster/ has the place of its folder. A file and its header count as one, and no files include each other in a cycle. Prints
# each include that breaks a rule.
# usage: check-includes.sh [ROOT]
cd "${1:-$(dirname "$0")/..}" || exit 2
arrows=$(mktemp) || exit 2
trap 'rm -f "$arrows"' EXIT
find base mesh dual cluster partition bvh scene radiosity simplify tools include examples \
    \( -name '*.c' -o -name '*.h' -o -name '*.cpp' -o -name '*.hpp' \) 2>/dev/null | sort | xargs awk -v arrows="$arrows" '
BEGIN {
    count = split("base mesh dual merge|shape tree file large partition bvh scene radiosity", chain, " ")
    for (i = 1; i <= count; ++i) {
        rooms = split(chain[i], room, "|")
        for (j = 1; j <= rooms; ++j) place[room[j]] = i
    }
    place["cluster"] = place["large"] # the public header of cluster/ stands at the right end of its rooms
    place["openmesh"] = place["partition"] + .5
}
function fail(what) {
    print FILENAME ":" FNR ": " what
    bad = 1
}
function room_of(path,   part) {
    split(path, part, "/")
    return part[1] == "cluster" && part[3] != "" ? part[2] : part[1]
}
function allowed(from, to) {
    if (from == to) return 1
    if (from == "simplify") return to == "base" || to == "mesh"
    if (from == "tools" || to == "simplify" || to == "tools") return 0
    return place[to] < place[from]
}
/^[ \t]*#[ \t]*include[ \t]*"/ {
    path = $0
    sub(/^[^"]*"/, "", path)
    sub(/".*/, "", path)
    parts = split(path, target, "/")
    from = room_of(FILENAME)
    if (from == "include") { # a public header has the place of its folder
        split(FILENAME, own, "/")
        from = own[3]
        sub(/\..*/, "", from)
        if (from == "facetree") next
        if (from == "collide") from = "bvh" # the second header of bvh/
        if (from == "progressive" || from == "simplifier") from = "simplify" # that of simplify/
        if (target[1] != "facetree") fail("a public header includes a private one: " path)
    }
    if (parts < 2) { fail("an include without its folder: " path); next }
    if (target[1] == "facetree") {
        if (from == "tools" || from == "examples") next
        to = target[2]
        sub(/\..*/, "", to)
        if (to == "collide") to = "bvh"
        if (to == "progressive" || to == "simplifier") to = "simplify"
        # all subfolders of cluster/ know the types of fct_tree
        if (to == "cluster" && index(FILENAME, "cluster/") == 1) next
    } else {
        to = room_of(path)
        stem = FILENAME
        other = path
        sub(/\.[a-z]+$/, "", stem)
        sub(/\.[a-z]+$/, "", other)
        print stem, other > arrows
    }
    if (from == "examples") { fail("an example includes a private header: " path); next }
    if (!allowed(from, to)) fail(from " includes " path ", which is not left of it")
}
END { exit bad }'
bad=$?
tsort "$arrows" >/dev/null || bad=1
exit $bad

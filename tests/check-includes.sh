#!/bin/sh
# Includes run leftwards only. A folder may include itself, what stands left of it, and public headers no further
# right than itself; tools, tests of the program and examples see public headers alone. Prints each arrow that
# runs the wrong way and fails.
# usage: check-includes.sh [ROOT]
cd "${1:-$(dirname "$0")/..}" || exit 2
find base mesh dual cluster bvh scene radiosity simplify tools include examples \
    \( -name '*.c' -o -name '*.h' -o -name '*.cpp' -o -name '*.hpp' \) 2>/dev/null | sort | xargs awk '
BEGIN {
    order = split("base mesh dual cluster bvh scene radiosity", chain, " ")
    for (i = 1; i <= order; ++i)
        for (j = 1; j <= i; ++j) allowed[chain[i], chain[j]] = 1
    allowed["simplify", "base"] = allowed["simplify", "mesh"] = allowed["simplify", "simplify"] = 1
    allowed["tools", "tools"] = 1
    allowed["openmesh", "cluster"] = 1
    folder["partition"] = "cluster" # a second public header of a folder
}
function fail(what) {
    print FILENAME ":" FNR ": " what
    bad = 1
}
/^[ \t]*#[ \t]*include[ \t]*"/ {
    path = $0
    sub(/^[^"]*"/, "", path)
    sub(/".*/, "", path)
    parts = split(path, target, "/")
    split(FILENAME, own, "/")
    from = own[1]
    if (from == "include") { # a public header stands where its folder stands
        from = own[3]
        sub(/\..*/, "", from)
        if (from == "facetree") next
        if (from in folder) from = folder[from]
        if (target[1] != "facetree") fail("a public header includes a private one: " path)
    }
    if (parts < 2) { fail("an include without its folder: " path); next }
    if (target[1] == "facetree") {
        if (from == "tools" || from == "examples") next
        to = target[2]
        sub(/\..*/, "", to)
        if (to in folder) to = folder[to]
    } else
        to = target[1]
    if (from == "examples") { fail("an example includes a private header: " path); next }
    if (!((from, to) in allowed)) fail(from " includes " path ", which is not left of it")
}
END { exit bad }'

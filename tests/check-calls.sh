#!/bin/sh
# Checks the rules of check-includes.sh on the calls of the compiled library. An object that uses a symbol of another object
# calls it. Both variants of a kernel count as their source file.
# usage: check-calls.sh BUILD_FOLDER
sources=$(cd "$(dirname "$0")/.." && pwd) || exit 2
cd "$1/CMakeFiles" || exit 2
calls=$(mktemp) || exit 2
trap 'rm -f "$calls"' EXIT
# An object of a source that has moved stays in the build folder: it does not count.
find fct_*.dir -name '*.o' | sort | while read -r object; do
    source=${object#fct_*.dir/}
    [ ! -f "$sources/${source%.o}" ] || printf '%s\n' "$object"
done | xargs nm -A --format=posix | awk '
{
    file = $1
    sub(/:$/, "", file)
    sub(/^fct_[a-z0-9_]*\.dir\//, "", file)
    sub(/\.(c|cpp)\.o$/, "", file)
    if ($3 == "U") uses[file, $2] = 1
    else if ($3 ~ /[A-Z]/ && $2 ~ /^fct_/) owner[$2] = file
}
END {
    for (use in uses) {
        split(use, pair, SUBSEP)
        if (pair[2] in owner && owner[pair[2]] != pair[1]) print pair[1], owner[pair[2]], pair[2]
    }
}' | sort >"$calls"
awk '
BEGIN {
    count = split("base mesh dual merge|shape tree file large partition bvh scene radiosity", chain, " ")
    for (i = 1; i <= count; ++i) {
        rooms = split(chain[i], room, "|")
        for (j = 1; j <= rooms; ++j) place[room[j]] = i
    }
}
function room_of(path,   part) {
    split(path, part, "/")
    return part[1] == "cluster" ? part[2] : part[1]
}
{
    from = room_of($1)
    to = room_of($2)
    if (from == to || (from == "simplify" && (to == "base" || to == "mesh"))) next
    if (from != "simplify" && to != "simplify" && place[to] < place[from]) next
    print $1 " calls " $3 " of " $2 ", which is not left of it"
    bad = 1
}
END { exit bad }' "$calls"
bad=$?
cut -d ' ' -f 1,2 "$calls" | sort -u | tsort >/dev/null || bad=1
exit $bad

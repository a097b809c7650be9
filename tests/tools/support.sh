# tests/tools/support.sh: functions for the scripts of this folder. A script gets the program as $1, a folder of real meshes as
# $2 and a scale as $3. It works in a temporary folder and ends with `finish`.
set -u
program=$1
data=${2:-}
scale=${3:-1}
here=$(mktemp -d "${TMPDIR:-/tmp}/facetree-cli-XXXXXX")
trap 'rm -rf "$here"' EXIT
cd "$here" || exit 1
failures=0
checks=0

fail() {
    failures=$((failures + 1))
    echo "FAILED: $*" >&2
    sed 's/^/    stdout: /' out 2>/dev/null | head -n 5 >&2
    sed 's/^/    stderr: /' err 2>/dev/null | head -n 5 >&2
}

# run ARGUMENTS...: runs the program; out holds stdout, err holds stderr, $code is the exit code (124: timeout).
run() {
    timeout 180 "$program" "$@" >out 2>err
    code=$?
}

# expect CODE ARGUMENTS...: checks the exit code. An error must print one line on stderr that begins with facetree.
expect() {
    local wanted=$1
    shift
    checks=$((checks + 1))
    run "$@"
    [ "$code" = "$wanted" ] || { fail "expected exit code $wanted, found $code: facetree $*"; return 1; }
    if [ "$wanted" -ge 64 ]; then
        [ "$(wc -l <err)" = 1 ] || { fail "expected one line on stderr, found $(wc -l <err): facetree $*"; return 1; }
        grep -q '^facetree' err || { fail "expected a message of facetree: facetree $*"; return 1; }
    fi
}

# says TEXT: checks that stderr of the last run contains TEXT.
says() {
    checks=$((checks + 1))
    grep -qF -- "$1" err || fail "expected '$1' on stderr"
}

# check DESCRIPTION COMMAND...: checks that the command succeeds.
check() {
    local what=$1
    shift
    checks=$((checks + 1))
    "$@" || fail "$what"
}

# value KEY [FILE]: prints the number or word after the first "KEY": of a JSON file (default: out).
value() {
    sed -n 's/^.*"'"$1"'": *"\{0,1\}\([^",}]*\).*$/\1/p' "${2:-out}" | head -n 1
}

# keys NAME...: checks that stdout is one JSON object with these keys.
keys() {
    local key
    checks=$((checks + 1))
    [ "$(head -c 1 out)" = "{" ] && [ "$(tail -n 1 out)" = "}" ] && [ "$(grep -c '^{' out)" = 1 ] ||
        { fail "expected one JSON object on stdout"; return; }
    for key; do grep -q "\"$key\":" out || fail "expected the JSON key $key"; done
}

# holds EXPRESSION: checks that the awk expression is true.
holds() {
    checks=$((checks + 1))
    awk "BEGIN { exit !($1) }" || fail "expected $1"
}

leftovers() {
    checks=$((checks + 1))
    local found
    found=$(find . -name '*.??????' -o -name '*.tmp' | grep -v -e '\.labels$' | head -n 3)
    [ -z "$found" ] || fail "temporary files are left: $found"
}

finish() {
    echo "$checks checks, $failures failed"
    [ "$failures" = 0 ]
    exit
}

# --- Small inputs ---

# grid N [HEIGHT-EXPRESSION]: an OFF grid of N x N squares over [0,1]^2; the height is an awk expression in x and y.
grid() {
    awk -v n="$1" 'BEGIN {
        print "OFF"; print (n + 1) * (n + 1), 2 * n * n, 0
        for (j = 0; j <= n; ++j) for (i = 0; i <= n; ++i) { x = i / n; y = j / n; print x, y, '"${2:-0}"' }
        for (j = 0; j < n; ++j) for (i = 0; i < n; ++i) {
            a = j * (n + 1) + i; print 3, a, a + 1, a + n + 2; print 3, a, a + n + 2, a + n + 1 }
    }'
}

# sphere N: an OFF sphere of radius 1 about the origin.
sphere() {
    awk -v n="$1" 'BEGIN {
        m = 2 * n; pi = 3.14159265358979; print "OFF"; print (n - 1) * m + 2, 2 * m * (n - 1), 0
        for (j = 1; j < n; ++j) for (i = 0; i < m; ++i)
            printf "%.9g %.9g %.9g\n", sin(pi * j / n) * cos(2 * pi * i / m), sin(pi * j / n) * sin(2 * pi * i / m), cos(pi * j / n)
        print "0 0 1"; print "0 0 -1"
        north = (n - 1) * m
        for (i = 0; i < m; ++i) {
            k = (i + 1) % m; print 3, north, i, k; print 3, north + 1, (n - 2) * m + k, (n - 2) * m + i
            for (j = 0; j + 2 < n; ++j) {
                print 3, j * m + i, (j + 1) * m + i, (j + 1) * m + k; print 3, j * m + i, (j + 1) * m + k, j * m + k } }
    }'
}

# cube SIZE: an OFF cube about the origin, with outward faces.
cube() {
    awk -v s="$1" 'BEGIN {
        print "OFF"; print "8 12 0"
        for (c = 0; c < 8; ++c) print (c % 2 - .5) * s, (int(c / 2) % 2 - .5) * s, (int(c / 4) - .5) * s
        split("0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5", t)
        for (f = 0; f < 12; ++f) print 3, t[3 * f + 1], t[3 * f + 2], t[3 * f + 3]
    }'
}

# tests/tools/test_first.sh: conversion, standard input of any format, folders, generated rays, qualities, sample budgets, and
# the manuals and completions that come from the tables of options.
source "$(dirname "$0")/support.sh"
cube 1 >cube.off
"$program" cluster cube.off -o cube.fct --quiet

# Every format to every format: 8 vertices, 12 faces, area 6.
for from in off ply obj stl om glb fct; do
    [ -e cube.$from ] || expect 0 convert cube.off -o cube.$from
    for to in off ply obj stl om glb; do
        expect 0 convert cube.$from -o new.$to --json
        keys vertices faces seconds read write total peak_bytes
        expect 0 info new.$to --json
        holds "$(value faces) == 12 && $(value vertices) == 8"
        holds "($(value area) - 6) ^ 2 < 1e-10"
    done
done
expect 0 convert cube.ply -o text.ply --ascii
check "a text PLY" grep -q '^format ascii' text.ply
expect 64 convert cube.off -o x.png
expect 64 convert cube.off -o cube.off
expect 64 convert cube.off -o x.ply --format txt

# Standard input of any format, and a pipe with a name that has no ending.
for format in off ply obj stl om glb fct; do
    expect 0 info - --format $format --json <cube.$format
    holds "$(value faces) == 12"
    expect 0 simplify - --format $format --faces 6 -o new.ply --json <cube.$format
    holds "$(value faces_before) == 12 && $(value faces_after) <= 6"
    mkfifo pipe
    cat cube.$format >pipe &
    expect 0 partition pipe --format $format -k 2 -o labels.txt
    wait
    if [ $format != fct ]; then
        cat cube.$format >pipe &
        expect 0 cluster pipe --format $format -o piped.fct --max-memory 100M --json
        holds "$(value faces) == 12"
        wait
    fi
    rm pipe
done
expect 0 info - --json <cube.ply
expect 65 info - <cube.off
expect 65 info - --format obj <cube.off
cat >scene.json <<'END'
{"models": {"box": "cube.off"},
 "materials": {"lamp": {"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}},
 "instances": [{"name": "box", "model": "box", "material": "lamp"}]}
END
expect 0 info - --format json --json <scene.json
check "a scene on standard input" test "$(value kind)" = scene
expect 0 bake - --format json -o lit.ply --final none --json <scene.json
expect 0 render - --format off --size 20x20 -o new.png <cube.off

# A folder: one line or one object per file. The exit code tells of files that cannot be read.
mkdir folder
cp cube.off cube.ply cube.fct folder
echo words >folder/notes.txt
expect 0 info folder
check "a line per file" test "$(wc -l <out)" = 3
check "a line tells counts" grep -qF 'folder/cube.off: mesh, 12 faces, 8 vertices' out
expect 0 info folder/ --json
keys files
check "an object per file" test "$(grep -c '"kind"' out)" = 3
check "one slash" grep -qF '"folder/cube.fct"' out
echo broken >folder/bad.off
expect 65 info folder --json
check "the error is listed" grep -q '"error": "folder/bad.off' out
check "and the other files" test "$(grep -c '"diagonal"' out)" = 3
mkdir empty
expect 66 info empty

# Generated rays are read again, and depend on the seed alone.
expect 0 raycast cube.fct --make-rays 120 -o rays.txt
check "a ray per line" test "$(wc -l <rays.txt)" = 120
expect 0 raycast cube.fct --rays rays.txt --json
holds "$(value rays) == 120 && $(value hits) > 20"
expect 0 raycast cube.off --make-rays 120 -o again.txt --threads 1
check "the same rays" cmp -s rays.txt again.txt
expect 0 raycast cube.off --make-rays 120 -o again.txt --seed 1
check "other rays" test "$(cmp -s rays.txt again.txt; echo $?)" = 1
expect 64 raycast cube.off --make-rays 0 -o x.txt
expect 64 raycast cube.off --make-rays 5 --check
expect 64 raycast scene.json --make-rays 5 -o x.txt

# Samples: 100 per face, but within the budget of both meshes, and at least one per face.
samples() { # EXPECTED ARGUMENTS...
    local wanted=$1
    shift
    expect 0 compare cube.off cube.ply --json "$@"
    holds "$(value samples_per_face) == $wanted && $(value samples) == 24 * $wanted + 16"
}
samples 100
samples 41 --budget 1000
samples 1 --budget 1
samples 300 --samples 300 --budget 10
samples 0 --samples 0
expect 64 compare cube.off cube.ply --budget 0

# Qualities stand for options, which override them in any order.
same_bake() { # OPTIONS -- OPTIONS
    local all=$* first second
    first=${all%% --- *} second=${all##* --- }
    expect 0 bake scene.json $first -o one.ply
    expect 0 bake scene.json $second -o two.ply
    check "the same light: $*" cmp -s one.ply two.ply
}
same_bake --quality draft --- --error 5e-4 --final direct
same_bake --quality normal --- --error 2e-5 --final gather
same_bake --quality fine --- --error 5e-6
same_bake --final none --quality draft --- --error 5e-4 --final none
same_bake --error 1e-3 --quality fine --- --error 1e-3
expect 64 bake scene.json -o one.ply --quality best

# Manuals: a line per way to call the command, and examples, also in the help.
for command in bake boxes closest cluster collide compare convert info level make meshlets partition raycast render simplify; do
    expect 0 help --man $command
    check "$command has examples" grep -q '^\.SH EXAMPLES' out
    check "the synopsis of $command is one line per call" test "$(sed -n '/^\.SH SYNOPSIS/,/^\.SH DESC/p' out | grep -c "facetree $command")" -ge 1
    sed -n '/^\.SH EXAMPLES/,/^\.fi/p' out | sed 's/\\-/-/g' | grep -q "facetree $command" || fail "an example calls $command"
    expect 0 help $command
    check "the help of $command has examples" grep -q "^  .*facetree $command" out
done
expect 0 help --man bake
check "two ways to call bake" test "$(sed -n '/^\.SH SYNOPSIS/,/^\.SH DESC/p' out | grep -c '^.fBfacetree bake')" = 2

# Completion: every command, and every option of its help.
expect 0 help --bash
cp out completion
check "bash reads the completion" bash -n completion
complete_words() { # WORD...: what bash offers for the last word
    bash -c 'source ./completion; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _facetree; printf "%s\n" "${COMPREPLY[@]}"' x "$@"
}
check "commands" test "$(complete_words facetree c | tr '\n' ' ')" = "cluster closest collide convert compare "
check "help of a command" test "$(complete_words facetree help ba)" = bake
check "options" test "$(complete_words facetree cluster --me)" = --method
check "common options" test "$(complete_words facetree info --js)" = --json
check "no output option without an output" test -z "$(complete_words facetree info --out)"
for command in bake cluster level simplify; do
    expect 0 help $command
    for option in $(grep -oE '^ +(-[a-z], )?--[a-z-]+' out | grep -oE -- '--[a-z-]+' | grep -v -- --backend); do
        complete_words facetree $command $option | grep -qx -- "$option" || fail "$command $option is offered"
    done
done
expect 0 help --zsh
check "zsh completion names the command" test "$(head -n 1 out)" = '#compdef facetree'
check "zsh completion has a branch per command" test "$(grep -c '_arguments' out)" = 15
if command -v zsh >/dev/null; then
    cp out _facetree
    check "zsh reads the completion" zsh -n _facetree
fi
leftovers
finish

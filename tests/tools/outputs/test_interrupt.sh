# tests/tools/outputs/test_interrupt.sh: a first SIGINT or SIGTERM makes a bake write its last complete solution, a second one ends it
# at once.
source "$(dirname "$0")/../support.sh"
[ "$scale" = 1 ] && triangles=1000 error=5e-5 fine=5e-4 || triangles=100 error=2e-3 fine=5e-3 # instrumented code is slow
expect 0 make cornell -o cornell --triangles $triangles --quiet

# interrupted "PHASES" "SIGNALS" ARGUMENTS...: sends the signals once a line of the progress names a phase.
interrupted() {
    local phases=$1 signals=$2 name
    shift 2
    rm -rf lit.ply lit.glb lit
    case "$*" in *--error*) ;; *) set -- "$@" --error $error ;; esac
    env --default-signal=INT "$program" bake "$@" --progress --json >out 2>err &
    child=$!
    for _ in $(seq 1200); do
        grep -qsE "^($phases) " err && break
        sleep .05
    done
    for name in $signals; do # one after the other, because of two that wait the later one may come first
        kill -"$name" $child
        sleep .05
    done
    wait $child
    code=$?
    checks=$((checks + 1))
    name=${signals%% *}
    [ $code = $((128 + $(kill -l "$name"))) ] || fail "status $code: bake $*"
    check "no temporary file: bake $*" test -z "$(find . -name '.facetree*')"
}

interrupted 'direct light' INT cornell/scene.json -o lit.ply
says 'lit.ply has the light of the last complete solution'
check "the answer tells it" test "$(value interrupted)" = true
check "nothing is known of the error" test "$(value error_estimate)" = null
holds "$(value vertices) > 1000 && $(value absorbed) > .2 * $(value emitted)"
expect 0 info lit.ply --json
check "the output is whole" test "$(value vertex_colors)" = true
interrupted gathering TERM cornell/scene.json -o lit.glb
says 'lit.glb has the light of the last complete solution'
expect 0 info lit.glb
interrupted 'surface|covers|anchors|vertices|objects' INT cornell/scene.json -o lit/
says 'lit/ has the light of the last complete solution'
check "all objects are there" test "$(find lit -name "*.ply" | wc -l)" -gt 4

# The links do not tell the parts of the light, and paths have no passes. (test_bake_failure.c stops before the first pass.)
interrupted reference INT cornell/scene.json -o lit.ply --method reference --samples 4000
check "nothing is written" test ! -e lit.ply -a ! -s out
interrupted gathering INT cornell/scene.json -o lit.ply --light indirect
says 'nothing is written'
check "nothing is written" test ! -e lit.ply

# Files of a folder that were complete stay; a signal during probes leaves these out.
rm -rf lit
interrupted 'surface|covers|anchors|vertices|objects' INT cornell/scene.json -o lit/ --light radiosity,direct
says 'lit/ may have some of its files'
for i in $(seq 40000); do echo "$((i % 500)).$i 100 $((i % 300)) 0 1 0"; done >points
interrupted probes INT cornell/scene.json -o lit.ply --error $fine --probe points
says 'the outputs are complete, without probes'
expect 0 info lit.ply

# A second signal, and one that no output shall follow.
interrupted gathering 'INT TERM' cornell/scene.json -o lit.ply --error 1e-6
check "the second signal leaves no output" test ! -e lit.ply -a ! -s out
interrupted gathering HUP cornell/scene.json -o lit.ply --error 1e-6
check "nor does SIGHUP" test ! -e lit.ply -a ! -s out

# Of several bakes, the last complete one stays.
[ "$scale" = 1 ] || finish
expect 0 bake cornell/scene.json -o first.ply --quiet
rm -f lit.ply
env --default-signal=INT "$program" bake cornell/scene.json -o lit.ply --error .1% --progress --json >out 2>err &
child=$!
for _ in $(seq 2400); do
    [ -e lit.ply ] && break
    sleep .05
done
sleep .2
kill -INT $child
wait $child
check "the status of the signal" test $? = 130
says 'lit.ply has the light of the last complete bake'
check "the answer tells it" test "$(value interrupted)" = true
check "the first bake" cmp first.ply lit.ply
finish

# tests/tools/outputs/test_signals.sh: a signal ends a run within a second in every phase, with the status 128 + signal and without a
# temporary file. $4 is a library to preload, which takes files without a name away.
source "$(dirname "$0")/../support.sh"
preload=${4:-}
count=$((40000 / ${scale:-1}))
"$program" make sphere -o ball.ply --triangles $count --inside --quiet
"$program" make terrain -o ground.ply --triangles $count --quiet
cat >lit.json <<'END'
{"models": {"ball": "ball.ply"},
 "materials": {"lamp": {"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}},
 "instances": [{"name": "ball", "model": "ball", "material": "lamp"}]}
END
for i in $(seq 2000); do echo "1 0 0 0 0 1 0 0 0 0 1 0"; done >poses.txt
mkfifo pipe

now() { date +%s%N; }

# ends SIGNAL SECONDS COMMAND...: sends the signal after the time, and checks status, time and leftovers.
ends() {
    local name=$1 wait=$2 number begin end status
    number=$(kill -l "$name")
    shift 2
    timeout 60 "$program" "$@" >out 2>err &
    local parent=$!
    sleep "$wait"
    local child
    child=$(pgrep -P $parent)
    begin=$(now)
    kill -"$name" "$child" 2>/dev/null
    wait $parent 2>/dev/null
    status=$?
    end=$(now)
    checks=$((checks + 2))
    [ "$status" = $((128 + number)) ] || fail "expected status $((128 + number)), found $status: $*"
    [ $(((end - begin) / 1000000)) -lt $((1000 * (${scale:-1} > 1 ? 5 : 1))) ] || fail "took $(((end - begin) / 1000000)) ms to end: $*"
    check "no temporary file: $*" test -z "$(find . -name '.facetree*')"
}
for preloaded in '' $preload; do
    export LD_PRELOAD=$preloaded
    for name in HUP INT TERM; do
        # With --light direct, a bake has nothing to write before its end.
        ends $name .3 bake lit.json -o new.ply --error 1e-9 --light direct
        ends $name .3 bake lit.json -o new.ply --method reference --samples 100000
        # A reader that waits for a pipe makes no progress: the grace ends.
        ends $name .2 simplify ball.ply --faces 9 -o pipe
        ends $name .2 raycast ball.ply --rays pipe -o new.txt
    done
    ends TERM .3 compare ball.ply ground.ply --samples 100000
    ends INT .5 collide ball.ply ball.ply --poses poses.txt --pairs -o new.txt
    ends HUP .4 make bust -o new.ply --triangles 4000000
    ends TERM .5 cluster ball.ply ground.ply pipe --format ply -o .
    unset LD_PRELOAD
done
check "no output" test -z "$(find . -name 'new.*')"
bash -c 'trap "" HUP; exec "$@"' ignoring "$program" simplify ball.ply --faces 9 -o pipe 2>err &
child=$!
sleep .3
kill -HUP $child
sleep .8
check "an ignored signal stays ignored" kill -TERM $child
wait $child 2>/dev/null
check "another signal ends the run" test $? = 143

# A mapped input that becomes shorter: 66, in one line.
for command in 'info long.ply' 'simplify long.ply --ratio .5 -o new.ply' 'cluster long.ply -o new.fct' 'bake long.ply -o new.ply'; do
    for delay in 0 .01 .02 .04 .08; do
        cp ground.ply long.ply
        "$program" $command >out 2>err &
        child=$!
        sleep $delay
        : >long.ply
        wait $child
        status=$?
        checks=$((checks + 1))
        case $status in
        0 | 65 | 66) ;;
        *) fail "a shortened input: status $status: $command" ;;
        esac
        rm -f new.*
    done
done

# A few bytes less give no SIGBUS, because the last page of the map stays: the answer would come from zeros.
# shortened COMMAND FEEDER: shortens long.fct while the command waits for the pipe.
shortened() {
    cp tree.fct long.fct
    "$program" $1 >out 2>err &
    child=$!
    sleep .5
    truncate -s -100 long.fct
    eval "$2"
    wait $child
    status=$?
    checks=$((checks + 1))
    [ $status = 66 ] || fail "expected status 66, found $status: $1"
    says "was shortened"
}
expect 0 cluster ball.ply -o tree.fct
shortened 'partition long.fct -k 9 -o pipe' 'cat pipe >labels.txt'
shortened 'compare long.fct pipe --format ply' 'cat ball.ply >pipe'
check "no answer" test ! -s out
# The first output is complete before the second one waits for its reader.
expect 0 partition tree.fct -k 9 -o labels.txt
shortened 'partition long.fct -k 9 -o whole.txt --adjacency pipe' 'cat pipe >pairs.txt'
says "outputs that exist are complete"
check "a complete output stays" cmp labels.txt whole.txt
finish

#!/bin/sh
# Runs one fuzzer for FUZZ_SECONDS (default 60) from its seeds; what it finds is kept beside the fuzzer. The entropic schedule
# would take a third of the time.
# usage: run.sh FUZZER_PROGRAM NAME
program=$1 name=$2
seeds=$(dirname "$0")/seeds/$name
[ -d "$seeds" ] || seeds=$(dirname "$0")/seeds/mesh
corpus=$(dirname "$program")/../corpus/$name
mkdir -p "$corpus" || exit 2
exec "$program" -max_total_time="${FUZZ_SECONDS:-60}" -max_len=4096 -len_control=20 -timeout=20 -rss_limit_mb=2048 -detect_leaks=1 -entropic=0 \
    -print_final_stats=1 -verbosity=0 -artifact_prefix="$corpus.found-" "$corpus" "$seeds"

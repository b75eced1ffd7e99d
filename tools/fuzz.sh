#!/bin/sh
# Fuzzes boundaries, one after the other, with AddressSanitizer; a line for each in target/fuzz.csv. What is found lies in
# fuzz/artifacts: mend it, and keep the input as fuzz/seeds/TARGET/found-WHAT, where `make test` runs it for ever.
#   tools/fuzz.sh SECONDS [TARGET...]
set -eu
cd "$(dirname "$0")/.."
seconds=$1
shift
PATH=$PWD/target/tools/bin:$PATH
[ $# -gt 0 ] || set -- $(sed -n 's/^name = "\([a-z_]*\)"$/\1/p' fuzz/Cargo.toml)
cargo +nightly fuzz build --no-trace-compares
host=$(rustc +nightly -vV | sed -n 's/^host: //p')
table=target/fuzz.csv
[ -f "$table" ] || echo "target,date,seconds,executions,edges,features,corpus,result" > "$table"
failed=
for target; do
    mkdir -p "fuzz/corpus/$target" "fuzz/artifacts/$target"
    log=target/fuzz-$target.log
    result=nothing
    # A gibibyte is far more than inputs of this size may take, and a minute far longer, also on a busy machine.
    "fuzz/target/$host/release/$target" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 -max_len=8192 \
        -print_final_stats=1 -artifact_prefix="fuzz/artifacts/$target/" "fuzz/corpus/$target" "fuzz/seeds/$target" \
        > "$log" 2>&1 || { result=found; failed="$failed $target"; }
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    last=$(grep -o 'cov: [0-9]* ft: [0-9]* corp: [0-9]*' "$log" | tail -1)
    took=$(sed -n 's/^Done [0-9]* runs in \([0-9]*\) second.*/\1/p' "$log")
    set_of() { echo "$last" | sed -n "s/.*$1: \([0-9]*\).*/\1/p"; }
    echo "$target,$(date -u +%F),${took:-},${executions:-},$(set_of cov),$(set_of ft),$(set_of corp),$result" | tee -a "$table"
done
[ -z "$failed" ] || { echo "found something in:$failed (see target/fuzz-TARGET.log and fuzz/artifacts)" >&2; exit 1; }

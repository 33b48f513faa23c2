#!/usr/bin/env bash
# Counts instructions and cache misses of estimates, a vertex, with valgrind's cachegrind, and sets them beside what reading every
# neighbourhood once would take.
#
#   tools/reference/count_instructions.sh [VERTICES=100000]
#
# COUNT_BIN   the example estimate_torus, built; default: built here
# COUNT_L1    first-level data cache to simulate, as size,ways,line; default 49152,12,64
# COUNT_LL    last-level cache; default 2097152,16,64 (the second level of the machine that docs/limits.md is of)
#
# The mesh is a torus of random points. Making it is measured by itself and taken off. Valgrind has no AVX-512 and says so to programs,
# so what is counted is the portable code: the same arithmetic in the same order, in narrower registers. So instructions are those of
# other processors; misses, which are of the data, are those of any. One line a setting, as a row of a table. About ten minutes.
set -euo pipefail

vertices=${1:-100000}
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
l1=${COUNT_L1:-49152,12,64}
ll=${COUNT_LL:-2097152,16,64}

if [ -z "${COUNT_BIN:-}" ]; then
    cargo build --release --quiet --manifest-path "$root/Cargo.toml" -p osculate-geom --example estimate_torus
    COUNT_BIN="$root/target/release/examples/estimate_torus"
fi

# Instructions, data references, their misses in the first level and in the last: totals of a run.
events() {
    valgrind --tool=cachegrind --cache-sim=yes --D1="$l1" --LL="$ll" --cachegrind-out-file="$work/out" \
        --log-file="$work/log" "$COUNT_BIN" "$vertices" "$@" >"$work/printed"
    awk '/^events:/ { for (i = 2; i <= NF; i++) at[$i] = i }
         /^summary:/ { print $at["Ir"], $at["Dr"] + $at["Dw"], $at["D1mr"] + $at["D1mw"], $at["DLmr"] + $at["DLmw"] }' "$work/out"
}

base=$(events none)
echo "| setting | vertices read | their bytes | instructions | data references | first-level misses, bytes | last-level misses, bytes |"
echo "|---|---|---|---|---|---|---|"
row() {
    local name=$1 rings=$2
    shift 2
    local found size
    found=$(events "$@")
    size=$("$COUNT_BIN" "$vertices" none "$rings")
    # A neighbour is a position and a normal: six numbers of eight bytes. A miss brings a line of 64.
    echo "$base $found" | awk -v n="$vertices" -v name="$name" -v size="$size" '{
        printf "| %s | %.1f | %.0f | %.0f | %.0f | %.0f | %.0f |\n", name, size, 48 * size,
            ($5 - $1) / n, ($6 - $2) / n, 64 * ($7 - $3) / n, 64 * ($8 - $4) / n }'
}

row "\`quadric\`, 2 rings" 2 quadric 2
row "\`quadric\`, 5 rings" 5 quadric 5
row "\`jet\`, degree 4 on 3 rings" 3 jet 3 4
row "\`auto\`, tolerance 0.005" 3 auto
row "\`normals\`, 1 ring" 1 normals

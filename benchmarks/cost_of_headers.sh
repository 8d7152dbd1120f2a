#!/usr/bin/env bash
# What compiling each header costs, over the standard headers (and Eigen's) that it includes: cost_of_headers.sh
# COMPILER HEADER... In processor time, the two measured in turn, medians of 5; with MOST (environment) in millions of
# the compiler's instructions, and fails where a ratio is above it. And the lines of code that a header brings.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
compiler=${1:-c++}
most=${MOST:-}
if [ -n "$most" ]; then runs=1 unit="10⁶ instructions"; else runs=5 unit=ms; fi
status=0
TIMEFORMAT='%U %S'
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
eigen=$(pkg-config --cflags-only-I eigen3)

cost() { # of compiling $1
    # shellcheck disable=SC2206 # options without spaces in them
    local compile=("$compiler" -std=c++17 -O2 -I include $eigen -c "$1" -o "$folder/object")
    if [ -n "$most" ]; then
        valgrind --tool=callgrind --trace-children=yes --callgrind-out-file=/dev/null "${compile[@]}" 2>"$folder/said" ||
            { cat "$folder/said" >&2; exit 1; }
        awk '/Collected :/ { sum += $NF } END { printf "%.1f\n", sum / 1e6 }' "$folder/said"
    else
        { time "${compile[@]}"; } 2>&1 | awk 'END { printf "%d\n", 1000 * ($1 + $2) }'
    fi
}
median() { sort -n "$1" | sed -n "$(((runs + 1) / 2))p"; }

printf '| header | lines of code | its other headers, %s | with it, %s | ratio |\n| --- | --- | --- | --- | --- |\n' "$unit" "$unit"
for header in "${@:2}"; do
    echo "#include <$header>" >"$folder/library.cpp"
    # shellcheck disable=SC2086
    own=$("$compiler" -std=c++17 -I include $eigen -MM -MT '' "$folder/library.cpp" | grep -o 'include/mis/[a-z_/]*\.hpp')
    # shellcheck disable=SC2086 # a list of file names without spaces
    grep -hoE '^ *# *include +<(Eigen/)?[A-Za-z_]+>' $own | sort -u >"$folder/others.cpp"
    # shellcheck disable=SC2086
    lines=$(cat $own | grep -cvE '^ *(//.*)?$')
    rm -f "$folder"/*.costs
    for ((run = 0; run < runs; ++run)); do
        cost "$folder/library.cpp" >>"$folder/library.costs"
        cost "$folder/others.cpp" >>"$folder/others.costs"
    done
    awk -v header="$header" -v lines="$lines" -v with="$(median "$folder/library.costs")" \
        -v others="$(median "$folder/others.costs")" -v most="$most" 'BEGIN {
            is_met = most == "" || with / others <= most
            printf "| `%s` | %d | %d | %d | %.3f%s |\n", header, lines, others, with, with / others, is_met ? "" : " MISSED"
            exit !is_met
        }' || status=1
done
exit $status

#!/usr/bin/env bash
# Compile time of each header over that of the standard headers (and Eigen's) that it includes: time_headers.sh
# COMPILER HEADER... Processor time, the two measured in turn, medians of RUNS (environment; 5); and the lines of code
# that it brings. Fails where a ratio is above MOST (environment; none).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
compiler=${1:-c++}
runs=${RUNS:-5} most=${MOST:-}
status=0
TIMEFORMAT='%U %S'
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
eigen=$(pkg-config --cflags-only-I eigen3)

processor_time() { # of compiling $1, in milliseconds
    local used
    # shellcheck disable=SC2086 # options without spaces in them
    used=$({ time "$compiler" -std=c++17 -O2 -I include $eigen -c "$1" -o "$folder/object"; } 2>&1)
    awk -v used="$used" 'BEGIN { split(used, t, " "); printf "%d\n", 1000 * (t[1] + t[2]) }'
}
median() { sort -n "$1" | sed -n "$(((runs + 1) / 2))p"; }

printf '| header | lines of code | its other headers, ms | with it, ms | ratio |\n| --- | --- | --- | --- | --- |\n'
for header in "${@:2}"; do
    echo "#include <$header>" >"$folder/library.cpp"
    # shellcheck disable=SC2086
    own=$("$compiler" -std=c++17 -I include $eigen -MM -MT '' "$folder/library.cpp" | grep -o 'include/mis/[a-z_/]*\.hpp')
    # shellcheck disable=SC2086 # a list of file names without spaces
    grep -hoE '^ *# *include +<(Eigen/)?[A-Za-z_]+>' $own | sort -u >"$folder/others.cpp"
    # shellcheck disable=SC2086
    lines=$(cat $own | grep -cvE '^ *(//.*)?$')
    rm -f "$folder"/*.times
    for ((run = 0; run < runs; ++run)); do
        processor_time "$folder/library.cpp" >>"$folder/library.times"
        processor_time "$folder/others.cpp" >>"$folder/others.times"
    done
    awk -v header="$header" -v lines="$lines" -v with="$(median "$folder/library.times")" \
        -v others="$(median "$folder/others.times")" -v most="$most" 'BEGIN {
            is_met = most == "" || with / others <= most
            printf "| `%s` | %d | %d | %d | %.2f%s |\n", header, lines, others, with, with / others, is_met ? "" : " MISSED"
            exit !is_met
        }' || status=1
done
exit $status

#!/usr/bin/env bash
# Compile time of <mis/mis.hpp> against that of the standard headers it includes. Fails above 1.3.
# usage: tests/include_cost.sh [COMPILER]; processor time, the two measured in turn, medians compared.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
compiler=${1:-c++}
runs=41
limit=1.3
TIMEFORMAT='%U %S'

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
echo '#include <mis/mis.hpp>' >"$folder/library.cpp"
own_headers=$("$compiler" -std=c++17 -I include -MM -MT '' "$folder/library.cpp" | grep -o 'include/mis/[a-z_]*\.hpp')
# shellcheck disable=SC2086 # a list of file names without spaces
grep -hoE '^ *# *include +<[a-z_]+>' $own_headers | sort -u >"$folder/standard.cpp"

processor_time() { # of compiling $1, in milliseconds
    local used
    used=$({ time "$compiler" -std=c++17 -O2 -I include -c "$folder/$1.cpp" -o "$folder/$1.o"; } 2>&1)
    awk -v used="$used" 'BEGIN { split(used, t, " "); printf "%d\n", 1000 * (t[1] + t[2]) }'
}
median() { sort -n "$1" | sed -n "$(((runs + 1) / 2))p"; }

for ((run = 0; run < runs; ++run)); do
    processor_time library >>"$folder/library.times"
    processor_time standard >>"$folder/standard.times"
done
awk -v library="$(median "$folder/library.times")" -v standard="$(median "$folder/standard.times")" \
    -v compiler="$compiler" -v limit=$limit 'BEGIN {
    ratio = library / standard
    printf "%s: <mis/mis.hpp> %d ms, its standard headers %d ms, ratio %.2f (at most %s)\n",
        compiler, library, standard, ratio, limit
    exit ratio > limit
}'

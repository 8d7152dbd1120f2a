#!/usr/bin/env bash
# Runs the benchmarks whose numbers are ratios or instruction counts, and writes them as one page with its picture:
# report.sh FOLDER_OF_PROGRAMS FOLDER. Everything is run, whatever fails; fails if a bar is missed.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
programs=${1:?usage: report.sh FOLDER_OF_PROGRAMS FOLDER} report=${2:?usage: report.sh FOLDER_OF_PROGRAMS FOLDER}
mkdir -p "$report"
missed=()

# section NAME COMMAND..: prints and keeps its table
section() {
    local name=$1
    shift
    if [ -x "$1" ]; then
        "$@" | tee "$report/$name.txt" || missed+=("$name")
    else
        echo "(not built here)" | tee "$report/$name.txt"
    fi
    echo
}

clang=$programs/call_instructions_by_clang
[ -x "$clang" ] || clang="" # unquoted below, so that it then is no argument
section calls "$here/count_calls.sh" "$programs/call_instructions" "$report" $clang
section program "$here/count_program.sh" "$programs/whole_program"
section lengths "$here/count_lengths.sh" "$programs/length_instructions" "$report"
section weights "$here/count_weights.sh" "$programs/weight_instructions"
section optimal "$here/count_optimal.sh" "$programs/optimal_instructions" "$programs/optimal_instructions_native"
section throughput "$programs/throughput_benchmark"
section bytes "$here/count_bytes.sh" "$programs/call_instructions"
section headers "$here/cost_of_headers.sh" "${CXX:-c++}" mis/heuristic.hpp mis/packet.hpp mis/batch.hpp mis/path.hpp \
    mis/subpath.hpp mis/bias.hpp mis/mis.hpp mis/optimal.hpp mis/verify.hpp

machine=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)
compiler=$("${CXX:-c++}" --version | head -n 1)
awk -v folder="$report" -v machine="$machine" -v compiler="$compiler" '
    match($0, /^@[a-z]+@$/) {
        file = folder "/" substr($0, 2, length($0) - 2) ".txt"
        while ((getline line < file) > 0) print line
        next
    }
    { gsub(/@machine@/, machine); gsub(/@compiler@/, compiler); print }' "$here/performance.md.in" >"$report/performance.md"
if [ -n "${GNUPLOT-}" ]; then
    "$GNUPLOT" -c "$here/performance.gp" "$report"
fi
echo "The page of all of the above: $report/performance.md"
[ ${#missed[@]} -eq 0 ] || { echo "missed bars: ${missed[*]}" >&2; exit 1; }

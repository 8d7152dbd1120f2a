#!/usr/bin/env bash
# Instructions of each call of the two-number recursion, beside those of three numbers per vertex: count_calls.sh
# call_instructions FOLDER [THE SAME BY CLANG]; the table for a picture goes to FOLDER/calls.csv. Not inlined, inputs in
# memory, the call included. Fails if a call costs more than it may, which is said for GCC 12 and the release preset's
# flags, float. By Clang it should cost at most 30 % more; what does not is marked, and fails nothing.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/callgrind.sh"
gcc=${1:?usage: count_calls.sh PROGRAM FOLDER [PROGRAM BY CLANG]} folder=${2:?where to put calls.csv} clang=${3-}
repetitions=1000
status=0
calls=(upkeep step dirac connection next_event camera_connection light_hit merge kept_next_event pinhole kept_light_hit)

# at most, in the order of the calls; power 2 may cost 30 % more
declare -A limits=(
    [any_balance]="32 31 8 35 30 27 23 21 - - -"
    [known_balance]="- 19 - 21 23 20 - 13 19 13 12"
    [any_power]="41.6 40.3 10.4 45.5 39 35.1 29.9 27.3 - - -"
    [known_power]="- 24.7 - 27.3 29.9 26 - 16.9 24.7 16.9 15.6"
)

# rows PROGRAM FACTOR SCHEME..: of the bars times FACTOR
rows() {
    local program=$1 factor=$2 scheme i count most limit counts
    shift 2
    for scheme in "$@"; do
        read -ra limit <<<"${limits[$scheme]-}"
        mapfile -t counts < <(instructions_of "$program" "$scheme" -- "${calls[@]/%/<}")
        printf '| %-20s' "$scheme"
        for i in "${!calls[@]}"; do
            count=$(awk -v t="${counts[$i]}" -v n=$repetitions 'BEGIN { printf "%.0f", t / n + 1 }')
            most=${limit[$i]:--}
            if [ "$most" != - ] && ! awk -v c="$count" -v m="$most" -v f="$factor" 'BEGIN { exit !(c > 1 && c <= f * m) }'; then
                count="$count MISSED"
                [ "$factor" != 1 ] || status=1
            fi
            printf ' | %s' "$count"
            columns[i]+=",${count%% *}"
        done
        echo ' |'
    done
}

printf '| %-20s' "by GCC"
printf ' | %s' "${calls[@]//_/ }"
printf ' |\n|%s\n' "$(printf ' --- |%.0s' x "${calls[@]}")"
mapfile -t schemes < <("$gcc")
columns=("${calls[@]}")
rows "$gcc" 1 "${schemes[@]}"
{
    echo "call,$(IFS=, && echo "${schemes[*]}")"
    printf '%s\n' "${columns[@]:0:8}" | tr _ ' '
} >"$folder/calls.csv"
if [ -n "$clang" ]; then
    printf '| by Clang %s|\n' "$(printf '|%.0s ' "${calls[@]}")"
    rows "$clang" 1.3 three_balance any_balance known_balance three_power any_power known_power
fi
[ $status -eq 0 ] || echo "some calls cost more than they may: MISSED"
exit $status

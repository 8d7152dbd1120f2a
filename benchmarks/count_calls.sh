#!/usr/bin/env bash
# Instructions of each call of the two-number recursion, beside those of three numbers per vertex: count_calls.sh
# call_instructions. Float; not inlined, inputs in memory, the call included. Callgrind counts instructions, which do
# not depend on how busy the machine is. Fails if a call costs more than it may, which is said for GCC 12 and the
# release preset's flags.
set -euo pipefail
program=${1:?usage: count_calls.sh PROGRAM}
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

printf '%-16s' "scheme"
printf ' %17s' "${calls[@]}"
echo
for scheme in $("$program"); do
    read -ra limit <<<"${limits[$scheme]-}"
    printf '%-16s' "$scheme"
    for i in "${!calls[@]}"; do
        call=${calls[$i]}
        total=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null \
            --toggle-collect="*namespace)::$call<*" "$program" "$scheme" "$call" 2>&1 | awk '/Collected/ { print $NF }')
        count=$(awk -v t="$total" -v n=$repetitions 'BEGIN { printf "%.1f", t / n + 1 }')
        most=${limit[$i]:--}
        if [ "$most" != - ] && ! awk -v c="$count" -v m="$most" 'BEGIN { exit !(c > 1 && c <= m) }'; then
            count="$count(>$most)"
            status=1
        fi
        printf ' %17s' "$count"
    done
    echo
done
[ $status -eq 0 ] || echo "some calls cost more than they may: (>at most)"
exit $status

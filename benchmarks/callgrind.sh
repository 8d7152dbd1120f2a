# To be sourced: instructions of functions and what they call, which do not depend on how busy the machine is.

# instructions_of PROGRAM [ARGUMENT..] -- NAME..: of each function template of the program's anonymous namespace whose
# name begins so, one after the other; a dash for one that was not called.
instructions_of() {
    local run=() found
    while [ "$1" != -- ]; do
        run+=("$1")
        shift
    done
    shift
    found=$(mktemp)
    valgrind --tool=callgrind --callgrind-out-file="$found" "${run[@]}" >"$found.said" 2>&1 ||
        { cat "$found.said" >&2; return 1; }
    callgrind_annotate --inclusive=yes --threshold=100 --show-percs=no "$found" | awk -v names="$(printf '%s\n' "$@")" '
        BEGIN { n = split(names, name, "\n") }
        { for (i = 1; i <= n; ++i) if (index($0, "(anonymous namespace)::" name[i])) { gsub(",", "", $1); total[i] += $1 } }
        END { for (i = 1; i <= n; ++i) print (i in total) ? total[i] : "-" }'
    rm -f "$found" "$found.said"
}

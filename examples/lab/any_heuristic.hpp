// A heuristic chosen at run time: --heuristic. The library's own are types, so that nothing is decided in
// inner loops; a renderer with one heuristic needs nothing of this.
#pragma once

#include <mis/heuristic.hpp>
#include <mis/media.hpp>

namespace lab {

using mis::heuristic_kind;

struct any_heuristic {
    heuristic_kind kind = heuristic_kind::balance;
    double parameter = 2; // beta of power, alpha of cutoff

    template <class Visit> auto visit(Visit&& visit) const {
        switch (kind) {
        case heuristic_kind::average:
            return visit(mis::average);
        case heuristic_kind::power: // 2 without pow, which would take longer than all else
            return parameter == 2 ? visit(mis::power) : visit(mis::power_heuristic{parameter});
        case heuristic_kind::maximum:
            return visit(mis::maximum);
        default:
            return visit(mis::balance); // cutoff weighs complete paths only, and has no recursion
        }
    }
    template <class T> T share(T q, T largest) const {
        if (kind == heuristic_kind::cutoff)
            return mis::cutoff_heuristic{parameter}.share(q, largest);
        return visit([&](const auto& h) { return h.share(q, largest); });
    }
    template <class T> T times(T s, T x) const {
        return visit([&](const auto& h) { return h.times(s, x); });
    }
    template <class T> T join(T x, T y) const {
        return visit([&](const auto& h) { return h.join(x, y); });
    }
    template <class T> T against(T own, T others) const {
        return visit([&](const auto& h) { return h.against(own, others); });
    }
};

// The families of merges at a vertex in a medium as one. Average counts techniques and cutoff needs all at
// once: for these there is none, see has_joined.
inline bool has_joined(const any_heuristic& h) {
    return h.kind != heuristic_kind::average && h.kind != heuristic_kind::cutoff;
}
template <class T> T joined(const any_heuristic& h, const mis::family_sizes<T>& sizes) {
    if (h.kind == heuristic_kind::power)
        return h.parameter == 2 ? mis::joined(mis::power, sizes)
                                : mis::joined(mis::power_heuristic{h.parameter}, sizes);
    return h.kind == heuristic_kind::maximum ? mis::joined(mis::maximum, sizes)
                                             : mis::joined(mis::balance, sizes);
}

} // namespace lab

// SPDX-License-Identifier: MIT
// Floor 5: which mistakes explain a renderer's wrong weights.
//
//     mis::diagnosis d;
//     for (const mis::path_record& record : records)
//         mis::judge(d, record);
//     for (const mis::suspect& s : mis::suspects_of(d).suspects)
//         std::puts(s.mistake->what);
//
// Every mistake, and every set of a few, predicts the weight that a renderer with it would have claimed. A
// mistake *explains* a wrong weight that it predicts, and *spoils* a right one that it would have changed.
// The suspects are the set that explains the most and spoils the least; a further mistake is only added to a
// set for what it explains beyond it. Single mistakes are scored on all records, sets of several on a random
// sample of them, so that memory stays constant.
#pragma once

#include <array>
#include <mis/verify/mistakes.hpp>
#include <random>

namespace mis {

enum class verdict : unsigned char {
    agrees,
    disagrees,
    undecided,  // maximum and cutoff: hangs on rounding
    incomplete, // a density that the weight needs is not given
    bad_numbers // a density is NaN, infinite or negative
};

// What has been found out about one record.
struct judgement {
    mis::verdict verdict = verdict::agrees;
    double right = 0;   // the weight that follows from the record; with agrees, disagrees, undecided
    record_place place; // the field that is missing, or bad
};

// Two weights are equal, relative to the larger; weights below 1e-30 are 0. NaN equals NaN and infinity
// infinity, because a mistake may predict them.
inline bool agree(double a, double b, double tolerance) {
    if (!is_number(a) || !is_number(b))
        return !is_number(a) && !is_number(b) && is_nan(a) == is_nan(b);
    return std::abs(a - b) <= tolerance * std::max(std::abs(a), std::abs(b)) + 1e-30;
}

struct diagnosis {
    double tolerance = 1e-4;

    // Of all records judged.
    std::int64_t records = 0, agreeing = 0, disagreeing = 0, undecided = 0, unusable = 0;
    struct score {
        std::int64_t explained = 0; // disagreeing records that it predicts
        std::int64_t spoiled = 0;   // agreeing records that it would change
        std::int64_t unknown = 0;   // records that lack the field it needs
    };
    std::array<score, mistake_count> scores{};

    // Ties of the maximum heuristic with a weight of 0 or 1: rounding may have decided them.
    std::int64_t ties_won = 0, ties_lost = 0;

    // Random samples of each kind.
    static constexpr std::size_t most_disagreeing = 2000, most_agreeing = 500, most_ties = 100;
    std::vector<path_record> disagreeing_sample, agreeing_sample, tied_sample;
    std::minstd_rand generator{1};

    // Reused from record to record.
    weight_terms right_terms, wrong_terms;
};

// A mistake that explains wrong weights, with examples.
struct suspect {
    const mis::mistake* mistake = nullptr;
    std::int64_t affected = 0; // sampled records whose weight it changes
    struct example {
        std::int64_t line = 0;
        double claimed = 0, right = 0, predicted = 0; // predicted by all suspects together
    };
    std::vector<example> examples;
};

struct finding {
    std::vector<suspect> suspects;           // the one that explains the most first; none: unexplained
    std::int64_t explained = 0, spoiled = 0; // by all of them, of `disagreeing` and `agreeing` records
    std::int64_t disagreeing = 0, agreeing = 0;
    std::vector<const mistake*> closest;    // no suspects, but they explain a tenth or more
    std::vector<const mistake*> equivalent; // single mistakes that would explain the same records
    std::vector<const mistake*> unknown;    // that cannot be told, because records lack a field
};

namespace detail {

// Keeps each of the `seen` records with the same probability.
inline void sample(std::vector<path_record>& kept, std::size_t most, std::int64_t seen,
                   const path_record& record, std::minstd_rand& generator) {
    if (kept.size() < most) {
        kept.reserve(most);
        kept.push_back(record);
        return;
    }
    const auto place = std::uniform_int_distribution<std::int64_t>(0, seen - 1)(generator);
    if (place < static_cast<std::int64_t>(most))
        kept[static_cast<std::size_t>(place)] = record;
}

// The place where a density is missing that the technique at `place` needs.
inline record_place missing_field(const weight_terms& terms, int place) {
    const int n = size_of(terms);
    const technique t = technique_at(n, place);
    const auto is_missing = [](const std::vector<double>& densities, int i) {
        return log_density::is_missing(densities[static_cast<std::size_t>(i)]);
    };
    for (int i = 0; i < t.camera_vertices; ++i)
        if (is_missing(terms.from_camera, i))
            return {i, "density_from_camera"};
    for (int i = t.camera_vertices; i < n; ++i)
        if (is_missing(terms.from_light, i))
            return {i, "density_from_light"};
    return {n - 1, "pdf_next_event"};
}

// Mistakes by their places in the table, in ascending order.
using mistake_set = std::vector<std::size_t>;

inline planted plant_all(const mistake_set& set, weight_terms& terms, const path_record& record) {
    planted done = planted::nothing;
    for (const std::size_t k : set) {
        const planted one = mistakes[k].plant(terms, record);
        if (one == planted::unknown)
            return planted::unknown;
        done = done | one;
    }
    return done;
}

// A record of the sample, with all that scoring needs.
struct sampled {
    const path_record* record;
    weight_terms terms;
    double right;
    bool disagrees;
};

// What a set predicts for a record; false where it predicts nothing.
inline bool predict(const mistake_set& set, const sampled& s, weight_terms& scratch, double& weight) {
    scratch = s.terms;
    const planted done = plant_all(set, scratch, *s.record);
    if (done == planted::unknown)
        return false;
    if (done == planted::nothing) {
        weight = s.right;
        return true;
    }
    const expected_weight expected = weight_of(scratch);
    weight = expected.weight;
    return !expected.undecided && expected.missing < 0;
}

struct set_score {
    mistake_set set;
    int explained = 0, spoiled = 0;
    int gain() const { return explained - spoiled; }
};

struct search {
    std::vector<sampled> records;
    weight_terms scratch;
    double tolerance = 0;
    int threshold = 1; // records that a mistake must explain to be added to a set
};

inline bool is_explained(search& s, const mistake_set& set, const sampled& record) {
    double weight = 0;
    return predict(set, record, s.scratch, weight) && agree(weight, record.record->weight, s.tolerance);
}

// Scores a set on every `stride`-th record.
inline set_score score_of(search& s, const mistake_set& set, std::size_t stride = 1) {
    set_score result{set, 0, 0};
    for (std::size_t i = 0; i < s.records.size(); i += stride) {
        const bool explained = is_explained(s, set, s.records[i]);
        result.explained += s.records[i].disagrees && explained;
        result.spoiled += !s.records[i].disagrees && !explained;
    }
    return result;
}

inline bool has_identifier(const mistake_set& set, const char* identifier) {
    return std::any_of(set.begin(), set.end(),
                       [&](std::size_t k) { return std::strcmp(mistakes[k].identifier, identifier) == 0; });
}
inline mistake_set with(mistake_set set, std::size_t k) {
    set.insert(std::upper_bound(set.begin(), set.end(), k), k);
    return set;
}

// Better: more gain; among equals fewer mistakes, then those that come first in the table.
inline bool is_better(const set_score& a, const set_score& b, int threshold) {
    const int gain_a = a.gain() - threshold * static_cast<int>(a.set.size());
    const int gain_b = b.gain() - threshold * static_cast<int>(b.set.size());
    if (gain_a != gain_b)
        return gain_a > gain_b;
    return a.set.size() != b.set.size() ? a.set.size() < b.set.size() : a.set < b.set;
}
inline void keep_best(std::vector<set_score>& all, std::size_t count, int threshold) {
    std::sort(all.begin(), all.end(),
              [&](const set_score& a, const set_score& b) { return is_better(a, b, threshold); });
    all.resize(std::min(all.size(), count));
}

// Adds mistakes to a set while each explains enough of what is left; at most four in all.
inline set_score grow(search& s, set_score start, const mistake_set& candidates) {
    constexpr std::size_t largest_set = 4;
    while (start.set.size() < largest_set) {
        std::vector<const sampled*> left;
        for (const sampled& r : s.records)
            if (r.disagrees && !is_explained(s, start.set, r))
                left.push_back(&r);
        set_score best = start;
        for (const std::size_t k : candidates) {
            if (has_identifier(start.set, mistakes[k].identifier))
                continue;
            const mistake_set larger = with(start.set, k);
            const auto found = std::count_if(left.begin(), left.end(),
                                             [&](const sampled* r) { return is_explained(s, larger, *r); });
            if (found < s.threshold)
                continue;
            const set_score grown = score_of(s, larger);
            if (is_better(grown, best, s.threshold))
                best = grown;
        }
        if (best.set.size() == start.set.size())
            break;
        start = best;
    }
    return start;
}

// Takes out the mistakes that explain nothing of their own.
inline set_score prune(search& s, set_score all) {
    for (std::size_t i = 0; i < all.set.size() && all.set.size() > 1;) {
        mistake_set smaller = all.set;
        smaller.erase(smaller.begin() + static_cast<std::ptrdiff_t>(i));
        const set_score without = score_of(s, smaller);
        if (is_better(without, all, s.threshold)) {
            all = without;
            i = 0;
        } else {
            ++i;
        }
    }
    return all;
}

inline void add_to(search& s, const std::vector<path_record>& records, bool disagree) {
    for (const path_record& r : records) {
        sampled one{&r, {}, 0, disagree};
        terms_of(r, one.terms);
        one.right = weight_of(one.terms).weight;
        s.records.push_back(std::move(one));
    }
}

// The set of mistakes that explains a sample best. Two mistakes may hide each other in every record, so pairs
// are tried as well as single mistakes, on a part of the sample, and the best of both are grown.
inline set_score best_set(search& s) {
    mistake_set candidates;
    std::vector<set_score> singles, pairs;
    for (std::size_t k = 0; k < mistake_count; ++k) {
        const bool shows = std::any_of(s.records.begin(), s.records.end(), [&](const sampled& r) {
            s.scratch = r.terms;
            return r.disagrees && mistakes[k].plant(s.scratch, *r.record) == planted::changed;
        });
        if (!shows)
            continue;
        candidates.push_back(k);
        singles.push_back(score_of(s, {k}));
    }
    constexpr std::size_t part = 160;
    const std::size_t stride = std::max<std::size_t>(1, s.records.size() / part);
    for (const std::size_t a : candidates)
        for (const std::size_t b : candidates)
            if (a < b && std::strcmp(mistakes[a].identifier, mistakes[b].identifier) != 0)
                pairs.push_back(score_of(s, {a, b}, stride));
    keep_best(singles, 5, s.threshold);
    keep_best(pairs, 8, 0);
    std::vector<set_score> starts = singles;
    for (const set_score& pair : pairs)
        starts.push_back(score_of(s, pair.set));
    set_score best;
    for (const set_score& start : starts) {
        const set_score grown = prune(s, grow(s, start, candidates));
        if (is_better(grown, best, s.threshold))
            best = grown;
    }
    return best;
}

// A suspect of a set, with what changes where it alone is taken out.
inline suspect describe(search& s, const mistake_set& set, std::size_t k, std::size_t examples) {
    suspect result;
    result.mistake = &mistakes[k];
    mistake_set others = set;
    others.erase(std::find(others.begin(), others.end(), k));
    for (const sampled& r : s.records) {
        double with_it = 0, without_it = 0;
        if (!r.disagrees || !predict(set, r, s.scratch, with_it) ||
            !agree(with_it, r.record->weight, s.tolerance))
            continue;
        if (predict(others, r, s.scratch, without_it) && agree(with_it, without_it, s.tolerance))
            continue;
        ++result.affected;
        if (result.examples.size() < examples)
            result.examples.push_back({r.record->line, r.record->weight, r.right, with_it});
    }
    return result;
}

} // namespace detail

// Compares one record's weight with the right one, and scores every mistake on it.
inline judgement judge(diagnosis& d, const path_record& record) {
    ++d.records;
    if (const record_place bad = first_bad_number(record); bad.field) {
        ++d.unusable;
        return {verdict::bad_numbers, 0, bad};
    }
    terms_of(record, d.right_terms);
    const expected_weight right = weight_of(d.right_terms);
    if (right.missing >= 0) {
        ++d.unusable;
        return {verdict::incomplete, 0, detail::missing_field(d.right_terms, right.missing)};
    }
    const bool agrees = agree(record.weight, right.weight, d.tolerance);
    if (right.tied > 1 && (record.weight == 0 || record.weight == 1)) {
        ++(record.weight == 0 ? d.ties_lost : d.ties_won);
        ++d.undecided;
        detail::sample(d.tied_sample, d.most_ties, d.ties_won + d.ties_lost, record, d.generator);
        return {verdict::undecided, right.weight, {}};
    }
    if (right.undecided) {
        ++d.undecided;
        return {verdict::undecided, right.weight, {}};
    }
    ++(agrees ? d.agreeing : d.disagreeing);
    for (std::size_t k = 0; k < mistake_count; ++k) {
        d.wrong_terms = d.right_terms;
        const planted done = mistakes[k].plant(d.wrong_terms, record);
        d.scores[k].unknown += done == planted::unknown;
        if (done != planted::changed)
            continue;
        const expected_weight wrong = weight_of(d.wrong_terms);
        const bool predicted =
            !wrong.undecided && wrong.missing < 0 && agree(record.weight, wrong.weight, d.tolerance);
        d.scores[k].explained += !agrees && predicted;
        d.scores[k].spoiled += agrees && !predicted;
    }
    if (agrees)
        detail::sample(d.agreeing_sample, d.most_agreeing, d.agreeing, record, d.generator);
    else
        detail::sample(d.disagreeing_sample, d.most_disagreeing, d.disagreeing, record, d.generator);
    return {agrees ? verdict::agrees : verdict::disagrees, right.weight, {}};
}

namespace detail {

// Rounding decides a tie of the maximum heuristic now for one technique and now for another. Always for, or
// always against, is a mistake: by chance, that happens in one of 2^15 dumps. Ties are those that remain with
// a set of mistakes; returns the set with the mistake of ties that they show, if any.
inline mistake_set with_wrong_ties(search& s, const mistake_set& set) {
    int won = 0, lost = 0, shared = 0;
    for (const sampled& r : s.records) {
        s.scratch = r.terms;
        if (plant_all(set, s.scratch, *r.record) == planted::unknown)
            continue;
        const expected_weight expected = weight_of(s.scratch);
        if (expected.tied == 1)
            continue;
        won += r.record->weight == 1;
        lost += r.record->weight == 0;
        shared += agree(r.record->weight, expected.weight, s.tolerance);
    }
    if (shared > 0 || won + lost < 16 || (won > 0 && lost > 0))
        return set;
    for (std::size_t k = 0; k < mistake_count; ++k) {
        if (mistakes[k].plant == break_ties<tie::all_win> && won > 0)
            return with(set, k);
        if (mistakes[k].plant == break_ties<tie::all_lose> && lost > 0)
            return with(set, k);
    }
    return set;
}

} // namespace detail

// The mistakes that explain the disagreeing records. None where all records agree, or where no set of
// mistakes explains half of those that do not: then the weights are unexplained.
inline finding suspects_of(const diagnosis& d, std::size_t examples = 2) {
    finding result;
    result.disagreeing = static_cast<std::int64_t>(d.disagreeing_sample.size());
    result.agreeing = static_cast<std::int64_t>(d.agreeing_sample.size());
    if (result.disagreeing == 0 && d.tied_sample.empty())
        return result;
    detail::search s;
    s.tolerance = d.tolerance;
    s.threshold = static_cast<int>(
        std::max<std::int64_t>(std::min<std::int64_t>(3, result.disagreeing), result.disagreeing / 400));
    detail::add_to(s, d.disagreeing_sample, true);
    detail::add_to(s, d.agreeing_sample, false);
    for (std::size_t k = 0; k < mistake_count; ++k)
        if (d.scores[k].unknown > 0)
            result.unknown.push_back(&mistakes[k]);
    detail::set_score best = detail::best_set(s);
    const std::int64_t gain = best.gain();
    if (gain < s.threshold || gain * 10 < result.disagreeing)
        best = {};
    if (gain * 2 < result.disagreeing) { // something else is wrong as well, or instead
        for (const std::size_t k : best.set)
            result.closest.push_back(&mistakes[k]);
        result.explained = best.explained;
        result.spoiled = best.spoiled;
        best = {};
    }
    const std::size_t without_ties = best.set.size();
    detail::add_to(s, d.tied_sample, true);
    best.set = detail::with_wrong_ties(s, best.set);
    const std::int64_t ties = best.set.size() > without_ties ? d.ties_won + d.ties_lost : 0;
    if (best.set.empty())
        return result;
    if (ties > 0) {
        result.disagreeing += static_cast<std::int64_t>(d.tied_sample.size());
        best = detail::score_of(s, best.set);
    }
    result.explained = best.explained;
    result.spoiled = best.spoiled;
    for (const std::size_t k : best.set)
        result.suspects.push_back(detail::describe(s, best.set, k, examples));
    std::stable_sort(result.suspects.begin(), result.suspects.end(),
                     [](const suspect& a, const suspect& b) { return a.affected > b.affected; });
    if (best.set.size() == 1) { // scored on all records
        const std::size_t only = best.set[0];
        result.disagreeing = d.disagreeing + ties;
        result.agreeing = d.agreeing;
        result.explained = d.scores[only].explained + ties;
        result.spoiled = d.scores[only].spoiled;
        result.suspects[0].affected = result.explained;
        for (std::size_t k = 0; k < mistake_count; ++k)
            if (k != only && std::strcmp(mistakes[k].identifier, mistakes[only].identifier) != 0 &&
                d.scores[k].explained == result.explained && d.scores[k].spoiled == result.spoiled)
                result.equivalent.push_back(&mistakes[k]);
    }
    return result;
}

} // namespace mis

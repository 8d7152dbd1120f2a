// SPDX-License-Identifier: MIT
// Floor 5: which mistakes explain a renderer's wrong weights.
//
//     mis::diagnosis d;
//     for (const mis::path_record& record : records)
//         mis::judge(d, record);
//     for (const mis::suspect& s : mis::suspects_of(d).suspects)
//         std::puts(mis::describe(s).c_str());
//
// Every mistake, and every set of a few, predicts the weight that a renderer with it would have claimed. A
// mistake *explains* a wrong weight that it predicts, and *spoils* a right one that it would have changed.
//
// Much can be explained by chance: of weights that are all 1, by every mistake that often predicts 1. So a
// set is scored by how much shorter the claims can be told with it than without, in nats: without it, one
// tells which weights are wrong, and each wrong weight by how often such a weight (or its ratio to the right
// one) occurs among the wrong ones; with it, one tells where it has shown, and is spared the weights that it
// explains. What it takes to name the set is subtracted. Suspects are the set with the highest score, if that
// is above 0 and it explains half of the wrong weights. A mistake may be confined to one place: a technique,
// a length, a kind of vertex, a material. Constants of the record, counts and beta, are fitted as well.
//
// Single records are compared with their right weight only; the search is made in random samples of those
// that disagree and of those that agree, weighed by what was seen, so that time and memory stay constant.
#pragma once

#include <array>
#include <cstdio>
#include <mis/verify/mistakes.hpp>
#include <random>
#include <string>

namespace mis {

enum class verdict : unsigned char {
    agrees,
    disagrees,
    undecided,  // maximum and cutoff: hangs on rounding
    incomplete, // a density that the weight needs is not given
    bad_numbers // first_bad_number has found one, or the right weight is none
};

// What has been found out about one record.
struct judgement {
    mis::verdict verdict = verdict::agrees;
    double right = 0;   // the weight that follows from the record; with agrees, disagrees, undecided
    record_place place; // the field that is missing, or bad
};

// Two weights are equal, relative to the larger; weights below 1e-30 are 0. NaN equals NaN and infinity
// infinity, because a mistake may predict them; the right weight is never one of them.
inline bool agree(double a, double b, double tolerance) {
    if (!is_number(a) || !is_number(b))
        return !is_number(a) && !is_number(b) && is_nan(a) == is_nan(b);
    return std::abs(a - b) <= tolerance * (std::max)(std::abs(a), std::abs(b)) + 1e-30;
}

struct diagnosis {
    double tolerance = 1e-4;

    // Of all records judged.
    std::int64_t records = 0, agreeing = 0, disagreeing = 0, undecided = 0, unusable = 0;

    // Ties of the maximum heuristic with a weight of 0 or 1: rounding may have decided them.
    std::int64_t ties_won = 0, ties_lost = 0;

    // Random samples of each kind. Right ones of long paths would fill memory, and say little.
    static constexpr std::size_t longest_agreeing = 100; // vertices
    std::int64_t agreeing_short = 0;                     // of agreeing records, those that are not longer
    static constexpr std::size_t most_disagreeing = 2000, most_agreeing = 2000, most_ties = 100;
    std::vector<path_record> disagreeing_sample, agreeing_sample, tied_sample;
    std::minstd_rand generator{1};

    weight_terms right_terms; // of the last record judged; reused
};

// Where a mistake is made: on which paths, or in the weights of which technique.
struct confinement {
    enum class by : unsigned char {
        nothing, // everywhere
        technique,
        vertices,        // of the path
        camera_vertices, // s
        dirac,           // the path has a Dirac scatterer,
        medium,          // or a vertex in a medium
        infinite_light,  // what it ends at
        dirac_light,
        material, // that a vertex of it has
        family    // of a merge in a medium
    };
    by what = by::nothing;
    double value = 0; // of technique, vertices, camera_vertices, material, family
};

inline bool contains(const confinement& where, const path_record& r) {
    const auto any = [&](auto&& has) { return std::any_of(r.vertices.begin(), r.vertices.end(), has); };
    switch (where.what) {
    case confinement::by::nothing:
        return true;
    case confinement::by::technique:
        return static_cast<double>(r.technique.kind) == where.value;
    case confinement::by::vertices:
        return static_cast<double>(r.vertices.size()) == where.value;
    case confinement::by::camera_vertices:
        return r.technique.camera_vertices == where.value;
    case confinement::by::dirac:
        return any([](const recorded_vertex& x) { return x.kind == vertex_kind::dirac; });
    case confinement::by::medium:
        return any([](const recorded_vertex& x) { return x.kind == vertex_kind::medium; });
    case confinement::by::infinite_light:
        return !r.vertices.empty() && r.vertices.back().kind == vertex_kind::infinite_light;
    case confinement::by::dirac_light:
        return !r.vertices.empty() && r.vertices.back().dirac;
    case confinement::by::material:
        return any([&](const recorded_vertex& x) { return x.material == where.value; });
    case confinement::by::family:
        return detail::is_merge_in_medium(r) && static_cast<double>(r.family) == where.value;
    }
    return false;
}

// As the end of a sentence: "in connections only". Empty for everywhere.
inline std::string describe(const confinement& where) {
    static constexpr std::array<const char*, 7> techniques{"hits of the lens",
                                                           "camera connections",
                                                           "direct connections",
                                                           "connections",
                                                           "next events",
                                                           "light hits",
                                                           "merges"};
    const std::string number = std::to_string(static_cast<long long>(where.value));
    switch (where.what) {
    case confinement::by::nothing:
        break;
    case confinement::by::technique:
        return "in " + std::string(techniques[static_cast<std::size_t>(where.value)]) + " only";
    case confinement::by::vertices:
        return "in paths of " + number + " vertices only";
    case confinement::by::camera_vertices:
        return "where camera_vertices is " + number + " only";
    case confinement::by::dirac:
        return "in paths with a Dirac vertex only";
    case confinement::by::medium:
        return "in paths through a medium only";
    case confinement::by::infinite_light:
        return "in paths to an infinite light only";
    case confinement::by::dirac_light:
        return "in paths to a Dirac light only";
    case confinement::by::material:
        return "in paths with material " + number + " only";
    case confinement::by::family: {
        static constexpr std::array<const char*, 4> families{"point-point", "point-beam", "beam-point",
                                                             "beam-beam"};
        return "in " + std::string(families[static_cast<std::size_t>(where.value)]) + " merges only";
    }
    }
    return "";
}

// A constant of the records from which the weights do not follow, and one from which they do: the count of a
// technique, of merges times pi r^2, or beta. Of counts only their ratios can be told: it is given that of
// this technique alone is wrong.
struct fitted_constant {
    bool is_beta = false;
    technique_kind kind = technique_kind::light_hit;
    double given = 0, fitted = 0;
};

// The mistake of suspects whose constant has been fitted.
inline constexpr mistake wrong_constant{
    "wrong_constant", "A count, or beta, is not what the records say.",
    "Write down the constant that the weights are computed with, or compute them with the one that is true.",
    "", nullptr};

// A mistake that explains wrong weights, with examples.
struct suspect {
    const mis::mistake* mistake = nullptr; // wrong_constant where `constant` has been fitted
    fitted_constant constant;
    confinement where;
    std::int64_t affected = 0; // sampled records whose weight it changes
    double prevalence = 1;     // of the weights that it would change, as seen, those that it has changed
    struct example {
        std::int64_t line = 0;
        double claimed = 0, right = 0, predicted = 0; // predicted by all suspects together
    };
    std::vector<example> examples;
};

// What is wrong, in one sentence or two.
inline std::string describe(const suspect& s) {
    std::string text = s.mistake->what;
    if (s.mistake == &wrong_constant) {
        const fitted_constant& c = s.constant;
        static constexpr std::array<const char*, 7> terms{
            "hits of the lens", "camera connections", "direct connections",   "connections",
            "next events",      "light hits",         "merges, times pi r^2,"};
        char numbers[64];
        std::snprintf(numbers, sizeof numbers, "%.4g instead of %.4g", c.fitted, c.given);
        text = c.is_beta ? "The weights follow if beta were "
                         : "The weights follow if " + std::string(terms[static_cast<std::size_t>(c.kind)]) +
                               " counted ";
        text += std::string(numbers) + ".";
    }
    const std::string where = describe(s.where);
    return where.empty() ? text : text + " This is so " + where + ".";
}

struct finding {
    std::vector<suspect> suspects;              // the one that explains the most first; none: unexplained
    std::int64_t explained = 0, spoiled = 0;    // by all of them, of the sampled
    std::int64_t disagreeing = 0, agreeing = 0; // records, with ties that are explained
    std::vector<suspect> closest;               // no suspects, but they explain a tenth or more
    std::vector<const mistake*> equivalent;     // single mistakes that would explain the same records
    std::vector<const mistake*> unknown;        // that cannot be told, because records lack a field
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
    // The standard leaves open what distributions draw; reports shall not depend on who implements it. All
    // places are equally probable to a part in 1e9.
    const std::uint64_t high = generator() - (generator.min)(), low = generator() - (generator.min)();
    const std::uint64_t place = ((high << 31) + low) % static_cast<std::uint64_t>(seen);
    if (place < most)
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
    if (t.kind == technique_kind::merge) {
        const int j = t.camera_vertices - 1;
        const auto at = static_cast<std::size_t>(j);
        if (is_missing(terms.from_light, j) || !has_families_at(terms, at))
            return {j, "density_from_light"};
        const auto is_off = [&](merge_family f) {
            return log_density::is_zero(terms.families[static_cast<std::size_t>(f)]);
        };
        const bool no_beam_beam = is_off(merge_family::beam_beam);
        if (log_density::is_missing(terms.media[at].from_camera) &&
            !(no_beam_beam && is_off(merge_family::point_beam)))
            return {j, "beam_from_camera"};
        if (log_density::is_missing(terms.media[at].from_light) &&
            !(no_beam_beam && is_off(merge_family::beam_point)))
            return {j, "beam_from_light"};
        return {j, "sin_angle"};
    }
    return {n - 1, "pdf_next_event"};
}

// ---- Hypotheses ----

// One mistake of a hypothesis: of the table, or after it a constant (counts by technique_kind, then beta).
struct member {
    std::size_t mistake = 0;
    std::size_t place = 0;    // of search::places; 0 is everywhere
    double value = not_given; // of a constant: the logarithm of the count, or beta
};
inline constexpr std::size_t beta_constant = mistake_count + 7;
inline bool is_constant(const member& m) { return m.mistake >= mistake_count; }

// In ascending order of `mistake`, in which they are planted.
using hypothesis = std::vector<member>;

inline hypothesis with(hypothesis set, const member& m) {
    const auto before = [](const member& a, const member& b) { return a.mistake < b.mistake; };
    set.insert(std::upper_bound(set.begin(), set.end(), m, before), m);
    return set;
}
inline hypothesis without(hypothesis set, std::size_t i) {
    set.erase(set.begin() + static_cast<std::ptrdiff_t>(i));
    return set;
}
inline const char* identifier_of(const member& m) {
    return is_constant(m) ? wrong_constant.identifier : mistakes[m.mistake].identifier;
}
inline bool has_identifier(const hypothesis& set, const char* identifier) {
    return std::any_of(set.begin(), set.end(), [&](const member& m) {
        return !is_constant(m) && std::strcmp(identifier_of(m), identifier) == 0;
    });
}

// Weights that follow from no density: 1, or 1 over a number of techniques.
inline bool is_without_densities(std::size_t mistake) {
    return mistake < mistake_count &&
           (std::strcmp(mistakes[mistake].identifier, "unweighted") == 0 ||
            std::strcmp(mistakes[mistake].identifier, "average_of_techniques") == 0);
}

// Those that hide all others; the average heuristic still asks which techniques can make the path.
inline bool gives_constant(std::size_t mistake) {
    return is_without_densities(mistake) && mistakes[mistake].plant != use_heuristic<heuristic_kind::average>;
}
inline bool breaks_ties(std::size_t mistake) {
    return mistake < mistake_count && (mistakes[mistake].plant == break_ties<tie_rule::all_win> ||
                                       mistakes[mistake].plant == break_ties<tie_rule::all_lose>);
}

// A record with all that scoring needs.
struct sampled {
    const path_record* record;
    weight_terms terms;
    double right, claimed;
    double surprise = 0;             // that the claim is, among wrong ones, in nats
    std::vector<std::size_t> places; // that contain it, without everywhere
};

struct search {
    double tolerance = 0;
    std::vector<sampled> records;
    std::vector<confinement> places{{}};
    std::vector<std::vector<double>> predictions; // of each single mistake for each record, where computed
    std::vector<const mistake*> unknown;

    // Of the claims.
    std::vector<std::size_t> wrong, right; // places in `records`
    double right_scale = 1;    // of right records, how many have been seen for each, relative to wrong
    double null_cost = 0;      // of telling which are wrong, in nats
    std::size_t threshold = 1; // records that a mistake must explain

    weight_terms scratch;
};

inline planted plant(const member& m, weight_terms& terms, const path_record& record) {
    if (!is_constant(m))
        return mistakes[m.mistake].plant(terms, record);
    if (m.mistake == beta_constant) {
        if (terms.heuristic != heuristic_kind::power && terms.heuristic != heuristic_kind::balance)
            return planted::nothing;
        terms.heuristic = heuristic_kind::power;
        return set(terms.parameter, m.value);
    }
    return set(terms.counts[m.mistake - mistake_count], m.value);
}

// Whether a mistake is made in a record.
inline bool is_in(const member& m, const sampled& r) {
    return m.place == 0 || std::find(r.places.begin(), r.places.end(), m.place) != r.places.end();
}

inline planted plant_all(const hypothesis& set, const sampled& r, weight_terms& terms) {
    planted done = planted::nothing;
    terms = r.terms;
    for (const member& m : set) {
        if (!is_in(m, r))
            continue;
        done = done | plant(m, terms, *r.record);
        if (done == planted::unknown)
            break;
    }
    return done;
}

// What a hypothesis predicts for a record; not_given where it predicts nothing.
inline double prediction(search& s, const hypothesis& set, const sampled& r) {
    const planted done = plant_all(set, r, s.scratch);
    if (done == planted::unknown)
        return not_given;
    if (done == planted::nothing)
        return r.right;
    const expected_weight expected = weight_of(s.scratch);
    return expected.undecided || expected.missing >= 0 ? not_given : expected.weight;
}

// The predictions of a single mistake, everywhere: they do not depend on the claims, and are computed once.
inline const std::vector<double>& predictions_of(search& s, std::size_t mistake) {
    s.predictions.resize(mistake_count);
    std::vector<double>& all = s.predictions[mistake];
    for (std::size_t i = all.size(); i < s.records.size(); ++i)
        all.push_back(prediction(s, {member{mistake}}, s.records[i]));
    return all;
}

// ---- The score ----

// What has become of a record under a hypothesis.
enum outcome : unsigned char { unchanged = 0, changed = 1, explained = 2 }; // changed: but not into the claim

inline outcome outcome_of(const search& s, const sampled& r, double predicted) {
    if (!is_given(predicted) || agree(predicted, r.right, s.tolerance))
        return unchanged;
    return agree(predicted, r.claimed, s.tolerance) ? explained : changed;
}

// Of wrong records, then of right ones; in the order of search::wrong and search::right.
struct outcomes {
    std::vector<unsigned char> wrong, right;
};

inline outcomes outcomes_of(search& s, const hypothesis& set) {
    outcomes all;
    all.wrong.reserve(s.wrong.size());
    all.right.reserve(s.right.size());
    const bool is_single = set.size() == 1 && set[0].place == 0 && !is_constant(set[0]);
    const std::vector<double>* known = is_single ? &predictions_of(s, set[0].mistake) : nullptr;
    for (const std::size_t i : s.wrong)
        all.wrong.push_back(
            outcome_of(s, s.records[i], known ? (*known)[i] : prediction(s, set, s.records[i])));
    for (const std::size_t i : s.right)
        all.right.push_back(
            outcome_of(s, s.records[i], known ? (*known)[i] : prediction(s, set, s.records[i])));
    return all;
}

// Sums of outcomes.
struct tally {
    double explained = 0, changed = 0; // of wrong records
    double spoiled = 0;                // of right ones, as often as seen
    double surprise = 0;               // of those explained
};
inline tally operator+(const tally& a, const tally& b) {
    return {a.explained + b.explained, a.changed + b.changed, a.spoiled + b.spoiled, a.surprise + b.surprise};
}
inline tally operator-(const tally& a, const tally& b) {
    return {a.explained - b.explained, a.changed - b.changed, a.spoiled - b.spoiled, a.surprise - b.surprise};
}

// Constant predictions are few: a claim that is one of them says so by itself, where nothing else is wrong.
// In return they must hold nearly everywhere, see place_best.
inline constexpr double surprise_of_constants = 2.3;

// Wrong weights that may be too few to be sure: of so few, what is closest is told however little it
// explains.
inline constexpr std::size_t few_wrong = 20;

inline tally tally_of_wrong(const search& s, const hypothesis& set, std::size_t k, unsigned char o) {
    const sampled& r = s.records[s.wrong[k]];
    if (o != explained)
        return {0, double(o == changed), 0, 0};
    const bool is_constant = set.size() == 1 && is_without_densities(set[0].mistake) && is_in(set[0], r);
    return {1, 0, 0, is_constant ? (std::max)(r.surprise, surprise_of_constants) : r.surprise};
}
inline tally tally_of_right(const search& s, unsigned char o) {
    return {0, 0, o == unchanged ? 0.0 : s.right_scale, 0};
}
inline tally tally_of(const search& s, const hypothesis& set, const outcomes& o) {
    tally sum;
    for (std::size_t k = 0; k < o.wrong.size(); ++k)
        sum = sum + tally_of_wrong(s, set, k, o.wrong[k]);
    for (const unsigned char one : o.right)
        sum = sum + tally_of_right(s, one);
    return sum;
}

// The nats that it takes to tell which k of n they are.
inline double cost_of_choice(double k, double n) {
    const auto term = [&](double x) { return x > 0 ? -x * std::log(x / n) : 0.0; };
    return n > 0 ? term(k) + term(n - k) : 0.0;
}

// How much shorter the claims can be told, before the hypothesis itself is.
inline double evidence(const search& s, const tally& t) {
    const double wrong = static_cast<double>(s.wrong.size());
    const double right = s.right_scale * static_cast<double>(s.right.size());
    return s.null_cost + t.surprise - cost_of_choice(t.explained, t.explained + t.changed + t.spoiled) -
           cost_of_choice(wrong - t.explained, wrong + right - t.explained);
}

// Of telling a member: which of about 160 it is, and the chance of 1 in 1000 that a false one is named at
// all.
inline constexpr double cost_of_mistake = 12, cost_of_place = 5, cost_of_value = 15;
inline double cost_of(const hypothesis& set) {
    double cost = 0;
    for (const member& m : set)
        cost +=
            cost_of_mistake + (m.place != 0 ? cost_of_place : 0.0) + (is_constant(m) ? cost_of_value : 0.0);
    return cost;
}

struct scored {
    hypothesis set;
    tally sums;
    double score = 0;
};
inline scored score_of(search& s, const hypothesis& set) {
    if (set.empty())
        return {};
    const tally sums = tally_of(s, set, outcomes_of(s, set));
    return {set, sums, evidence(s, sums) - cost_of(set)};
}

// Better: a higher score, beyond rounding; among equals fewer mistakes, then those that come first.
inline bool is_better(const scored& a, const scored& b) {
    if (std::abs(a.score - b.score) > 1e-6)
        return a.score > b.score;
    if (a.set.size() != b.set.size())
        return a.set.size() < b.set.size();
    return std::lexicographical_compare(
        a.set.begin(), a.set.end(), b.set.begin(), b.set.end(),
        [](const member& x, const member& y) { return x.mistake < y.mistake; });
}
inline void keep_best(std::vector<scored>& all, std::size_t count) {
    std::sort(all.begin(), all.end(), is_better);
    all.resize((std::min)(all.size(), count));
}
inline bool is_complete(const search& s, const scored& a) {
    return a.sums.explained == static_cast<double>(s.wrong.size()) && a.sums.spoiled == 0;
}

// The places of all records, and what each place sums up to: one pass for all places.
template <class Add> void for_each_place(const search& s, std::size_t i, Add&& add) {
    add(std::size_t(0));
    for (const std::size_t place : s.records[i].places)
        add(place);
}

// Adds a mistake to a set in the place where that is best, given what has become of the records without and
// with it.
inline scored place_best(const search& s, const hypothesis& set, const outcomes& before, member m,
                         const outcomes& after) {
    std::vector<tally> without(s.places.size()), with_it(s.places.size()); // in each place
    const hypothesis larger = with(set, m);
    for (std::size_t k = 0; k < s.wrong.size(); ++k) {
        const tally a = tally_of_wrong(s, larger, k, before.wrong[k]);
        const tally b = tally_of_wrong(s, larger, k, after.wrong[k]);
        for_each_place(s, s.wrong[k], [&](std::size_t p) {
            without[p] = without[p] + a;
            with_it[p] = with_it[p] + b;
        });
    }
    for (std::size_t k = 0; k < s.right.size(); ++k) {
        const tally a = tally_of_right(s, before.right[k]), b = tally_of_right(s, after.right[k]);
        for_each_place(s, s.right[k], [&](std::size_t p) {
            without[p] = without[p] + a;
            with_it[p] = with_it[p] + b;
        });
    }
    scored best;
    best.score = -(std::numeric_limits<double>::max)();
    const std::size_t places = is_constant(m) ? 1 : s.places.size(); // a count is the same for all
    for (std::size_t p = 0; p < places; ++p) {
        const tally& here = with_it[p];
        const bool holds = here.explained >= 0.95 * (here.explained + here.changed + here.spoiled);
        if (here.explained == 0 || (is_without_densities(m.mistake) && !holds && s.wrong.size() > few_wrong))
            continue;
        m.place = p;
        scored one{with(set, m), without[0] - without[p] + here, 0};
        one.score = evidence(s, one.sums) - cost_of(one.set);
        if (best.set.empty() || is_better(one, best))
            best = one;
    }
    return best;
}

// ---- Claims ----

// How many of sorted numbers agree with x.
inline std::ptrdiff_t agreeing_with(const std::vector<double>& sorted, double x, double tolerance) {
    const double low = (std::min)(x * (1 - tolerance), x / (1 - tolerance)) - 1e-30;
    const double high = (std::max)(x * (1 - tolerance), x / (1 - tolerance)) + 1e-30;
    return std::upper_bound(sorted.begin(), sorted.end(), high) -
           std::lower_bound(sorted.begin(), sorted.end(), low);
}

// How unlikely each wrong claim is to be met by chance: as rarely as it, or its ratio to the right weight,
// occurs among the other wrong ones. At least one in 1,000 is expected, for samples of a few.
inline void measure_surprise(search& s) {
    std::vector<double> claims, ratios;
    const auto ratio_of = [](const sampled& r) { return r.right > 0 ? r.claimed / r.right : not_given; };
    std::ptrdiff_t nans = 0, infinities = 0;
    for (const std::size_t i : s.wrong) {
        const sampled& r = s.records[i];
        if (!is_number(r.claimed)) {
            ++(is_nan(r.claimed) ? nans : infinities);
            continue;
        }
        claims.push_back(r.claimed);
        if (is_given(ratio_of(r)) && is_number(ratio_of(r)))
            ratios.push_back(ratio_of(r));
    }
    std::sort(claims.begin(), claims.end());
    std::sort(ratios.begin(), ratios.end());
    const double others = static_cast<double>(std::max<std::size_t>(s.wrong.size(), 2) - 1);
    const double floor = (std::min)(1.0, (std::max)(1e-3, 2 * s.tolerance));
    for (const std::size_t i : s.wrong) {
        sampled& r = s.records[i];
        std::ptrdiff_t same = 0;
        if (!is_number(r.claimed)) {
            same = is_nan(r.claimed) ? nans : infinities;
        } else {
            same = agreeing_with(claims, r.claimed, s.tolerance);
            if (is_given(ratio_of(r)) && is_number(ratio_of(r)))
                same = (std::max)(same, agreeing_with(ratios, ratio_of(r), s.tolerance));
        }
        const bool is_common = r.claimed == 0 || r.claimed == 1; // whatever has been made of the others
        const double chance =
            (std::max)({floor, static_cast<double>(same - 1) / others, is_common ? 0.1 : 0.0});
        r.surprise = -std::log((std::min)(1.0, chance));
        if (!is_number(r.claimed)) // that only arithmetic in float predicts
            r.surprise = (std::max)(r.surprise, surprise_of_constants);
    }
}

// Of telling which records are wrong, where that may be said by one place.
inline double cost_of_wrong(const search& s) {
    const double wrong = static_cast<double>(s.wrong.size());
    const double right = s.right_scale * static_cast<double>(s.right.size());
    std::vector<double> wrong_in(s.places.size()), right_in(s.places.size());
    for (const std::size_t i : s.wrong)
        for_each_place(s, i, [&](std::size_t p) { wrong_in[p] += 1; });
    for (const std::size_t i : s.right)
        for_each_place(s, i, [&](std::size_t p) { right_in[p] += s.right_scale; });
    double least = cost_of_choice(wrong, wrong + right);
    for (std::size_t p = 1; p < s.places.size(); ++p)
        least = (std::min)(
            least, cost_of_choice(wrong_in[p], wrong_in[p] + right_in[p]) +
                       cost_of_choice(wrong - wrong_in[p], wrong + right - wrong_in[p] - right_in[p]));
    return least;
}

// Takes over the records' claims. `disagrees(i)` and `is_used(i)` are asked of each record.
template <class Disagrees, class IsUsed>
void set_claims(search& s, double seen_right_over_wrong, Disagrees&& disagrees, IsUsed&& is_used) {
    s.wrong.clear();
    s.right.clear();
    for (std::size_t i = 0; i < s.records.size(); ++i)
        if (is_used(i))
            (disagrees(i) ? s.wrong : s.right).push_back(i);
    const double wrong = static_cast<double>(s.wrong.size()), right = static_cast<double>(s.right.size());
    s.right_scale = right > 0 && wrong > 0 ? seen_right_over_wrong * wrong / right : 1;
    s.threshold = (std::max)(std::min<std::size_t>(3, s.wrong.size()), s.wrong.size() / 400);
    measure_surprise(s);
    s.null_cost = cost_of_wrong(s);
}

inline void add_records(search& s, const std::vector<path_record>& records) {
    for (const path_record& r : records) {
        sampled one{&r, {}, 0, r.weight, 0, {}};
        terms_of(r, one.terms);
        one.right = weight_of(one.terms).weight;
        s.records.push_back(std::move(one));
    }
}

inline void place_records(search& s) {
    for (sampled& r : s.records) {
        r.places.clear();
        for (std::size_t p = 1; p < s.places.size(); ++p)
            if (contains(s.places[p], *r.record))
                r.places.push_back(p);
    }
}

// The places that occur in the sample, at most 100.
inline void find_places(search& s) {
    constexpr std::size_t most = 100;
    const auto add = [&](confinement::by what, double value) {
        const bool is_known = std::any_of(s.places.begin(), s.places.end(), [&](const confinement& c) {
            return c.what == what && c.value == value;
        });
        if (!is_known && s.places.size() < most)
            s.places.push_back({what, value});
    };
    for (const auto what : {confinement::by::dirac, confinement::by::medium, confinement::by::infinite_light,
                            confinement::by::dirac_light})
        add(what, 0);
    for (const sampled& r : s.records) {
        add(confinement::by::technique, static_cast<double>(r.record->technique.kind));
        add(confinement::by::vertices, static_cast<double>(r.record->vertices.size()));
        add(confinement::by::camera_vertices, r.record->technique.camera_vertices);
        if (is_merge_in_medium(*r.record))
            add(confinement::by::family, static_cast<double>(r.record->family));
    }
    for (const sampled& r : s.records)
        for (const recorded_vertex& x : r.record->vertices)
            if (is_given(x.material))
                add(confinement::by::material, x.material);
    place_records(s);
}

// ---- Fitting constants ----

// The logarithm of the count of a technique with which a record's claim follows from the terms; not_given
// where none does, or where the claim hardly depends on it.
inline double fitted_count(weight_terms& terms, technique_kind kind, double claimed) {
    const bool is_raised = terms.heuristic == heuristic_kind::power && terms.parameter > 0;
    if ((terms.heuristic != heuristic_kind::balance && !is_raised) || is_given(terms.constant) ||
        terms.arithmetic != weight_arithmetic::exact || !(claimed > 0 && claimed < 1))
        return not_given;
    const double beta = is_raised ? terms.parameter : 1;
    const int n = size_of(terms), own_place = place_made_by(terms);
    const auto is_of_kind = [&](int place) { // families have counts of their own
        return place < technique_count(n) && technique_at(n, place).kind == kind;
    };
    terms.count(kind) = 0;
    double largest = log_density::zero, own = log_density::zero;
    bool is_missing = false;
    for_each_log_density(terms, [&](int place, double q) {
        is_missing |= log_density::is_missing(q) || log_density::is_infinite(q);
        largest = (std::max)(largest, q);
        if (place == own_place)
            own = q;
    });
    if (is_missing || log_density::is_zero(own))
        return not_given;
    double fitted = 0, others = 0; // sums of q^beta over that of the largest
    for_each_log_density(terms, [&](int place, double q) {
        (is_of_kind(place) ? fitted : others) += std::exp(beta * (q - largest));
    });
    const double mine = std::exp(beta * (own - largest));
    const bool is_own = is_of_kind(own_place);
    const double factor = is_own ? claimed * others / (mine - claimed * fitted) // to the power of beta
                                 : (mine / claimed - others) / fitted;
    const double share = is_own ? others / (others + factor * fitted) : factor * fitted * claimed / mine;
    return factor > 0 && is_number(factor) && share > 0.02 ? std::log(factor) / beta : not_given;
}

// Appends the betas from 1/4 to 8 with which a record's claim follows.
inline void fit_beta(weight_terms& terms, double claimed, std::vector<double>& found) {
    const bool is_raised =
        terms.heuristic == heuristic_kind::power || terms.heuristic == heuristic_kind::balance;
    if (!is_raised || is_given(terms.constant) || terms.arithmetic != weight_arithmetic::exact ||
        !(claimed > 0 && claimed < 1))
        return;
    terms.heuristic = heuristic_kind::power;
    const auto excess = [&](double log_beta) {
        terms.parameter = std::exp(log_beta);
        return weight_of(terms).weight - claimed;
    };
    constexpr int steps = 20;
    const double first = std::log(0.249), step = std::log(8.01 / 0.249) / steps;
    double low = first, at_low = excess(low);
    for (int k = 1; k <= steps; ++k) {
        const double high = first + k * step, at_high = excess(high);
        if ((at_low < 0) != (at_high < 0)) {
            double a = low, b = high, at_a = at_low, at_b = at_high;
            for (int halving = 0; halving < 60 && b - a > 1e-8;
                 ++halving) { // regula falsi may stall: halve too
                const double middle = halving % 2 == 0 ? (a * at_b - b * at_a) / (at_b - at_a) : (a + b) / 2;
                const double at_middle = excess(middle);
                ((at_middle < 0) == (at_a < 0) ? a : b) = middle;
                ((at_middle < 0) == (at_a < 0) ? at_a : at_b) = at_middle;
            }
            found.push_back((a + b) / 2);
        }
        low = high;
        at_low = at_high;
    }
}

// Where numbers, logarithms of constants, are densest: the middle of the fullest interval of a width, then of
// that of a narrower one within it.
inline double densest(std::vector<double> numbers, std::size_t fewest) {
    std::sort(numbers.begin(), numbers.end());
    for (const double width : {1e-2, 1e-4}) {
        std::size_t first = 0, count = 0;
        for (std::size_t i = 0, end = 0; i < numbers.size(); ++i) {
            while (end < numbers.size() && numbers[end] <= numbers[i] + width)
                ++end;
            if (end - i > count)
                first = i, count = end - i;
        }
        if (count < fewest)
            return not_given;
        numbers = {numbers.begin() + static_cast<std::ptrdiff_t>(first),
                   numbers.begin() + static_cast<std::ptrdiff_t>(first + count)};
        fewest = 1;
    }
    return numbers.empty() ? not_given : numbers[numbers.size() / 2];
}

// The constants with which most of the claims follow that a set does not explain.
inline std::vector<member> fitted_constants(search& s, const hypothesis& set) {
    constexpr std::size_t most = 100;
    std::array<std::vector<double>, 8> found; // logarithms
    std::vector<std::size_t> left;
    for (const std::size_t i : s.wrong)
        if (outcome_of(s, s.records[i], prediction(s, set, s.records[i])) != explained)
            left.push_back(i);
    const std::size_t stride = std::max<std::size_t>(1, left.size() / most);
    for (std::size_t k = 0; k < left.size(); k += stride) {
        const sampled& r = s.records[left[k]];
        for (std::size_t kind = 0; kind < 7; ++kind) {
            if (plant_all(set, r, s.scratch) == planted::unknown)
                break;
            const double fit = fitted_count(s.scratch, static_cast<technique_kind>(kind), r.claimed);
            if (is_given(fit))
                found[kind].push_back(fit);
        }
        if (plant_all(set, r, s.scratch) != planted::unknown)
            fit_beta(s.scratch, r.claimed, found[7]);
    }
    std::vector<member> fitted;
    for (std::size_t k = 0; k < found.size(); ++k) {
        const double value = densest(found[k], std::max<std::size_t>(2, found[k].size() / 20));
        if (is_given(value))
            fitted.push_back({mistake_count + k, 0, k < 7 ? value : std::exp(value)});
    }
    return fitted;
}

// ---- The search ----

// Adds mistakes to a set while each explains enough of what is left; at most four in all.
inline scored grow(search& s, scored start, const std::vector<member>& candidates) {
    constexpr std::size_t largest_set = 4;
    while (start.set.size() < largest_set && !is_complete(s, start)) {
        const outcomes before = outcomes_of(s, start.set);
        std::vector<std::size_t> left; // places in s.wrong
        for (std::size_t k = 0; k < s.wrong.size(); ++k)
            if (before.wrong[k] != explained)
                left.push_back(k);
        scored best = start;
        for (const member& m : candidates) {
            if (has_identifier(start.set, identifier_of(m)))
                continue;
            const hypothesis larger = with(start.set, m);
            const auto explains = [&](std::size_t k) {
                const sampled& r = s.records[s.wrong[k]];
                return outcome_of(s, r, prediction(s, larger, r)) == explained;
            };
            if (static_cast<std::size_t>(std::count_if(left.begin(), left.end(), explains)) < s.threshold)
                continue;
            const scored grown = place_best(s, start.set, before, m, outcomes_of(s, larger));
            if (is_better(grown, best))
                best = grown;
        }
        if (best.set.size() == start.set.size())
            break;
        start = best;
    }
    return start;
}

// Takes out the mistakes that say nothing of their own, and moves each to the place where it is best.
inline scored prune(search& s, scored all) {
    for (std::size_t i = 0; i < all.set.size();) {
        const hypothesis smaller = without(all.set, i);
        scored better = smaller.empty() ? scored{} : score_of(s, smaller);
        member m = all.set[i];
        m.place = 0;
        const outcomes before = outcomes_of(s, smaller), after = outcomes_of(s, with(smaller, m));
        const scored moved = place_best(s, smaller, before, m, after);
        if (smaller.empty() || (!moved.set.empty() && is_better(moved, better)))
            better = moved;
        if (!better.set.empty() && is_better(better, all) && better.score > all.score + 1e-6) {
            all = better;
            i = 0;
        } else {
            ++i;
        }
    }
    return all;
}

// Pairs that explain some of a few wrong records, the best few of them. Two mistakes may hide each other in
// every record, so pairs are tried whatever each of them explains alone.
inline std::vector<scored> best_pairs(search& s, const std::vector<member>& candidates) {
    constexpr std::size_t few = 20, kept = 8;
    std::vector<std::pair<double, hypothesis>> found;
    const std::size_t stride = std::max<std::size_t>(1, s.wrong.size() / few);
    for (std::size_t a = 0; a < candidates.size(); ++a)
        for (std::size_t b = a + 1; b < candidates.size(); ++b) {
            const hypothesis pair{candidates[a], candidates[b]};
            if (gives_constant(pair[0].mistake) || gives_constant(pair[1].mistake) ||
                std::strcmp(identifier_of(pair[0]), identifier_of(pair[1])) == 0)
                continue;
            double surprise = 0, hits = 0, tried = 0;
            for (std::size_t k = 0; k < s.wrong.size() && (hits > 0 || 2 * tried < few);
                 k += stride, ++tried) {
                const sampled& r = s.records[s.wrong[k]];
                if (outcome_of(s, r, prediction(s, pair, r)) == explained)
                    surprise += r.surprise, ++hits;
            }
            const double evidence = surprise + s.null_cost * tried / static_cast<double>(s.wrong.size()) -
                                    cost_of_choice(hits, tried);
            if (hits > 0 && evidence > 0)
                found.push_back({evidence, pair});
        }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    found.resize(std::min<std::size_t>(found.size(), 6 * kept));
    std::vector<scored> pairs;
    pairs.reserve(found.size());
    for (const auto& [evidence, pair] : found)
        pairs.push_back(score_of(s, pair));
    keep_best(pairs, kept);
    return pairs;
}

// The hypothesis with the highest score, whatever that is.
inline scored best_set(search& s) {
    const outcomes nothing{std::vector<unsigned char>(s.wrong.size()),
                           std::vector<unsigned char>(s.right.size())};
    std::vector<member> candidates;
    std::vector<scored> starts;
    const auto add_single = [&](const member& m) {
        const outcomes alone = outcomes_of(s, {m});
        const bool is_hidden = std::all_of(alone.wrong.begin(), alone.wrong.end(),
                                           [](unsigned char o) { return o == unchanged; });
        if (is_hidden && !breaks_ties(m.mistake)) // ties may only arise from another mistake
            return;
        candidates.push_back(m);
        const scored placed = place_best(s, {}, nothing, m, alone);
        if (!placed.set.empty())
            starts.push_back(placed);
    };
    for (std::size_t k = 0; k < mistake_count; ++k)
        add_single(member{k});
    keep_best(starts, 5);
    const bool is_explained = !starts.empty() && is_complete(s, starts[0]);
    if (!is_explained) {
        const std::vector<scored> pairs = best_pairs(s, candidates);
        starts.insert(starts.end(), pairs.begin(), pairs.end());
        for (const member& m : fitted_constants(s, {}))
            add_single(m);
    }
    scored best;
    const auto consider = [&](const scored& start) {
        const scored grown = prune(s, grow(s, start, candidates));
        if (best.set.empty() || is_better(grown, best))
            best = grown;
    };
    keep_best(starts, starts.size());
    if (!starts.empty())
        best = starts[0];
    for (const scored& start : starts) // what is not worth its name by itself is not worth adding to
        if (start.score > 0 && (!is_explained || is_complete(s, start)))
            consider(start);
    if (!best.set.empty() && best.score > 0 && !is_complete(s, best)) {
        for (const member& m : fitted_constants(s, best.set))
            candidates.push_back(m);
        consider(best);
    }
    return best;
}

// A suspect of a set, with what changes where it alone is taken out.
inline suspect describe_member(search& s, const hypothesis& set, std::size_t i, std::size_t examples) {
    const member& m = set[i];
    suspect result;
    result.where = s.places[m.place];
    result.mistake = is_constant(m) ? &wrong_constant : &mistakes[m.mistake];
    const hypothesis others = without(set, i);
    double would_change = 0, has_changed = 0;
    const auto compare = [&](std::size_t k, double seen) {
        const sampled& r = s.records[k];
        const double with_it = prediction(s, set, r), without_it = prediction(s, others, r);
        if (!is_given(with_it) || (is_given(without_it) && agree(with_it, without_it, s.tolerance)))
            return;
        would_change += seen;
        if (!agree(with_it, r.claimed, s.tolerance))
            return;
        has_changed += seen;
        ++result.affected;
        if (result.examples.size() < examples)
            result.examples.push_back({r.record->line, r.claimed, r.right, with_it});
        if (is_constant(m) && result.constant.fitted == 0) {
            const std::size_t k_constant = m.mistake - mistake_count;
            const auto kind = static_cast<technique_kind>(k_constant < 7 ? k_constant : 0);
            const bool is_beta = m.mistake == beta_constant;
            const double area = kind == technique_kind::merge ? std::exp(r.terms.merge_area) : 1.0;
            const double beta = r.terms.heuristic == heuristic_kind::power ? r.terms.parameter : 1.0;
            result.constant = {is_beta, kind, is_beta ? beta : count_of(r.record->counts, kind) * area,
                               is_beta ? m.value : std::exp(m.value) * area};
        }
    };
    for (const std::size_t k : s.wrong)
        compare(k, 1);
    const std::int64_t affected = result.affected; // right records are not among them
    for (const std::size_t k : s.right)
        compare(k, s.right_scale);
    result.affected = affected;
    result.prevalence = would_change > 0 ? has_changed / would_change : 1;
    return result;
}

} // namespace detail

// Compares one record's weight with the right one, and keeps a random choice of records for suspects_of.
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
    if (!is_number(right.weight)) {
        ++d.unusable;
        return {verdict::bad_numbers, 0, {-1, "weight"}};
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
    if (agrees && record.vertices.size() <= d.longest_agreeing)
        detail::sample(d.agreeing_sample, d.most_agreeing, ++d.agreeing_short, record, d.generator);
    else if (!agrees)
        detail::sample(d.disagreeing_sample, d.most_disagreeing, d.disagreeing, record, d.generator);
    return {agrees ? verdict::agrees : verdict::disagrees, right.weight, {}};
}

namespace detail {

// Rounding decides a tie of the maximum heuristic now for one technique and now for another. Always for, or
// always against, is a mistake: by chance, that happens in one of 2^15 places. Ties are those that remain
// with a set of mistakes; returns the set with the mistake of ties that they show, if any.
inline hypothesis with_wrong_ties(search& s, const hypothesis& set) {
    struct ties {
        int won = 0, lost = 0, shared = 0;
    };
    std::vector<ties> in(s.places.size());
    for (std::size_t i = 0; i < s.records.size(); ++i) {
        const sampled& r = s.records[i];
        if (plant_all(set, r, s.scratch) == planted::unknown)
            continue;
        const expected_weight expected = weight_of(s.scratch);
        if (expected.tied == 1)
            continue;
        for_each_place(s, i, [&](std::size_t p) {
            in[p].won += r.claimed == 1;
            in[p].lost += r.claimed == 0;
            in[p].shared += agree(r.claimed, expected.weight, s.tolerance);
        });
    }
    std::size_t place = 0;
    int most = 0; // of a place: everywhere, or where most are
    for (std::size_t p = 0; p < in.size(); ++p) {
        const ties& t = in[p];
        const bool is_mistake = t.shared == 0 && t.won + t.lost >= 16 && (t.won == 0 || t.lost == 0);
        if (is_mistake && t.won + t.lost > most)
            place = p, most = t.won + t.lost;
    }
    if (most == 0)
        return set;
    const auto wrong = in[place].won > 0 ? break_ties<tie_rule::all_win> : break_ties<tie_rule::all_lose>;
    for (std::size_t k = 0; k < mistake_count; ++k)
        if (mistakes[k].plant == wrong)
            return with(set, member{k, place});
    return set;
}

// Single mistakes with the same outcome for every record, under other names.
inline std::vector<const mistake*> equivalent_to(search& s, const member& only) {
    std::vector<const mistake*> result;
    const outcomes its = outcomes_of(s, {only});
    for (std::size_t k = 0; k < mistake_count; ++k) {
        if (!is_constant(only) && std::strcmp(mistakes[k].identifier, mistakes[only.mistake].identifier) == 0)
            continue;
        const outcomes others = outcomes_of(s, {member{k, only.place}});
        if (others.wrong == its.wrong && others.right == its.right)
            result.push_back(&mistakes[k]);
    }
    return result;
}

// Describes all mistakes of a set, the one that is needed most first.
inline std::vector<suspect> describe_all(search& s, const hypothesis& set, std::size_t examples) {
    std::vector<suspect> all;
    for (std::size_t i = 0; i < set.size(); ++i)
        all.push_back(describe_member(s, set, i, examples));
    std::stable_sort(all.begin(), all.end(),
                     [](const suspect& a, const suspect& b) { return a.affected > b.affected; });
    return all;
}

// What is reported of the best hypothesis: suspects, or where it does not explain enough, what is closest.
inline finding finding_of(search& s, const scored& best, bool is_named, std::size_t examples) {
    finding result;
    const double wrong = static_cast<double>(s.wrong.size());
    result.disagreeing = static_cast<std::int64_t>(s.wrong.size());
    result.agreeing = static_cast<std::int64_t>(s.right.size());
    const bool is_close = best.score > 0 || s.wrong.size() <= few_wrong;
    if (best.set.empty() || (!is_named && (!is_close || best.sums.explained * 10 < wrong)))
        return result;
    (is_named ? result.suspects : result.closest) = describe_all(s, best.set, is_named ? examples : 0);
    result.explained = std::llround(best.sums.explained);
    result.spoiled = std::llround(best.sums.spoiled / s.right_scale);
    if (is_named && best.set.size() == 1)
        result.equivalent = equivalent_to(s, best.set[0]);
    return result;
}
// Weights that are constants explain nearly all that is wrong, or are themselves to be explained.
inline bool is_named(const search& s, const scored& best) {
    const bool is_constant = std::any_of(best.set.begin(), best.set.end(),
                                         [](const member& m) { return is_without_densities(m.mistake); });
    return best.score > 0 &&
           best.sums.explained >= (is_constant ? 0.95 : 0.5) * static_cast<double>(s.wrong.size());
}

// Mistakes that a wrong record lacks a field for.
inline std::vector<const mistake*> unknown_mistakes(search& s) {
    std::vector<const mistake*> result;
    for (const mistake& m : mistakes)
        if (std::any_of(s.wrong.begin(), s.wrong.end(), [&](std::size_t i) {
                s.scratch = s.records[i].terms;
                return m.plant(s.scratch, *s.records[i].record) == planted::unknown;
            }))
            result.push_back(&m);
    return result;
}

} // namespace detail

// The mistakes that explain the disagreeing records. None where all records agree, or where no set of
// mistakes explains half of those that do not, beyond chance: then the weights are unexplained. Of weights
// that have nothing to do with densities (random numbers, another path's), at most 1 dump in 1,000 is given a
// name.
inline finding suspects_of(const diagnosis& d, std::size_t examples = 2) {
    if (d.disagreeing_sample.empty() && d.tied_sample.empty())
        return {};
    const std::size_t wrong = d.disagreeing_sample.size();
    detail::search s;
    s.tolerance = d.tolerance;
    detail::add_records(s, d.disagreeing_sample);
    detail::add_records(s, d.agreeing_sample);
    detail::find_places(s);
    detail::set_claims(
        s, wrong == 0 ? 1.0 : static_cast<double>(d.agreeing) / static_cast<double>(d.disagreeing),
        [&](std::size_t i) { return i < wrong; }, [](std::size_t) { return true; });
    detail::scored best = wrong == 0 ? detail::scored{} : detail::best_set(s);
    bool is_named = detail::is_named(s, best);
    const std::vector<const mistake*> unknown = detail::unknown_mistakes(s);

    const std::size_t without_ties = s.records.size();
    detail::add_records(s, d.tied_sample);
    detail::place_records(s);
    const detail::hypothesis with_ties =
        detail::with_wrong_ties(s, is_named ? best.set : detail::hypothesis{});
    if (with_ties.size() > (is_named ? best.set.size() : 0)) {
        for (std::size_t i = without_ties; i < s.records.size(); ++i)
            s.wrong.push_back(i);
        best = detail::score_of(s, with_ties);
        is_named = true;
    }
    finding result = detail::finding_of(s, best, is_named, examples);
    result.unknown = unknown;
    return result;
}

} // namespace mis

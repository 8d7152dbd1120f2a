// docs/edge_cases.md, the tables of optimal weights.
#include "edge_cases.hpp"
#include <array>
#include <cmath>
#include <cstring>
#include <mis/optimal.hpp>
#include <mis/optimal/allocation.hpp>
#include <sstream>

using namespace edge_cases;
using mis::optimal::dynamic;
using mis::optimal::estimator;
using mis::optimal::progressive;

namespace {

using one_channel = estimator<2, 1>;
using two = std::array<double, 2>;

constexpr two counts{1, 1};
constexpr double tiny = std::numeric_limits<double>::denorm_min();

// What is known of an estimator after samples of which the last has these.
template <class E> void add_some(E& e, double f, two densities) {
    for (int x = 0; x < 20; ++x)
        e.add(1 + 0.1 * (x % 3), two{1, 0.5 + 0.1 * (x % 5)});
    e.add(f, densities);
}
one_channel some(double f = 1, two densities = {1, 1}) {
    one_channel e;
    add_some(e, f, densities);
    return e;
}
one_channel some_weighted(double value, two weights) {
    one_channel e = some();
    e.add_weighted(value, weights);
    return e;
}
one_channel some_outside(double draws) {
    one_channel e = some();
    e.add_outside(1, draws);
    return e;
}
progressive<2, 1> some_progressive(double f = 1, double passes = 10) {
    progressive<2, 1> p;
    add_some(p, f, {1, 1});
    end_batch(p, counts, passes);
    return p;
}

bool finite(const one_channel& e, two n = counts) {
    return std::isfinite(integral(e, n)[0]) && std::isfinite(variance(e, n)[0]);
}
bool unknown(const one_channel& e, two n = counts) {
    return !std::isfinite(integral(e, n)[0]) && variance(e, n)[0] == infinity;
}
bool unknown(const progressive<2, 1>& p) {
    return !std::isfinite(integral(p)[0]) && variance(p)[0] == infinity;
}
bool same(const one_channel& a, const one_channel& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// Of an estimator of no techniques.
template <class Add> cell asserted_without_techniques(Add add) {
    return asserted([add] {
        estimator<dynamic, 1> e;
        add(e);
        return e.squares[0];
    });
}

two weights_of(double f, two densities = {1, 3}) {
    two w{7, 7};
    mis::optimal::weights(two{1, -0.5}, f, counts, densities, 2, w);
    return w;
}
bool are(two a, double first, double second) {
    return std::fabs(a[0] - first) <= 1e-15 && std::fabs(a[1] - second) <= 1e-15;
}

using film = mis::optimal::film<2, 1>;

film some_film(two n = counts) {
    film f(3, 2, n);
    f.at(1, 1) = some();
    return f;
}
std::string saved(const film& f) {
    std::ostringstream out;
    save(out, f);
    return out.str();
}
std::string loaded(const std::string& bytes) {
    film f;
    std::istringstream in(bytes);
    return load(in, f);
}

} // namespace

TEST_CASE("Edge cases of optimal weights") {
    const cell as_any_other_f = {"as any other", [] { return finite(some(tiny)) && finite(some(-tiny)); }};
    const auto unknown_with = [](double f) {
        return cell{"integral no number, variance infinite", [f] { return unknown(some(f)); }};
    };
    const auto unknown_weighted = [](double f) {
        return cell{"integral no number, variance infinite", [f] {
                        return unknown(some_weighted(f, {0.5, 0.5}));
                    }};
    };
    const auto unknown_progressive = [](double f) {
        return cell{"integral no number, variance infinite", [f] { return unknown(some_progressive(f)); }};
    };
    const auto density_asserted = [](double q) {
        return cell{
            "asserted", [q] {
                return asserts([q] { use(some(1, {q, 1})); }) && asserts([q] { use(some(1, {1, q})); });
            }};
    };
    const auto weight_asserted = [](double u) {
        return asserted([u] { return some_weighted(1, {u, 0.5}); });
    };
    const auto count_asserted = [](auto call, double n) {
        return asserted([call, n] { return call(some(), two{1, n}); });
    };
    const auto no_variance = [](double draws) {
        return cell{"variance infinite",
                    [draws] { return variance(some_outside(draws), counts)[0] == infinity; }};
    };
    const auto integral_of = [](const auto& e, const auto& n) { return integral(e, n); };
    const auto coefficients_of = [](const auto& e, const auto& n) { return coefficients(e, n); };
    const auto variance_of = [](const auto& e, const auto& n) { return variance(e, n); };
    const auto alone = [](const auto& call) { // a count of 0 is as if the technique were not there
        one_channel e = some(), first;
        first.values[0] = e.values[0], first.products[0] = e.products[0];
        return call(e, two{1, 0})[0] == call(first, two{1, 0})[0];
    };
    check("Optimal weights",
          {{"estimator::add(f, ..)",
            {"as any other: it counts",
             [] {
                 return draws(some(0)) == draws(some(1)) &&
                        integral(some(0), counts) < integral(some(1), counts);
             }},
            unknown_with(infinity),
            unknown_with(not_a_number),
            {"as any other", [] { return integral(some(-1), counts)[0] < integral(some(0), counts)[0]; }},
            as_any_other_f,
            asserted_without_techniques([](auto& e) { e.add(1.0, counts); })},
           {"estimator::add(.., densities)",
            {"weight 0; asserted where all are",
             [] {
                 return finite(some(1, {0, 1})) && asserts([] { use(some(1, {0, 0})); });
             }},
            {"shared equally by all that are, f / D is 0",
             [] {
                 return same(some(5, {infinity, 1}), some(0, {1, 0})) &&
                        same(some(5, {infinity, infinity}), some(0, {1, 1}));
             }},
            density_asserted(not_a_number),
            density_asserted(-1),
            {"as any other; as f = ∞ where f / D is too large",
             [] {
                 return finite(some(tiny, {tiny, tiny})) && unknown(some(1, {tiny, tiny}));
             }},
            asserted_without_techniques([](auto& e) { e.add(1.0, std::vector<double>{}); })},
           {"estimator::add_weighted(f / D, ..)",
            {"as any other: it counts",
             [] {
                 return draws(some_weighted(0, {0.5, 0.5})) == draws(some()) + 1;
             }},
            unknown_weighted(infinity),
            unknown_weighted(not_a_number),
            {"as any other",
             [] {
                 return finite(some_weighted(-1, {0.5, 0.5}));
             }},
            {"as any other",
             [] {
                 return finite(some_weighted(tiny, {0.5, 0.5}));
             }},
            asserted_without_techniques([](auto& e) { e.add_weighted(1.0, counts); })},
           {"estimator::add_weighted(.., weights)",
            {"as any other",
             [] {
                 return finite(some_weighted(1, {0, 1}));
             }},
            {"variance infinite",
             [] {
                 return variance(some_weighted(1, {infinity, 0}), counts)[0] == infinity;
             }},
            weight_asserted(not_a_number),
            weight_asserted(-0.5),
            {"as any other",
             [] {
                 return finite(some_weighted(1, {tiny, 1}));
             }},
            asserted_without_techniques([](auto& e) { e.add_weighted(1.0, std::vector<double>{}); })},
           {"estimator::add_outside(i, draws)",
            {"nothing is added", [] { return same(some_outside(0), some()); }},
            no_variance(infinity),
            no_variance(not_a_number),
            {"taken back",
             [] {
                 one_channel e = some_outside(2);
                 e.add_outside(1, -2);
                 return std::fabs(draws(e) - draws(some())) <= 1e-14 * draws(e);
             }},
            {"as any other", [] { return finite(some_outside(tiny)); }},
            asserted_without_techniques([](auto& e) { e.add_outside(0); })},
           {"estimator += other",
            {"as any other: a sum of samples with f = 0",
             [] {
                 one_channel e = some(), other;
                 other.add(0.0, two{1, 1});
                 e += other;
                 return std::fabs(draws(e) - draws(some()) - 1) <= 1e-13;
             }},
            {"as that sample",
             [] {
                 one_channel e = some();
                 e += some(infinity);
                 return unknown(e);
             }},
            {"as that sample",
             [] {
                 one_channel e = some();
                 e += some(not_a_number);
                 return unknown(e);
             }},
            {"as any other",
             [] {
                 one_channel e = some();
                 e += some(-1);
                 return finite(e);
             }},
            {"as any other",
             [] {
                 one_channel e = some();
                 e += some(tiny);
                 return finite(e);
             }},
            {"nothing is added; asserted if of another size",
             [] {
                 one_channel e = some();
                 e += one_channel();
                 return same(e, some()) && asserts([] {
                            estimator<dynamic> d(2);
                            d += estimator<dynamic>(3);
                        });
             }}},
           {"integral(e, counts)",
            {"takes no part", [=] { return alone(integral_of); }},
            {"no number",
             [] {
                 return !std::isfinite(integral(some(), two{1, infinity})[0]);
             }},
            count_asserted(integral_of, not_a_number),
            count_asserted(integral_of, -1),
            {"as any other",
             [] {
                 return std::isfinite(integral(some(), two{1, tiny})[0]);
             }},
            {"0", [] { return integral(one_channel(), counts)[0] == 0; }}},
           {"coefficients(e, counts)",
            {"0",
             [] {
                 return coefficients(some(), two{1, 0})[0][1] == 0;
             }},
            {"no number",
             [] {
                 return !std::isfinite(coefficients(some(), two{1, infinity})[0][1]);
             }},
            count_asserted(coefficients_of, not_a_number),
            count_asserted(coefficients_of, -1),
            {"as any other",
             [] {
                 return std::isfinite(coefficients(some(), two{1, tiny})[0][1]);
             }},
            {"0", [] { return coefficients(one_channel(), counts)[0] == std::array<double, 2>{}; }}},
           {"variance(e, counts)",
            {"takes no part; infinite where all are",
             [] {
                 return std::isfinite(variance(some(), two{1, 0})[0]) &&
                        variance(some(), two{0, 0})[0] == infinity;
             }},
            {"infinite",
             [] {
                 return variance(some(), two{1, infinity})[0] == infinity;
             }},
            count_asserted(variance_of, not_a_number),
            count_asserted(variance_of, -1),
            {"as any other",
             [] {
                 return std::isfinite(variance(some(), two{1, tiny})[0]);
             }},
            {"0", [] { return variance(one_channel(), counts)[0] == 0; }}},
           {"weights(alpha, f, ..)",
            {"those of balance", [] { return are(weights_of(0), 0.25, 0.75); }},
            {"those of balance",
             [] { return are(weights_of(infinity), 0.25, 0.75) && are(weights_of(-infinity), 0.25, 0.75); }},
            {"those of balance", [] { return are(weights_of(not_a_number), 0.25, 0.75); }},
            {"as any other", [] { return are(weights_of(-1), -1 + 0.25 * 0.5, 1.5 + 0.75 * 0.5); }},
            {"infinite where too large", [] { return weights_of(tiny)[0] == infinity; }},
            {"nothing is written",
             [] {
                 two w{7, 7};
                 mis::optimal::weights(counts, 1.0, counts, counts, 0, w);
                 return w == two{7, 7};
             }}},
           {"weights(.., densities, n, out)",
            {"weight 0; all 0 where all are",
             [] {
                 return weights_of(1, {0, 1})[0] == 0 && are(weights_of(1, {0, 0}), 0, 0);
             }},
            {"those of balance",
             [] {
                 return are(weights_of(1, {infinity, 1}), 1, 0);
             }},
            asserted([] {
                return weights_of(1, {not_a_number, 1});
            }),
            asserted([] {
                return weights_of(1, {-1, 1});
            }),
            {"as any other",
             [] {
                 return are(weights_of(1, {tiny, tiny}), 0.5, 0.5);
             }},
            {"nothing is written",
             [] {
                 two w{7, 7};
                 mis::optimal::weights(counts, 1.0, counts, counts, 0, w);
                 return w == two{7, 7};
             }}},
           {"progressive::add(f, ..)",
            {"as any other: it counts",
             [] { return integral(some_progressive(0))[0] < integral(some_progressive(1))[0]; }},
            unknown_progressive(infinity),
            unknown_progressive(not_a_number),
            {"as any other",
             [] { return integral(some_progressive(-1))[0] < integral(some_progressive(0))[0]; }},
            {"as any other", [] { return std::isfinite(variance(some_progressive(tiny))[0]); }},
            asserted([] {
                progressive<dynamic, 1> p;
                p.add(1.0, counts);
                return p.passes;
            })},
           {"end_batch(p, counts, passes)",
            {"not yet an estimate: 0, variance infinite",
             [] {
                 const auto p = some_progressive(1, 0);
                 return integral(p)[0] == 0 && variance(p)[0] == infinity;
             }},
            {"integral no number, variance infinite", [] { return unknown(some_progressive(1, infinity)); }},
            asserted([] { return some_progressive(1, not_a_number); }),
            asserted([] { return some_progressive(1, -1); }),
            {"integral no number, variance infinite", [] { return unknown(some_progressive(1, tiny)); }},
            {"as any other",
             [] {
                 progressive<2, 1> p;
                 end_batch(p, counts, 2);
                 return integral(p)[0] == 0 && variance(p)[0] == 0;
             }}},
           {"integral(p)",
            none(),
            none(),
            none(),
            none(),
            none(),
            {"0", [] { return integral(progressive<2, 1>())[0] == 0; }}},
           {"variance(p)", none(), none(), none(), none(), none(), {"infinite", [] {
                                                                        return variance(
                                                                                   progressive<2, 1>())[0] ==
                                                                               infinity;
                                                                    }}}});
}

TEST_CASE("Edge cases of films of estimators") {
    const auto refused = [](double n) {
        return cell{"says so, reads nothing", [n] {
                        film f = some_film({1, n}), before = some_film(), read = some_film();
                        std::istringstream in(saved(f));
                        return !load(in, read).empty() && saved(read) == saved(before);
                    }};
    };
    check("Films of estimators",
          {{"film(width, height, counts)",
            {"no pixels",
             [] { return film(0, 3, counts).pixels.empty() && film(3, 0, counts).pixels.empty(); }},
            none(),
            none(),
            asserted([] { return film(-1, -2, counts).width; }),
            none(),
            {"no pixels", [] { return film().pixels.empty(); }}},
           {"merge(film, tile, x, y)",
            {"as any other",
             [] {
                 film f = some_film();
                 return merge(f, some_film(), 0, 0).empty() && saved(f) != saved(some_film());
             }},
            none(),
            none(),
            {"says so, adds nothing",
             [] {
                 film f = some_film();
                 return !merge(f, some_film(), -1, 0).empty() && !merge(f, some_film(), 0, -1).empty() &&
                        saved(f) == saved(some_film());
             }},
            none(),
            {"adds nothing",
             [] {
                 film f = some_film();
                 return merge(f, film(0, 0, counts), 3, 2).empty() && saved(f) == saved(some_film());
             }}},
           {"integrals(film)",
            none(),
            none(),
            none(),
            none(),
            none(),
            {"no numbers", [] { return integrals(film()).empty(); }}},
           {"save(out, film)",
            none(),
            none(),
            none(),
            none(),
            none(),
            {"a film without pixels", [] { return loaded(saved(film())).empty(); }}},
           {"load(in, film)",
            {"a count of 0 as any other",
             [] {
                 return loaded(saved(some_film({1, 0}))).empty();
             }},
            refused(infinity),
            refused(not_a_number),
            refused(-1),
            {"as any other",
             [] {
                 return loaded(saved(some_film({1, tiny}))).empty();
             }},
            {"says so, reads nothing", [] { return !loaded("").empty(); }}}});
}

namespace {

using small_pilot = mis::pilot<2>;

// Samples of which each technique is good for one half, and perhaps another one.
small_pilot some_pilot() {
    small_pilot p;
    for (int x = 0; x < 20; ++x)
        p.add(1.0 + x % 3, x % 2 ? two{1.8, 0.2} : two{0.2, 1.8}, 1);
    p.passes = 20;
    return p;
}
small_pilot with_sample(double f, two densities = {1, 1}, double pilot_density = 1) {
    small_pilot p = some_pilot();
    p.add(f, densities, pilot_density);
    return p;
}
bool is_left_out(const small_pilot& p) { return p.left_out == 1 && p.samples == some_pilot().samples; }

// By balance and by optimal weights.
template <class... Options>
std::array<mis::allocation<2>, 2> allocations(const small_pilot* pilots, std::size_t count, two costs,
                                              double budget, const Options&... options) {
    return {mis::allocate(pilots, count, costs, budget, options...),
            mis::optimal::allocate(pilots, count, costs, budget, options...)};
}
template <class... Options>
std::array<mis::allocation<2>, 2> allocations(const small_pilot& p, const Options&... options) {
    return allocations(&p, 1, two{1, 2}, 6.0, options...);
}
bool are_like(const std::array<mis::allocation<2>, 2>& a, const std::array<mis::allocation<2>, 2>& b) {
    for (std::size_t i = 0; i < 2; ++i)
        for (int k = 0; k < 2; ++k)
            if (!(a[i].converged && std::fabs(a[i].counts[k] - b[i].counts[k]) <= 1e-3))
                return false;
    return true;
}
bool are_equal_shares(const std::array<mis::allocation<2>, 2>& all) {
    return std::fabs(all[0].counts[0] - 3) + std::fabs(all[0].counts[1] - 1.5) <= 1e-12 &&
           std::fabs(all[1].counts[0] - 3) + std::fabs(all[1].counts[1] - 1.5) <= 1e-12;
}
bool asserts_for(two costs, double budget) {
    const small_pilot p = some_pilot();
    return asserts([&] { use(mis::allocate(p, costs, budget)); }) &&
           asserts([&] { use(mis::optimal::allocate(p, costs, budget)); });
}

} // namespace

TEST_CASE("Edge cases of allocation") {
    const auto left_out_f = [](double f) {
        return cell{"left out", [f] { return is_left_out(with_sample(f)); }};
    };
    const auto left_out_density = [](double p) {
        return cell{"left out", [p] {
                        return is_left_out(with_sample(1, {p, 1})) && is_left_out(with_sample(1, {1, 1}, p));
                    }};
    };
    const auto kept = [](double f) {
        return cell{"as any other", [f] {
                        const small_pilot p = with_sample(f);
                        const double before = mis::integral(some_pilot())[0], after = mis::integral(p)[0];
                        return p.left_out == 0 && p.samples == some_pilot().samples + 1 &&
                               std::fabs(after - before - f / 20) <= 1e-14;
                    }};
    };
    const cell left_out_of_none = {"left out", [] {
                                       mis::pilot<dynamic> p;
                                       p.add(1.0, counts, 1);
                                       return p.left_out == 1 && p.samples == 0;
                                   }};
    const auto outside_asserted = [](double n) {
        return asserted([n] {
            small_pilot p;
            p.add_outside(0, n);
            return p.outside[0];
        });
    };
    const auto nothing_of = [](double importance) {
        return cell{"counts for nothing", [importance] {
                        const small_pilot all[]{some_pilot(), with_sample(9, {0.1, 2})};
                        small_pilot tile[]{all[0], all[1]};
                        tile[1].importance = importance;
                        const two costs{1, 2};
                        return are_like(allocations(tile, 2, costs, 6.0), allocations(all[0])) &&
                               !are_like(allocations(all, 2, costs, 6.0), allocations(all[0]));
                    }};
    };
    const auto counts_asserted = [](double n) {
        return cell{"asserted", [n] {
                        const small_pilot p = some_pilot();
                        return asserts([&] {
                                   use(mis::variance_of_counts(p, two{1, n}));
                               }) &&
                               asserts([&] {
                                   use(mis::optimal::variance_of_counts(p, two{1, n}));
                               });
                    }};
    };
    const auto costs_asserted = [](double x) {
        return cell{"asserted", [x] { return asserts_for({x, 1}, 6) && asserts_for({1, 2}, x); }};
    };
    const auto least = [](double share) {
        mis::allocation_options o;
        o.least_share = share;
        return allocations(some_pilot(), o);
    };
    const auto equal_shares = [least](double share) {
        return cell{"equal shares", [=] { return are_equal_shares(least(share)); }};
    };
    const auto none_kept = [least](double share) {
        return cell{"none", [=] { return are_like(least(share), allocations(some_pilot())); }};
    };
    const auto from = [](double x) {
        const two start{x, 1};
        return allocations(some_pilot(), mis::allocation_options{}, start.data());
    };
    const auto as_0 = [from](double x) { return cell{"as 0", [=] { return are_like(from(x), from(0)); }}; };
    const auto rounded = [](double x) {
        std::array<int, 2> whole{7, 7};
        mis::round_counts(two{x, 2}, 2, 0.5, whole);
        return whole;
    };
    check(
        "Allocation",
        {{"pilot::add(f, ..)", kept(0), left_out_f(infinity), left_out_f(not_a_number), kept(-1), kept(tiny),
          left_out_of_none},
         {"pilot::add(.., densities, pilot_density)",
          {"takes no part; left out where all are, or the pilot's is",
           [] {
               return with_sample(1, {0, 1}).left_out == 0 && is_left_out(with_sample(1, {0, 0})) &&
                      is_left_out(with_sample(1, {1, 1}, 0));
           }},
          left_out_density(infinity),
          left_out_density(not_a_number),
          left_out_density(-1),
          {"as 0 beside larger ones; the pilot's: left out",
           [] {
               return are_like(allocations(with_sample(1, {tiny, 1})), allocations(with_sample(1, {0, 1}))) &&
                      is_left_out(with_sample(1, {1, 1}, tiny));
           }},
          left_out_of_none},
         {"pilot::add_outside(k, n)",
          outside_asserted(0),
          {"nothing is added",
           [] {
               small_pilot p;
               p.add_outside(0, infinity);
               return p.outside[0] == 0;
           }},
          outside_asserted(not_a_number),
          outside_asserted(-1),
          {"infinite",
           [] {
               small_pilot p;
               p.add_outside(0, tiny);
               return p.outside[0] == infinity;
           }},
          asserted([] {
              mis::pilot<dynamic> p;
              p.add_outside(0, 1);
              return p.samples;
          })},
         {"pilot.importance",
          nothing_of(0),
          nothing_of(infinity),
          nothing_of(not_a_number),
          nothing_of(-1),
          {"as any other",
           [] {
               small_pilot p = some_pilot();
               p.importance = tiny;
               return are_like(allocations(p), allocations(some_pilot()));
           }},
          none()},
         {"mis::integral(pilot)",
          none(),
          none(),
          none(),
          none(),
          none(),
          {"0", [] { return mis::integral(small_pilot())[0] == 0; }}},
         {"mis::variance_of_counts(pilot, counts)",
          {"technique off; not covered where it alone covers f",
           [] {
               small_pilot alone = some_pilot();
               alone.add(1, two{0, 1}, 1);
               const auto d = mis::variance_of_counts(some_pilot(), two{1, 0});
               return d.covered && std::isfinite(d.value) &&
                      !mis::variance_of_counts(alone, two{1, 0}).covered &&
                      !mis::optimal::variance_of_counts(alone, two{1, 0}).covered;
           }},
          {"unspecified", [] { return true; }},
          counts_asserted(not_a_number),
          counts_asserted(-1),
          {"as any other",
           [] {
               return std::isfinite(mis::variance_of_counts(some_pilot(), two{1, tiny}).value) &&
                      std::isfinite(mis::optimal::variance_of_counts(some_pilot(), two{1, tiny}).value);
           }},
          {"0",
           [] {
               return mis::variance_of_counts(small_pilot(), counts).value == 0 &&
                      mis::optimal::variance_of_counts(small_pilot(), counts).value == 0;
           }}},
         {"mis::allocate(pilot, costs, budget)",
          costs_asserted(0),
          costs_asserted(infinity),
          costs_asserted(not_a_number),
          costs_asserted(-1),
          {"a budget: as any other",
           [] {
               const auto all = allocations(std::array{some_pilot()}.data(), 1, two{1, 2}, 1e-310);
               return all[0].counts[0] > 0 && all[0].counts[0] + 2 * all[0].counts[1] <= 1.001e-310;
           }},
          {"equal shares of the budget", [] { return are_equal_shares(allocations(small_pilot())); }}},
         {"allocation_options::least_share",
          none_kept(0),
          equal_shares(infinity),
          equal_shares(not_a_number),
          none_kept(-1),
          {"as any other", [least] { return are_like(least(tiny), least(0)); }},
          none()},
         {"mis::allocate(.., options, start)",
          {"as any other; all 0: equal shares",
           [from] {
               const two nothing{0, 0};
               return are_like(from(0), from(1)) &&
                      are_like(allocations(some_pilot(), mis::allocation_options{}, nothing.data()), from(1));
           }},
          as_0(infinity),
          as_0(not_a_number),
          as_0(-1),
          {"as any other", [from] { return are_like(from(tiny), from(1)); }},
          none()},
         {"mis::round_counts(counts, n, u, out)",
          {"0",
           [rounded] {
               return rounded(0) == std::array{0, 2};
           }},
          {"unspecified", [] { return true; }},
          asserted([rounded] { return rounded(not_a_number); }),
          asserted([rounded] { return rounded(-1); }),
          {"as any other",
           [rounded] {
               return rounded(tiny) == std::array{0, 2};
           }},
          {"nothing is written", [] {
               std::array<int, 2> whole{7, 7};
               mis::round_counts(counts, 0, 0.5, whole);
               return whole == std::array{7, 7};
           }}}});
}

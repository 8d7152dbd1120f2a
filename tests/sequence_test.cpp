// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "ulp.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <functional>
#include <mis/sequence.hpp>

using namespace test;
using oracle::heuristic_kind;

namespace {

// A sum over sequences of choices: at each depth one of `choices`, with a factor and a source that depend on
// all choices so far, made by one of M methods with probabilities that do, too; whatever is left of them ends
// there.
constexpr int methods = 3, choices = 2, depth = 4;

struct tree {
    struct node {
        double source, factor;         // of the term that ends here; of all below
        double probabilities[methods]; // of choosing this child
        std::vector<node> children;
    };
    node root;
    double counts[methods];
};

tree::node random_node(generator& g, int level) {
    tree::node n{g.uniform(0, 2), g.uniform(0.2, 1), {}, {}};
    if (level == depth)
        return n;
    for (int c = 0; c < choices; ++c)
        n.children.push_back(random_node(g, level + 1));
    for (int k = 0; k < methods; ++k) { // now and then a method ends surely, or cannot make a choice
        double left = g.chance(0.1) ? 0 : 0.95;
        for (tree::node& child : n.children) {
            child.probabilities[k] = g.chance(0.1) ? 0 : left * g.uniform(0.1, 0.9);
            left -= child.probabilities[k];
        }
    }
    return n;
}

tree random_tree(generator& g) {
    tree t{random_node(g, 0), {}};
    for (double& count : t.counts)
        count = g.chance(0.15) ? 0 : g.uniform(0.5, 20);
    t.counts[0] = 2; // one that is on
    return t;
}

// The sum of all terms that some method can make.
double exact(const tree::node& n, double factor, std::array<bool, methods> can) {
    double sum = std::any_of(can.begin(), can.end(), [](bool b) { return b; }) ? factor * n.source : 0;
    for (const tree::node& child : n.children) {
        auto can_go_on = can;
        for (std::size_t k = 0; k < methods; ++k)
            can_go_on[k] = can[k] && child.probabilities[k] > 0;
        sum += exact(child, factor * n.factor, can_go_on);
    }
    return sum;
}

// What method `own` is expected to add, by going through all of its sequences.
double expectation(const tree::node& n, int own, double probability, double factor, double throughput,
                   const mis::sequence_state<double, methods>& state, double count) {
    const double w = mis::term_weight(mis::power, state, own);
    double sum = probability * w * throughput * n.source;
    for (const tree::node& child : n.children) {
        const double p = child.probabilities[own];
        if (p > 0)
            sum += expectation(child, own, probability * p, factor * n.factor, throughput * n.factor / p,
                               mis::next_draw(state, child.probabilities, own), count);
    }
    return sum;
}

} // namespace

TEST_CASE("a weight for each term: the expectation is the sum, terminations included") {
    generator g(41);
    double worst = 0, largest = 0;
    for (int sample = 0; sample < 2'000; ++sample) {
        const tree t = random_tree(g);
        std::array<bool, methods> is_on{};
        double sum = 0;
        for (int own = 0; own < methods; ++own) {
            is_on[static_cast<std::size_t>(own)] = t.counts[own] > 0;
            sum += expectation(t.root, own, 1, 1, 1, mis::start_sequence(t.counts), t.counts[own]);
        }
        const double right = exact(t.root, 1, is_on);
        largest = std::max(largest, right);
        worst = std::max(worst, std::fabs(sum / right - 1));
    }
    std::printf("sums of up to %.2f: relative error of the expectation at most %.2g\n", largest, worst);
    CHECK(worst <= 1e-13);
}

TEST_CASE_TEMPLATE("weights of long sequences are the products', and sum to 1", T, float, double) {
    generator g(42);
    worst_case error, unity;
    for (int sample = 0; sample < 5'000; ++sample) {
        constexpr int m = 4;
        T counts[m];
        std::vector<wide> products;
        for (T& count : counts) {
            count = g.chance(0.2) ? T(0) : g.log_uniform<T>(0, 4);
            products.push_back(wide{count});
        }
        const int draws = g.integer(1, 24);
        mis::sequence_state<T, m> state[m];
        for (auto& x : state)
            x = mis::start_sequence(counts);
        for (int j = 0; j < draws; ++j) {
            T densities[m];
            for (int k = 0; k < m; ++k) {
                densities[k] = g.log_uniform<T>(-0.6, 0.6);
                products[static_cast<std::size_t>(k)] =
                    products[static_cast<std::size_t>(k)] * wide{densities[k]};
            }
            for (int own = 0; own < m; ++own)
                state[own] = mis::next_draw(state[own], densities, own);
        }
        const auto exact_weights = oracle::weights({heuristic_kind::balance}, products);
        long double sum = 0;
        bool any = false;
        for (int own = 0; own < m; ++own) {
            const T w = mis::term_weight(mis::balance, state[own], own);
            error.see(ulp_error(w, exact_weights[static_cast<std::size_t>(own)]) / (2 * draws + m + 1),
                      sample);
            sum += static_cast<long double>(w);
            any = any || counts[own] > 0;
        }
        unity.see(any ? unity_error<T>(sum) / (2 * draws + m + 1) : static_cast<double>(sum) * hopeless,
                  sample);
    }
    CHECK(error.error <= 1);
    CHECK(unity.error <= 1);
}

TEST_CASE("what saturates gives no NaN and leaves the weight within [0, 1]") {
    const float counts[] = {1, 1};
    for (const float other : {0.f, 1e-30f, 1e30f}) {
        auto x = mis::start_sequence(counts);
        for (int j = 0; j < 20; ++j) {
            const float densities[] = {1e-10f, other};
            x = mis::next_draw(x, densities, 0);
            const float w = mis::term_weight(mis::power, x, 0);
            CHECK(w >= 0);
            CHECK(w <= 1);
        }
    }
}

TEST_CASE("one weight for all terms, as published, is biased: 2.372 instead of 2") {
    // Term 1 is 1; term 2 is a sum of two, of which each is 1/2; the methods choose between them with other
    // probabilities.
    const double counts[] = {1, 1}, chosen[2][2] = {{0.9, 0.1}, {0.1, 0.9}};
    double single = 0, each = 0;
    for (int own = 0; own < 2; ++own)
        for (int choice = 0; choice < 2; ++choice) {
            const double densities[] = {chosen[0][choice], chosen[1][choice]}, p = densities[own];
            const auto whole = mis::put_in_front(mis::end_sequence<double, 2>(0.5), 1.0, 1.0, densities);
            single += p * mis::single_weight(whole, counts, own) * (1 + 0.5 / p);
            const auto first = mis::start_sequence(counts);
            const auto second = mis::next_draw(first, densities, own);
            each += p * (mis::term_weight(mis::balance, first, own) +
                         mis::term_weight(mis::balance, second, own) * 0.5 / p);
        }
    CHECK(single == doctest::Approx(2.3721).epsilon(1e-4));
    CHECK(each == doctest::Approx(2).epsilon(1e-15));
}

TEST_CASE("the backwards recursion of the single weight is the sum of its definition") {
    generator g(43);
    for (int sample = 0; sample < 1'000; ++sample) {
        constexpr int m = 3, draws = 6;
        double source[draws + 1], factor[draws], densities[draws][m];
        for (double& x : source)
            x = g.uniform(0, 2);
        for (int j = 0; j < draws; ++j) {
            factor[j] = g.uniform(0.1, 2);
            for (double& p : densities[j])
                p = g.uniform(0.1, 2);
        }
        auto state = mis::end_sequence<double, m>(source[draws]);
        for (int j = draws - 1; j >= 0; --j)
            state = mis::put_in_front(state, source[j], factor[j], densities[j]);
        for (int k = 0; k < m; ++k) {
            double sum = 0, product = 1, density = 1;
            for (int j = 0; j <= draws; ++j) {
                sum += source[j] * product * source[j] * product / density;
                if (j < draws) {
                    product *= factor[j];
                    density *= densities[j][k];
                }
            }
            CHECK(state.sum[k] == doctest::Approx(sum).epsilon(1e-12));
        }
        const double counts[] = {1, 2, 0};
        double all = 0;
        for (int k = 0; k < m; ++k)
            all += mis::single_weight(state, counts, k);
        CHECK(all == doctest::Approx(1));
        CHECK(mis::single_weight(state, counts, 2) == 0);
    }
}

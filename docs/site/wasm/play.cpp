// SPDX-License-Identifier: MIT
// Techniques in one dimension for a page: weights, variances by quadrature, and what a few passes look like.
#include <emscripten.h>
#include <mis/optimal/estimator.hpp>
#include <nlohmann/json.hpp>
#include <studies/optimal_model.hpp>

namespace {

using nlohmann::json;
using studies::heuristic_names;
using studies::shape;

constexpr int techniques = 3; // two Gaussians, and a uniform density on [0, 1]
constexpr std::size_t heuristics = heuristic_names.size(), optimal = heuristics, estimators = heuristics + 1;
using numbers = std::array<double, techniques>;

struct setting {
    studies::mixture f;
    std::array<shape, techniques> technique;
    std::array<int, techniques> counts;
    double beta;
};

shape gaussian_of(const json& j) { return {shape::kind::gaussian, j.at("mean"), j.at("deviation")}; }

setting setting_of(const json& j) {
    const double share = j.at("share");
    const json &f = j.at("f"), &p = j.at("p");
    return {{{share, gaussian_of(f.at(0))}, {1 - share, gaussian_of(f.at(1))}},
            {gaussian_of(p.at(0)), gaussian_of(p.at(1)), {shape::kind::uniform, 0, 1}},
            j.at("counts"),
            j.at("beta")};
}

// What is known at x.
struct place {
    double f, total;    // total: sum of n_i p_i
    numbers p, density; // n_i p_i
};

place at(const setting& s, double x) {
    place here{studies::value_at(s.f, x), 0, {}, {}};
    for (std::size_t i = 0; i < techniques; ++i) {
        here.p[i] = studies::value_at(s.technique[i], x);
        here.density[i] = s.counts[i] * here.p[i];
        here.total += here.density[i];
    }
    return here;
}

// Of all techniques, by each heuristic and optimal.
std::array<numbers, estimators> weights_at(const setting& s, const Eigen::VectorXd& alpha,
                                           const place& here) {
    std::array<numbers, estimators> w;
    mis::weights(mis::average, here.density.data(), techniques, w[0].data());
    mis::weights(mis::balance, here.density.data(), techniques, w[studies::balance].data());
    mis::weights(mis::power_heuristic{s.beta}, here.density.data(), techniques, w[studies::power].data());
    mis::weights(mis::cutoff, here.density.data(), techniques, w[studies::cutoff].data());
    mis::weights(mis::maximum, here.density.data(), techniques, w[studies::maximum].data());
    mis::optimal::weights(alpha, here.f, s.counts, here.density, techniques, w[optimal]);
    return w;
}

struct exact {
    double missed = 0; // the part of the integral, which is 1, that no technique samples
    std::array<double, estimators> variance{};
    Eigen::VectorXd alpha = Eigen::VectorXd::Zero(techniques);
};

// Which weights of the cutoff and the maximum heuristic are 0 at x: where that changes, weights jump.
unsigned jumps_at(const setting& s, double x) {
    const place here = at(s, x);
    const double largest = *std::max_element(here.density.begin(), here.density.end());
    unsigned bits = 0;
    for (const double q : here.density)
        bits = bits << 2 | (mis::cutoff.share(q, largest) > 0 ? 2U : 0U) | (q < largest ? 0U : 1U);
    return bits;
}

// Calls add(x, dx) at midpoints of cells, which are smaller where weights jump. The uniform density begins
// and ends where cells do. Outside of them next to nothing is left of what has a variance.
template <class Add> void for_each_midpoint(const setting& s, Add&& add) {
    constexpr int cells = 20'000, parts = 256;
    constexpr double from = -1.5, to = 2.5, dx = (to - from) / cells;
    unsigned before = jumps_at(s, from);
    for (int cell = 0; cell < cells; ++cell) {
        const double x = from + cell * dx;
        const unsigned after = jumps_at(s, x + dx);
        const int count = before == after ? 1 : parts;
        for (int part = 0; part < count; ++part)
            add(x + (part + 0.5) * dx / count, dx / count);
        before = after;
    }
}

exact integrate(const setting& s) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    std::array<numbers, heuristics> means{};
    exact e;
    double squares = 0;
    for_each_midpoint(s, [&](double x, double dx) {
        const place here = at(s, x);
        if (!(here.total > 0)) {
            e.missed += here.f * dx;
            return;
        }
        const auto w = weights_at(s, e.alpha, here);
        for (std::size_t i = 0; i < techniques; ++i)
            for (std::size_t h = 0; here.density[i] > 0 && h < heuristics; ++h) {
                const double weighed = w[h][i] * here.f;
                e.variance[h] += weighed * weighed / here.density[i] * dx;
                means[h][i] += weighed * dx;
            }
        // [O]: A alpha = b, without techniques that take no sample.
        Eigen::Vector3d p;
        for (int i = 0; i < techniques; ++i)
            p[i] = s.counts[std::size_t(i)] > 0 ? here.p[std::size_t(i)] : 0;
        a += p * p.transpose() * (dx / here.total);
        b += p * (here.f * dx / here.total);
        squares += here.f * here.f * dx / here.total;
    });
    for (std::size_t h = 0; h < heuristics; ++h)
        for (std::size_t i = 0; i < techniques; ++i)
            if (s.counts[i] > 0)
                e.variance[h] -= means[h][i] * means[h][i] / s.counts[i];
    Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d> decomposition;
    decomposition.setThreshold(1e-10);
    e.alpha = decomposition.compute(a).solve(b);
    e.variance[optimal] = squares - e.alpha.dot(b);
    for (double& v : e.variance)
        v = std::max(0.0, v); // rounding
    return e;
}

// One pass, by all estimators from the same samples.
std::array<double, estimators> one_pass(const setting& s, const exact& e, pcg32& rng) {
    std::array<double, estimators> sum{};
    sum[optimal] = e.alpha.sum();
    for (std::size_t i = 0; i < techniques; ++i)
        for (int j = 0; j < s.counts[i]; ++j) {
            const place here = at(s, studies::sample(s.technique[i], rng));
            const auto w = weights_at(s, e.alpha, here);
            for (std::size_t h = 0; h < heuristics; ++h)
                sum[h] += w[h][i] * here.f / here.density[i];
            double rest = here.f; // f - sum alpha_k p_k: where f is 0 there are no weights
            for (std::size_t k = 0; k < techniques; ++k)
                rest -= e.alpha[int(k)] * here.p[k];
            sum[optimal] += rest / here.total;
        }
    return sum;
}

std::string answer;

} // namespace

// {"share", "f": [{"mean", "deviation"}, ..], "p": [.. two], "counts": [.. three], "beta"} to
// {"missed", "variance": {name: ..}, "alpha", "x", "f", "p", "weights": {name: [.. of each technique]},
// "passes": {name: estimates}}. All curves are at the places x.
extern "C" EMSCRIPTEN_KEEPALIVE const char* play(const char* text) {
    const setting s = setting_of(json::parse(text));
    const exact e = integrate(s);
    json result{{"missed", e.missed}, {"alpha", {e.alpha[0], e.alpha[1], e.alpha[2]}}};
    std::array<std::string, estimators> names;
    std::copy(heuristic_names.begin(), heuristic_names.end(), names.begin());
    names[optimal] = "optimal";
    constexpr int places = 301;
    for (int k = 0; k < places; ++k) {
        const double x = double(k) / (places - 1);
        const place here = at(s, x);
        const auto w = weights_at(s, e.alpha, here);
        result["x"].push_back(x);
        result["f"].push_back(here.f);
        for (std::size_t i = 0; i < techniques; ++i) {
            result["p"][i].push_back(here.p[i]);
            for (std::size_t h = 0; h < estimators; ++h)
                result["weights"][names[h]][i].push_back(w[h][i]);
        }
    }
    constexpr int passes = 1024;
    pcg32 rng(1); // the same numbers each time: what changes is what the reader has changed
    for (int pass = 0; pass < passes; ++pass) {
        const auto estimates = one_pass(s, e, rng);
        for (std::size_t h = 0; h < estimators; ++h)
            result["passes"][names[h]].push_back(estimates[h]);
    }
    for (std::size_t h = 0; h < estimators; ++h)
        result["variance"][names[h]] = e.variance[h];
    answer = result.dump();
    return answer.c_str();
}

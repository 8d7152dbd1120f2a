// A density estimation whose bias is known exactly, and the errors of any weights on it.
//
// f(x) = base + x^2 on [0, 1]. The biased technique returns the mean of f over [x - radius, x + radius], a
// box kernel's estimate, where the unbiased one returns f(x). The mean is f(x) + radius^2 / 3: the bias is
// the same everywhere, which is what [H] A.1 assumes. Both techniques sample the integral of f, with weights
// that sum to 1; all expectations are integrals over x.
#pragma once

#include <algorithm>
#include <cmath>
#include <mis/bias.hpp>
#include <mis/heuristic.hpp>
#include <string>
#include <vector>

namespace studies {

// A density on [0, 1]: a uniform part, and a part that rises as x^2 or falls as 1 - x.
struct density {
    enum class shape { rising, falling } kind;
    double uniform_part;
};

inline double value_at(const density& p, double x) {
    const double rest = p.kind == density::shape::rising ? 3 * x * x : 2 * (1 - x);
    return p.uniform_part + (1 - p.uniform_part) * rest;
}

struct setup {
    std::string name;
    double base, radius;
    density unbiased, biased;
    int biased_samples; // for each unbiased one
    // The radius after n samples is r_1 n^((alpha - 1) / 2), and in proportion to its area fewer of the
    // biased technique's samples find anything, as in photon mapping.
    bool shrinks;
};

inline double f(const setup& s, double x) { return s.base + x * x; }
inline double integral_of_f(const setup& s) { return s.base + 1.0 / 3; }
inline double radius_at(const setup& s, double n) {
    return s.shrinks ? mis::progressive_radius(s.radius, static_cast<long long>(n)) : s.radius;
}
inline double bias_at(const setup& s, double n) {
    const double r = radius_at(s, n);
    return r * r / 3;
}
// The share of the biased technique's samples that find anything within the radius.
inline double acceptance_at(const setup& s, double n) {
    const double ratio = radius_at(s, n) / s.radius;
    return ratio * ratio;
}

// A setup with n unbiased samples, tabulated at the midpoints of equal intervals.
struct table {
    double n_unbiased, n_biased, bias, integral;
    std::vector<double> x, f, unbiased, biased; // the densities n p of both techniques
};

inline table tabulate(const setup& s, double n, int intervals) {
    table t{n, n * s.biased_samples, bias_at(s, n), integral_of_f(s), {}, {}, {}, {}};
    for (int i = 0; i < intervals; ++i) {
        const double x = (i + 0.5) / intervals;
        t.x.push_back(x);
        t.f.push_back(f(s, x));
        t.unbiased.push_back(n * value_at(s.unbiased, x));
        t.biased.push_back(t.n_biased * acceptance_at(s, n) * value_at(s.biased, x));
    }
    return t;
}

// Weight of the biased technique where the densities n p are as given; the domain's measure is 1.
inline double balance_weight(double unbiased, double biased) { return mis::balance(biased, unbiased); }
inline double aware_weight(double unbiased, double biased, double relative_bias) {
    return mis::balance(mis::bias_aware_density(biased, relative_bias, 1.0), unbiased);
}

using weights = std::vector<double>; // of the biased technique, at the table's places

inline weights balance_weights(const table& t) {
    weights w;
    for (std::size_t i = 0; i < t.x.size(); ++i)
        w.push_back(balance_weight(t.unbiased[i], t.biased[i]));
    return w;
}
inline weights aware_weights(const table& t, bool ignore_bias = false) {
    weights w;
    for (std::size_t i = 0; i < t.x.size(); ++i)
        w.push_back(aware_weight(t.unbiased[i], t.biased[i], ignore_bias ? 0 : t.bias / t.f[i]));
    return w;
}

struct error {
    double variance, bias;
};
inline double squared(const error& e) { return e.variance + e.bias * e.bias; }
inline double rms(const error& e) { return std::sqrt(std::max(0.0, squared(e))); }

// The means that the error depends on: of the unbiased and the biased technique, and of the bias.
struct means {
    double unbiased = 0, biased = 0, bias = 0;
};

inline means means_of(const table& t, const weights& w) {
    means m;
    for (std::size_t i = 0; i < w.size(); ++i) {
        m.unbiased += (1 - w[i]) * t.f[i];
        m.biased += w[i] * (t.f[i] + t.bias);
        m.bias += w[i] * t.bias;
    }
    const double dx = 1 / static_cast<double>(w.size());
    return {m.unbiased * dx, m.biased * dx, m.bias * dx};
}

// [H] 29.
inline error error_of(const table& t, const weights& w) {
    double second_moment = 0;
    for (std::size_t i = 0; i < w.size(); ++i) {
        const double unbiased = (1 - w[i]) * t.f[i], biased = w[i] * (t.f[i] + t.bias);
        second_moment += unbiased * unbiased / t.unbiased[i] + biased * biased / t.biased[i];
    }
    second_moment /= static_cast<double>(w.size());
    const means m = means_of(t, w);
    return {second_moment - m.unbiased * m.unbiased / t.n_unbiased - m.biased * m.biased / t.n_biased,
            m.bias};
}

// The weight, one and the same everywhere, with the least error: the error is a parabola in it.
inline double best_fixed_weight(const table& t) {
    const auto at = [&](double w) { return squared(error_of(t, weights(t.x.size(), w))); };
    const double none = at(0), half = at(0.5), all = at(1);
    const double curvature = 2 * (none + all - 2 * half), slope = all - none - curvature;
    return std::clamp(-slope / (2 * curvature), 0.0, 1.0);
}

// The weights in [0, 1] with the least error, nearly: accelerated projected gradient steps on the error,
// which is convex. Each step is scaled by the error's second derivative at its place; the squared bias
// couples the places and sets the step.
inline weights best_weights(const table& t, int steps) {
    const std::size_t size = t.x.size();
    std::vector<double> unbiased, curvature;
    double coupling = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const double biased = t.f[i] + t.bias;
        unbiased.push_back(t.f[i] * t.f[i] / t.unbiased[i]);
        curvature.push_back(unbiased[i] + biased * biased / t.biased[i]);
        coupling += t.bias * t.bias / curvature[i];
    }
    const double step = 1 / (1 + coupling / static_cast<double>(size));
    weights w = aware_weights(t), ahead = w;
    double momentum = 1;
    for (int k = 0; k < steps; ++k) {
        const means m = means_of(t, ahead);
        const double next_momentum = (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
        for (std::size_t i = 0; i < size; ++i) {
            const double gradient = curvature[i] * ahead[i] - unbiased[i] + m.bias * t.bias +
                                    m.unbiased * t.f[i] / t.n_unbiased -
                                    m.biased * (t.f[i] + t.bias) / t.n_biased;
            const double next = std::clamp(ahead[i] - step * gradient / curvature[i], 0.0, 1.0);
            ahead[i] = next + (momentum - 1) / next_momentum * (next - w[i]);
            w[i] = next;
        }
        momentum = next_momentum;
    }
    return w;
}

} // namespace studies

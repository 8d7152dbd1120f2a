// SPDX-License-Identifier: MIT
// What the page of techniques to play with must show, from the formulas that it prints alone:
//     play_oracle SHARE  F1 F1' F2 F2'  P1 P1' P2 P2'  N1 N2 N3  BETA
// means and deviations of f's peaks and of the densities, counts, beta. Prints names and variances of a pass.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <utility>

namespace {

constexpr int cells = 400'000;
constexpr double from = -1.5, to = 2.5, dx = (to - from) / cells;

double gaussian(double x, double mean, double deviation) {
    const double z = (x - mean) / deviation;
    return std::exp(-z * z / 2) / (deviation * std::sqrt(2 * 3.14159265358979323846));
}

double given[13]; // as above
double f(double x) {
    return given[0] * gaussian(x, given[1], given[2]) + (1 - given[0]) * gaussian(x, given[3], given[4]);
}
double p(int i, double x) {
    if (i == 2)
        return x > 0 && x < 1 ? 1 : 0;
    return gaussian(x, given[5 + 2 * i], given[6 + 2 * i]);
}
double n(int i) { return given[9 + i]; }
double total(double x) { return n(0) * p(0, x) + n(1) * p(1, x) + n(2) * p(2, x); }

// sum of n_i V_i[c_i], where c_i(x) is what a sample x of technique i adds.
double variance(const std::function<double(int, double)>& added) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
        double first = 0, second = 0;
        for (int cell = 0; n(i) > 0 && cell < cells; ++cell) {
            const double x = from + (cell + 0.5) * dx, probability = p(i, x) * dx;
            if (probability > 0) {
                const double c = added(i, x);
                first += c * probability;
                second += c * c * probability;
            }
        }
        sum += n(i) * (second - first * first);
    }
    return sum;
}

// Each technique gets for its q what `share` says, of the largest q.
void print(const char* name, const std::function<double(double, double)>& share) {
    std::printf("%s %.17g\n", name, variance([&](int i, double x) {
                    double largest = 0, all = 0;
                    for (int k = 0; k < 3; ++k)
                        largest = std::max(largest, n(k) * p(k, x));
                    for (int k = 0; k < 3; ++k)
                        all += share(n(k) * p(k, x), largest);
                    return share(n(i) * p(i, x), largest) / all * f(x) / (n(i) * p(i, x));
                }));
}

// A alpha = b for the techniques with samples, by elimination.
void print_optimal() {
    double rows[3][4] = {};
    for (int cell = 0; cell < cells; ++cell) {
        const double x = from + (cell + 0.5) * dx, d = total(x);
        for (int i = 0; d > 0 && i < 3; ++i) {
            for (int k = 0; k < 3; ++k)
                rows[i][k] += n(i) > 0 && n(k) > 0 ? p(i, x) * p(k, x) / d * dx : 0;
            rows[i][3] += n(i) > 0 ? p(i, x) * f(x) / d * dx : 0;
        }
    }
    double alpha[3] = {};
    for (int i = 0; i < 3; ++i) {
        if (n(i) == 0)
            rows[i][i] = 1;
        for (int below = 0; below < 3; ++below)
            if (const double factor = rows[below][i] / rows[i][i]; below != i)
                for (int k = i; k < 4; ++k)
                    rows[below][k] -= factor * rows[i][k];
    }
    for (int i = 0; i < 3; ++i)
        alpha[i] = rows[i][3] / rows[i][i];
    std::printf("optimal %.17g\n", variance([&](int, double x) {
                    return (f(x) - alpha[0] * p(0, x) - alpha[1] * p(1, x) - alpha[2] * p(2, x)) / total(x);
                }));
}

} // namespace

int main(int count, char** arguments) {
    if (count != 14)
        return 2;
    for (int i = 0; i < 13; ++i)
        given[i] = std::atof(arguments[i + 1]);
    print("average", [](double q, double) { return q > 0 ? 1.0 : 0.0; });
    print("balance", [](double q, double) { return q; });
    print("power", [](double q, double largest) { return std::pow(q / largest, given[12]); });
    print("cutoff", [](double q, double largest) { return q < 0.1 * largest ? 0 : q; });
    print("maximum", [](double q, double largest) { return q == largest ? 1.0 : 0.0; });
    print_optimal();
}

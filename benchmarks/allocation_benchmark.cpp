// What the search for counts costs: nanoseconds for each pilot sample and iteration, beside Eigen's dense
// solve of a system of as many unknowns as there are techniques, in turns; and how many iterations there are.
#include <Eigen/Cholesky>
#include <chrono>
#include <cstdio>
#include <mis/optimal/allocation.hpp>
#include <pcg_random.hpp>
#include <random>

namespace {

constexpr int samples = 1000;
double sink = 0; // so that nothing is left out

// Peaks of different widths and places, and a uniform technique; costs up to 100.
struct problem {
    mis::pilot<mis::dynamic> pilot;
    std::vector<double> costs;
    Eigen::MatrixXd matrix;
    Eigen::VectorXd right;

    explicit problem(int m)
        : pilot(m), matrix(Eigen::MatrixXd::Identity(m, m)), right(Eigen::VectorXd::Ones(m)) {
        pcg32 rng(static_cast<std::uint64_t>(m));
        const auto uniform = [&] { return std::uniform_real_distribution<double>(0, 1)(rng); };
        const auto gaussian = [](double x, double mean, double deviation) {
            const double z = (x - mean) / deviation;
            return std::exp(-z * z / 2) / (2.5066 * deviation);
        };
        std::vector<double> means, deviations;
        for (int k = 0; k < m; ++k) {
            means.push_back((k + 0.5) / m);
            deviations.push_back((0.3 + uniform()) / m);
            costs.push_back(std::pow(100, uniform()));
        }
        for (int i = 0; i < samples; ++i) {
            const double x = uniform();
            double f = 0.2 + 0.1 * std::sin(40 * x);
            std::vector<double> densities;
            for (int k = 0; k < m; ++k) {
                const auto at = static_cast<std::size_t>(k);
                densities.push_back(k == 0 ? 1 : gaussian(x, means[at], deviations[at]));
                f += (k % 3) * gaussian(x, means[at] + 0.02, deviations[at] / 2) / m;
            }
            pilot.add(f, densities, 1);
        }
        pilot.passes = samples;
        for (int i = 0; i < m; ++i)
            for (int k = 0; k < m; ++k)
                matrix(i, k) += std::exp(-std::abs(i - k));
    }
};

template <class F> double nanoseconds(int repeats, const F& f) {
    const auto before = std::chrono::steady_clock::now();
    for (int i = 0; i < repeats; ++i)
        f();
    return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - before).count() /
           repeats;
}

// How many iterations come within 1 % of the end.
template <class Allocate> int to_one_percent(const Allocate& allocate, double least) {
    mis::allocation_options some;
    for (some.most_iterations = 0; allocate(some).variance > 1.01 * least; ++some.most_iterations) {
    }
    return some.most_iterations;
}

} // namespace

int main() {
    std::printf(
        "| techniques | Eigen's solve, ns | balance: ns for a sample and iteration | over the solve | "
        "iterations, to 1 %% | optimal weights: ns | over the solve | iterations, to 1 %% |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n");
    for (const int m : {2, 4, 8, 16, 32}) {
        const problem p(m);
        const std::vector<double> equal(static_cast<std::size_t>(m), 1.0);
        const auto balance = [&](const mis::allocation_options& o) {
            return mis::allocate(p.pilot, p.costs, 100, o, equal.data());
        };
        const auto optimal = [&](const mis::allocation_options& o) {
            return mis::optimal::allocate(p.pilot, p.costs, 100, o);
        };
        double solve = 1e300, by_balance = 1e300, by_optimal = 1e300; // the least of turns: nothing else ran
        const auto b = balance({}), o = optimal({});
        for (int turn = 0; turn < 7; ++turn) {
            solve = std::min(solve, nanoseconds(200, [&] { sink += p.matrix.ldlt().solve(p.right)[0]; }));
            by_balance = std::min(by_balance, nanoseconds(1, [&] { sink += balance({}).variance; }));
            by_optimal = std::min(by_optimal, nanoseconds(1, [&] { sink += optimal({}).variance; }));
        }
        by_balance /= samples * double(std::max(1, b.iterations));
        by_optimal /= samples * double(std::max(1, o.iterations));
        std::printf("| %d | %.0f | %.1f | %.3f | %d, %d | %.1f | %.3f | %d, %d |\n", m, solve, by_balance,
                    by_balance / solve, b.iterations, to_one_percent(balance, b.variance), by_optimal,
                    by_optimal / solve, o.iterations, to_one_percent(optimal, o.variance));
        std::fflush(stdout);
    }
    return sink > 0 ? 0 : 1;
}

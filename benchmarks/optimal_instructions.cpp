// Adds 1,000 samples to an estimator of optimal weights, or solves one 1,000 times, so that valgrind can
// count the instructions:
//     optimal_instructions add_4      (no argument: prints all names)
//     optimal_instructions bytes 4    prints the size of the estimator
// benchmarks/count_optimal.sh runs all of them and prints the table.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mis/optimal/solve.hpp>
#include <pcg_random.hpp>
#include <random>

namespace {

constexpr int repetitions = 1000;

template <int M> struct sample { double f[3], densities[M]; };

template <int M> const std::vector<sample<M>>& samples() {
    static const auto made = [] {
        pcg32 rng(1);
        std::uniform_real_distribution<double> positive(0.1, 2);
        std::vector<sample<M>> all(repetitions);
        for (auto& x : all) {
            for (double& f : x.f)
                f = positive(rng);
            for (double& q : x.densities)
                q = positive(rng);
        }
        return all;
    }();
    return made;
}

template <int M> struct counts {
    double n[M];
    counts() {
        for (double& x : n)
            x = 1;
    }
};

template <int M> void add(mis::optimal::estimator<M>& e, const std::vector<sample<M>>& x) {
    for (int i = 0; i < repetitions; ++i)
        e.add(x[static_cast<std::size_t>(i)].f, x[static_cast<std::size_t>(i)].densities);
}
template <int M> double solve(const mis::optimal::estimator<M>& e, const double* n) {
    double sum = 0;
    for (int i = 0; i < repetitions; ++i)
        sum += integral(e, n)[0];
    return sum;
}

} // namespace

// The names that callgrind collects. The estimator is passed by reference, so that it is in memory.
#define MEASURE(M)                                                                                           \
    [[gnu::noinline]] void measure_add_##M(mis::optimal::estimator<M>& e, const std::vector<sample<M>>& x) { \
        add<M>(e, x);                                                                                        \
    }                                                                                                        \
    [[gnu::noinline]] double measure_solve_##M(const mis::optimal::estimator<M>& e, const double* n) {       \
        return solve<M>(e, n);                                                                               \
    }
extern "C" {
MEASURE(2)
MEASURE(4)
MEASURE(8)
MEASURE(16)
}

#define RUN(M)                                                                                               \
    if (count < 2)                                                                                           \
        std::puts("add_" #M "\nsolve_" #M);                                                                  \
    else if (count == 3 && std::atoi(arguments[2]) == M)                                                     \
        std::printf("%zu\n", sizeof(mis::optimal::estimator<M>));                                            \
    else if (std::strcmp(arguments[1], "add_" #M) == 0 || std::strcmp(arguments[1], "solve_" #M) == 0) {     \
        mis::optimal::estimator<M> e;                                                                        \
        measure_add_##M(e, samples<M>());                                                                    \
        sum = arguments[1][0] == 's' ? measure_solve_##M(e, counts<M>().n) : e.squares[0];                   \
    }

int main(int count, char** arguments) {
    double sum = 0;
    RUN(2)
    RUN(4)
    RUN(8)
    RUN(16)
    return sum < 0;
}

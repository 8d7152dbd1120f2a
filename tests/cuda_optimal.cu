// SPDX-License-Identifier: MIT
// Adds samples to estimators on the device, so that nvcc compiles what optimal/estimator.hpp has for it.
// Compiled only; the numbers mean nothing. Solving is the host's.
#include <mis/optimal/estimator.hpp>

namespace {

template <class T> __device__ void all(T* q, int n) {
    mis::optimal::estimator<4, 3, T> e, other(4);
    e.add(q, q + 3);
    e.add_weighted(q, q + 3);
    e.add_outside(n);
    e.add_outside(n, 7);
    e += other;
    mis::optimal::estimator<5, 1, T> one;
    one.add(q[0], q + 1);
    mis::optimal::progressive<4, 3, T> p;
    p.add(q, q + 3);
    p.add_weighted(q, q + 3);
    p.add_outside(n, 2);
    auto worker = mis::optimal::fork(p);
    worker.add(q, q + 3);
    p += worker;
    mis::optimal::weights(q, q[0], q + 1, q + 5, n, q + 5);
    q[0] = T(mis::optimal::draws(e)) + T(p.residual[0]) + T(one.pair(1, 2));
}

} // namespace

__global__ void every_function(float* f, double* d, int n) {
    all(f, n);
    all(d, n);
}

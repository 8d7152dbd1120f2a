// Weights in kernels, against the device's own bandwidth: what one thread does stands in threads.hpp.
//     nvcc -std=c++17 -O3 -arch=native -I include benchmarks/cuda/weights_benchmark.cu -o weights_benchmark
// Prints each kernel's bytes per second over those of a kernel that copies, and by how many ulp its weights
// differ from the host's. 1 if a kernel moves less than 85 % of the copy's bytes, or a weight differs by more
// than 4 ulp; 77 where there is no device.
#include "threads.hpp"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

namespace {

template <class Thread> __global__ void run_all(Thread thread, std::size_t count) {
    const std::size_t stride = std::size_t(gridDim.x) * blockDim.x;
    for (std::size_t k = std::size_t(blockIdx.x) * blockDim.x + threadIdx.x; k < count; k += stride)
        thread(k);
}

void check(cudaError_t error, const char* what) {
    if (error == cudaSuccess)
        return;
    std::fprintf(stderr, "%s: %s\n", what, cudaGetErrorString(error));
    std::exit(1);
}

// The same numbers on both sides.
struct array {
    std::vector<float> host;
    float* device = nullptr;

    array(std::size_t size, std::uint32_t seed) : host(size) {
        std::mt19937 engine(seed);
        for (float& x : host)
            x = std::uniform_real_distribution<float>(0.1f, 2)(engine);
        check(cudaMalloc(&device, size * sizeof(float)), "cudaMalloc");
        check(cudaMemcpy(device, host.data(), size * sizeof(float), cudaMemcpyHostToDevice), "cudaMemcpy");
    }
    array(const array&) = delete;
    ~array() { cudaFree(device); }
};

// The best of many, in bytes per second.
template <class Thread> double bytes_per_second(const Thread& thread, std::size_t count) {
    cudaDeviceProp device{};
    check(cudaGetDeviceProperties(&device, 0), "cudaGetDeviceProperties");
    cudaEvent_t start, end;
    check(cudaEventCreate(&start), "cudaEventCreate");
    check(cudaEventCreate(&end), "cudaEventCreate");
    float least = 1e30f; // milliseconds
    for (int k = 0; k < 30; ++k) {
        check(cudaEventRecord(start), "cudaEventRecord");
        run_all<<<device.multiProcessorCount * 16, 256>>>(thread, count);
        check(cudaEventRecord(end), "cudaEventRecord");
        check(cudaEventSynchronize(end), "kernel");
        float time = 0;
        check(cudaEventElapsedTime(&time, start, end), "cudaEventElapsedTime");
        least = std::min(least, time);
    }
    cudaEventDestroy(start);
    cudaEventDestroy(end);
    return 4.0 * Thread::floats * double(count) / (1e-3 * double(least));
}

double ulp(float a, float b) {
    std::int32_t x, y;
    std::memcpy(&x, &a, sizeof x);
    std::memcpy(&y, &b, sizeof y);
    return std::fabs(double(x) - double(y)); // both are positive
}

bool failed = false;

template <class Thread>
void report(const char* name, const Thread& on_device, const Thread& on_host, std::size_t count, int weights,
            array& out, std::size_t stride, double copy) {
    const double speed = bytes_per_second(on_device, count);
    constexpr std::size_t compared = 1 << 16;
    for (std::size_t k = 0; k < compared; ++k)
        on_host(k);
    std::vector<float> from_device(out.host.size());
    check(cudaMemcpy(from_device.data(), out.device, out.host.size() * sizeof(float), cudaMemcpyDeviceToHost),
          "cudaMemcpy");
    double apart = 0;
    std::size_t equal = 0;
    for (int j = 0; j < weights; ++j)
        for (std::size_t k = 0; k < compared; ++k) {
            const std::size_t i = std::size_t(j) * stride + k;
            const double d = ulp(from_device[i], out.host[i]);
            apart = std::max(apart, d);
            equal += d == 0;
        }
    const bool is_fast = speed >= 0.85 * copy, is_same = apart <= 4;
    failed = failed || !is_fast || !is_same;
    std::printf("| %s | %.0f | %.2f%s | %.0f | %.1f %%%s |\n", name, speed / 1e9, speed / copy,
                is_fast ? "" : " MISSED", apart, 100.0 * double(equal) / (double(weights) * double(compared)),
                is_same ? "" : " FAILED");
}

} // namespace

int main() {
    int devices = 0;
    if (cudaGetDeviceCount(&devices) != cudaSuccess || devices == 0) {
        std::puts("no CUDA device here: nothing was measured");
        return 77;
    }
    cudaDeviceProp device{};
    check(cudaGetDeviceProperties(&device, 0), "cudaGetDeviceProperties");
    constexpr std::size_t count = 1 << 26, stride = 1 << 22;
    constexpr int length = threads::walk_length;
    array a(count, 1), b(count, 2), out(count, 3);
    const double copy = bytes_per_second(threads::copy{a.device, out.device}, count);
    std::printf("%s, copies: %.0f GB/s\n\n", device.name, copy / 1e9);
    std::printf(
        "| kernel | GB/s | of the copy's | ulp from the host | equal |\n| --- | --- | --- | --- | --- |\n");
    report("two techniques, power", threads::two_techniques{a.device, b.device, out.device},
           threads::two_techniques{a.host.data(), b.host.data(), out.host.data()}, count, 1, out, 0, copy);
    using four = threads::n_techniques<4, mis::power_heuristic<>>;
    report("4 techniques, power", four{a.device, out.device, count / 4},
           four{a.host.data(), out.host.data(), count / 4}, count / 4, 4, out, count / 4, copy);

    array edges(std::size_t(11 * length * stride), 4);
    const auto walks = [&](const float* x) {
        const auto next = [&] { return std::exchange(x, x + length * stride); };
        threads::walks w{};
        for (const float** part :
             {&w.cos_out, &w.forward, &w.reverse, &w.distance2, &w.cos_in, &w.light_a, &w.light_b,
              &w.light_cos, &w.light_forward, &w.light_reverse, &w.light_distance2})
            *part = next();
        w.stride = stride;
        return w;
    };
    const mis::path_weights weigh{mis::balance_heuristic{}, mis::bidirectional(1e4f),
                                  mis::connected_surfaces{}};
    using path = threads::path<mis::connected_surfaces>;
    report("walk of 8 and its connections", path{weigh, walks(edges.device), out.device},
           path{weigh, walks(edges.host.data()), out.host.data()}, stride, length, out, stride, copy);
    return failed ? 1 : 0;
}

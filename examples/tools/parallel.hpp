// Threads.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace tools {

// Calls f(i) for 0 <= i < count on several threads, the caller's among them.
template <class F> void in_parallel(int threads, int count, F&& f) {
    std::atomic<int> next{0};
    const auto work = [&] {
        for (int k; (k = next++) < count;)
            f(k);
    };
    std::vector<std::thread> pool;
    for (int i = 1; i < threads; ++i)
        pool.emplace_back(work);
    work();
    for (auto& thread : pool)
        thread.join();
}

} // namespace tools

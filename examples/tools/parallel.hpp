// Threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace tools {

// Calls f(i) for 0 <= i < count on several threads.
template <class F> void in_parallel(int threads, int count, F&& f) {
    std::atomic<int> next{0};
    std::vector<std::thread> pool;
    for (int i = 0; i < std::max(1, threads); ++i)
        pool.emplace_back([&] {
            for (int k; (k = next++) < count;)
                f(k);
        });
    for (auto& thread : pool)
        thread.join();
}

} // namespace tools

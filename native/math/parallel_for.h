// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

namespace selenite {

/// Calls work(0) ... work(count - 1), in any order, from so many threads; 0: one per core. Throws what
/// `work` throws first, by the number of the thread.
template <class Work>
void parallel_for(int count, int threads, const Work& work) {
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int used = std::max(1, std::min(threads > 0 ? threads : cores, count));
  std::atomic<int> next{0};
  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(used));
  const auto run = [&](int thread) {
    try {
      for (int i = next++; i < count; i = next++) work(i);
    } catch (...) {
      failures[static_cast<std::size_t>(thread)] = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < used; ++i) others.emplace_back(run, i);
    run(0);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace selenite

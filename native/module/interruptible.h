// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <future>

#include "render/driver/progress.h"

namespace selenite {

/// What `work(Progress*)` returns. It runs in a thread of its own while this one, which holds Python's lock
/// before and after, looks for signals: Ctrl+C cancels the work and is raised, however long that would take.
/// `watched`: the caller's progress, or null.
template <class Work>
auto interruptible(Progress* watched, const Work& work) {
  constexpr std::chrono::milliseconds kTick{50};
  Progress own;
  Progress* progress = watched != nullptr ? watched : &own;
  auto result = std::async(std::launch::async, [&] { return work(progress); });
  const auto is_done = [&] {
    const pybind11::gil_scoped_release release;
    return result.wait_for(kTick) == std::future_status::ready;
  };
  while (!is_done()) {
    if (PyErr_CheckSignals() == 0) continue;
    progress->cancelled = true;
    while (!is_done()) {
    }
    throw pybind11::error_already_set();
  }
  return result.get();
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "fit/problem/render_workers.h"

namespace selenite {

/// A Python object as workers of a fit: methods ask(bytes, work) -> int, answer(int, seconds) -> bytes or None,
/// forget(int), and busy_with, an int. None: null.
std::shared_ptr<RenderWorkers> workers_of(const pybind11::object& object);

}  // namespace selenite

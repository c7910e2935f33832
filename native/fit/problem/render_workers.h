// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

#include "render/driver/progress.h"

namespace selenite {

/// Processes that render photos of a fit. A question and its answer are bytes; `StageWorker` turns one into
/// the other.
class RenderWorkers {
 public:
  virtual ~RenderWorkers() = default;
  /// Hands on a question and returns at once, with a number for it. work: what the answer takes, in any
  /// unit; an answer that takes far longer than others is late. Throws std::runtime_error.
  virtual std::int64_t ask(const std::string& question, double work) = 0;
  /// Waits for the answer, which is given once. Throws Cancelled, std::runtime_error.
  virtual std::string answer(std::int64_t number, const Progress* progress) = 0;
  /// Nobody will ask for the answer.
  virtual void forget(std::int64_t number) = 0;
  /// Questions that keep all of them busy.
  virtual int busy_with() const = 0;
};

}  // namespace selenite

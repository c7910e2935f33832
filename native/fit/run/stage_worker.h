// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "fit/problem/render_workers.h"
#include "fit/run/stage.h"

namespace selenite {

/// The workers of a run as one of its stages sees them: each question says where the stage started.
std::shared_ptr<RenderWorkers> workers_of_stage(std::shared_ptr<RenderWorkers> workers,
                                                std::size_t stage, RunPoint point);

/// Renders what the stages of a run ask for, in a process without them: it answers the questions of
/// `RenderWorkers`. May be called from several threads.
class StageWorker {
 public:
  /// As of the run. Photos need no pixels of their own: one is enough.
  StageWorker(std::vector<UnknownParameter> unknowns, std::vector<Stage> stages, int threads);
  /// InvalidArgument: the question is damaged, or of another run.
  std::string answer(std::string_view question);

 private:
  /// A stage at the point where it started, known by the bytes that say so.
  struct Begun {
    std::string where;
    std::shared_ptr<const FitProblem> problem;
  };
  std::shared_ptr<const FitProblem> begun(std::string_view where);

  std::vector<Stage> stages_;
  RunUnknowns unknowns_;
  int threads_;
  std::mutex mutex_;
  Begun newest_;
};

}  // namespace selenite

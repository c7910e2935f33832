// SPDX-License-Identifier: GPL-3.0-or-later
#include "module/worker_binding.h"

#include <pybind11/stl.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "fit/run/stage_worker.h"
#include "math/error.h"
#include "module/bindings.h"
#include "render/lanes/lanes.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// How long Python waits before it is asked whether the fit has been cancelled.
constexpr double kTick = 0.1;

/// What `work` returns of Python, in a thread that does not hold its lock.
template <class Work>
auto in_python(const Work& work) {
  const py::gil_scoped_acquire acquire;
  try {
    return work();
  } catch (const py::error_already_set& error) {
    throw std::runtime_error(py::str(error.value()).cast<std::string>());
  }
}

class PythonWorkers final : public RenderWorkers {
 public:
  explicit PythonWorkers(py::object workers)
      : workers_(std::move(workers)), busy_with_(workers_.attr("busy_with").cast<int>()) {}
  PythonWorkers(const PythonWorkers&) = delete;
  PythonWorkers& operator=(const PythonWorkers&) = delete;
  ~PythonWorkers() override {
    const py::gil_scoped_acquire acquire;
    workers_ = py::object();
  }

  std::int64_t ask(const std::string& question, double work) override {
    return in_python(
        [&] { return workers_.attr("ask")(py::bytes(question), work).cast<std::int64_t>(); });
  }
  std::string answer(std::int64_t number, const Progress* progress) override {
    while (progress == nullptr || !progress->cancelled) {
      std::optional<std::string> found = in_python([&]() -> std::optional<std::string> {
        const py::object bytes = workers_.attr("answer")(number, kTick);
        if (bytes.is_none()) return std::nullopt;
        return bytes.cast<std::string>();
      });
      if (found) return *std::move(found);
    }
    forget(number);
    throw Cancelled("The fit was cancelled");
  }
  void forget(std::int64_t number) override {
    in_python([&] { workers_.attr("forget")(number); });
  }
  int busy_with() const override { return busy_with_; }

 private:
  py::object workers_;
  int busy_with_;
};

}  // namespace

std::shared_ptr<RenderWorkers> workers_of(const py::object& object) {
  if (object.is_none()) return nullptr;
  return std::make_shared<PythonWorkers>(object);
}

void bind_workers(py::module_& m) {
  m.def("has_lanes", &has_lanes,
        "Whether this build and this processor trace paths eight at a time. Their pictures differ "
        "from "
        "others by rounding.");
  py::class_<StageWorker>(m, "StageWorker", py::release_gil_before_calling_cpp_dtor(),
                          R"(Renders the photos of a fit in another process than the fit's.

Args:
    unknowns, stages: as of Fit; photos may have one pixel.
    threads: of a render; 0: all cores.)")
      .def(py::init([](const std::vector<UnknownParameter>& unknowns, std::vector<Stage> stages,
                       int threads) {
             return std::make_unique<StageWorker>(unknowns, std::move(stages), threads);
           }),
           "unknowns"_a, "stages"_a, py::kw_only(), "threads"_a = 0)
      .def(
          "answer",
          [](StageWorker& self, const py::bytes& question) {
            const std::string_view asked(question);
            std::string found;
            {
              const py::gil_scoped_release release;
              found = self.answer(asked);
            }
            return py::bytes(found);
          },
          "question"_a,
          "The picture that a fit asks for, as bytes. ValueError: the question is damaged, or of\n"
          "another fit.");
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>

#include <system_error>

#include "math/error.h"
#include "math/instruction_set.h"
#include "module/bindings.h"
#include "module/problem_binding.h"
#include "scene/geometry.h"

namespace py = pybind11;

namespace selenite {
namespace {

/// One triangle, one ray whose answer is known. A host with another Embree in its global symbols
/// answers wrongly and silently (docs/method/rendering.md, "Two copies of Embree in
/// one process"); this turns it into a message.
void self_test() {
  Mesh mesh;
  mesh.name = "self test";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.corner_normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  mesh.material_slots = {0};
  Instance instance;
  instance.name = "self test";
  instance.materials = {0};
  const Geometry geometry({mesh}, {instance});
  const Vec3f below = Vec3f(Vec3d{0.25, 0.25, -2} - geometry.origin());
  const auto hit = geometry.intersect({below, {0, 0, 1}, 0, 100}, kDiffuseRay);
  if (!hit || std::abs(hit->t - 2) > 1e-5f || std::abs(hit->b1 - 0.25f) > 1e-5f)
    throw py::import_error(
        "selenite._core: Embree gives a wrong answer in this process; another version of it is "
        "loaded in front of ours. Use the self-contained release build of Selenite.");
}

/// Embree's oldest code path in the packages is SSE4.2. Rays in packets and paths in lanes need AVX2
/// on top, and are chosen where the processor has it.
void check_processor() {
#if defined(__GNUC__) && defined(__x86_64__)
  if (!has_sse42())
    throw py::import_error(
        "selenite._core: this processor has no SSE4.2, which x86-64 processors have had since "
        "2008; Selenite needs a newer one.");
#endif
}

}  // namespace
}  // namespace selenite

PYBIND11_MODULE(_core, m) {
  m.doc() = "Differentiable rendering and fitting of Blender scenes (Embree).";
  m.attr("__version__") = SELENITE_VERSION;
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 fixes the signature
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const selenite::NotFound& error) {
      selenite::set_error(PyExc_KeyError, error.what(), error.faults());
    } catch (const selenite::Refused& error) {
      selenite::set_error(PyExc_ValueError, error.what(), error.faults());
    } catch (const selenite::InvalidArgument& error) {
      selenite::set_error(PyExc_ValueError, error.what(), {{"", error.what(), ""}});
    } catch (const std::system_error& error) {
      const py::tuple of = py::make_tuple(error.code().value(), error.code().message());
      PyErr_SetObject(PyExc_OSError, of.ptr());
    }
  });
  selenite::bind_problem(m);
  py::register_exception<selenite::Cancelled>(m, "Cancelled", PyExc_RuntimeError);
  selenite::bind_parameters(m);
  selenite::bind_scene(m);
  selenite::bind_render(m);
  selenite::bind_photo(m);
  selenite::bind_fit(m);
  selenite::bind_workers(m);
  selenite::bind_photo_jacobian(m);
  selenite::bind_evaluator(m);
  selenite::bind_fisher_information(m);
  selenite::bind_schedule(m);
  selenite::bind_probe(m);
  selenite::check_processor();
  selenite::self_test();
}

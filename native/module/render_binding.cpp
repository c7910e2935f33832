// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>

#include "module/arrays.h"
#include "module/bindings.h"
#include "module/interruptible.h"
#include "module/named_film.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/render.h"
#include "render/lanes/lanes.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

Picture half_b(const Film& film, const Picture& mean, const Picture& half_a) {
  Picture out(mean.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = film.half_b(mean[i], half_a[i]);
  return out;
}

Picture root(const Picture& variance) {
  Picture out(variance.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = map(variance[i], [](float v) { return safe_sqrt(v); });
  return out;
}

/// (rows, height, width, 3): one picture per scalar unknown, from the pictures of its slot.
template <class Select>
py::array_t<float> jacobian(const NamedFilm& f, Select&& select) {
  const auto n = static_cast<py::ssize_t>(f.layout.rows.size());
  py::array_t<float> out(
      {n, py::ssize_t{f.film.height}, py::ssize_t{f.film.width}, py::ssize_t{3}});
  float* data = out.mutable_data();
  for (const UnknownRow& row : f.layout.rows) {
    const Picture& picture = select(f.film.slots[row.slot]);
    for (const Colorf& c : picture)
      for (int k = 0; k < 3; ++k) *data++ = row.channel < 0 || row.channel == k ? c[k] : 0;
  }
  return out;
}

NamedFilm render_named(const Scene& scene, const std::string& camera, int width, int height,
                       int spp, std::uint64_t seed, int depth, int threads, const FrameTuple& frame,
                       int lanes, const std::vector<ParameterName>& parameters,
                       Progress* progress) {
  NamedFilm out = film_of(scene, parameters);
  const Camera& from = scene.camera(camera);
  out.film = interruptible(progress, [&](Progress* watched) {
    return render(scene, from, out.layout,
                  {width, height, spp, seed, depth, threads, frame_of(frame), lanes}, watched);
  });
  return out;
}

/// By the objects that place them; "" for a lamp without one.
std::vector<std::string> aimed_lamps(const Scene& scene) {
  std::vector<std::string> names;
  for (const Light& lamp : scene.appearance.lights)
    if (lamp.aimed.value_or(false)) names.push_back(lamp.place());
  return names;
}

Scene with_aimed_lamps(Scene scene, const std::vector<std::string>& names) {
  for (Light& lamp : scene.appearance.lights)
    lamp.aimed = std::ranges::find(names, lamp.place()) != names.end();
  return scene;
}

Scene decide_named(const Scene& scene, const std::string& camera, int width, int height, int depth,
                   int threads, const FrameTuple& frame,
                   const std::vector<ParameterName>& parameters) {
  std::vector<ParameterRef> refs;
  for (const auto& [owner, name] : parameters) refs.push_back(scene.find(owner, name));
  const SlotLayout layout(scene, refs);
  const Camera& from = scene.camera(camera);
  py::gil_scoped_release release;
  return decide_aims(scene, from, layout,
                     {.width = width,
                      .height = height,
                      .depth = depth,
                      .threads = threads,
                      .frame = frame_of(frame)});
}

}  // namespace

NamedFilm film_of(const Scene& scene, const std::vector<ParameterName>& parameters) {
  NamedFilm out;
  std::vector<ParameterRef> refs;
  for (const auto& [owner, name] : parameters) refs.push_back(scene.find(owner, name));
  out.layout = SlotLayout(scene, refs);
  for (std::size_t i = 0; i < refs.size(); ++i)
    for (int c = 0; c < scene.width(refs[i]); ++c)
      out.unknowns.emplace_back(parameters[i].first, parameters[i].second, c);
  return out;
}

void bind_render(py::module_& m) {
  py::class_<Progress>(m, "ProgressToken", "Watches and cancels a render from another thread.")
      .def(py::init<>())
      .def("cancel", [](Progress& p) { p.cancelled = true; })
      .def_property_readonly("fraction", [](const Progress& p) { return p.fraction.load(); });

  const auto picture = [](const NamedFilm& f, const Picture& p) {
    return picture_array(p, f.film.width, f.film.height);
  };
  py::class_<NamedFilm>(m, "Film", "Pictures are (height, width, 3) float32, row 0 at the top.")
      .def_property_readonly("image", [=](const NamedFilm& f) { return picture(f, f.film.mean); })
      .def_property_readonly("standard_error",
                             [=](const NamedFilm& f) { return picture(f, root(f.film.variance)); })
      .def_property_readonly("half_a",
                             [=](const NamedFilm& f) { return picture(f, f.film.half_a); })
      .def_property_readonly(
          "half_b",
          [=](const NamedFilm& f) {
            if (f.film.spp < 2)
              throw InvalidArgument(
                  "Film: one sample a pixel has no second half; render with spp of at least 2");
            return picture(f, half_b(f.film, f.film.mean, f.film.half_a));
          })
      .def_readonly("unknowns", &NamedFilm::unknowns,
                    "(owner, parameter, component) of every row of the Jacobian.")
      .def_property_readonly(
          "jacobian",
          [](const NamedFilm& f) {
            return jacobian(f, [](const SlotFilm& s) -> const Picture& { return s.mean; });
          },
          "(p, height, width, 3): d(radiance)/d(unknown).")
      .def_property_readonly("jacobian_standard_error",
                             [](const NamedFilm& f) {
                               return jacobian(f,
                                               [](const SlotFilm& s) { return root(s.variance); });
                             })
      .def_property_readonly(
          "covariance",
          [](const NamedFilm& f) {
            return jacobian(f, [](const SlotFilm& s) -> const Picture& { return s.covariance; });
          },
          "(p, height, width, 3): of each pixel's mean derivative with its mean radiance.")
      .def_property_readonly("dropped", [](const NamedFilm& f) { return f.film.dropped; })
      .def_property_readonly("first_dropped",
                             [](const NamedFilm& f) { return f.film.first_dropped; })
      .def_property_readonly("truncated", [](const NamedFilm& f) { return f.film.truncated; })
      .def_property_readonly("lanes", [](const NamedFilm& f) { return f.film.lanes; })
      .def_property_readonly("vertices", [](const NamedFilm& f) { return f.film.vertices; })
      .def_property_readonly("exits", [](const NamedFilm& f) { return f.film.exits; })
      .def_property_readonly("spp", [](const NamedFilm& f) { return f.film.spp; })
      .def_property_readonly("seconds", [](const NamedFilm& f) { return f.film.seconds; })
      .def_property_readonly("cpu_seconds", [](const NamedFilm& f) { return f.film.cpu_seconds; });

  m.def("render", &render_named, "scene"_a, "camera"_a, "width"_a, "height"_a, "spp"_a,
        py::kw_only(), "seed"_a = 0, "depth"_a = 0, "threads"_a = 0, "frame"_a = FrameTuple{},
        "lanes"_a = 0, "parameters"_a = std::vector<ParameterName>{}, "progress"_a = py::none(),
        "Image, standard error and, for `parameters` [(owner, name), ...], the Jacobian.\n\n"
        "depth 0: no limit; threads 0: one per core. Equal seeds give equal bytes whatever the\n"
        "number of threads. frame: as of a Photo. lanes: paths that a thread traces in lockstep, 1 "
        "or\n"
        "8; 0: eight where processor and scene permit.\n"
        "Raises ValueError, KeyError, Cancelled.");

  m.def("decide_aims", &decide_named, "scene"_a, "camera"_a, "width"_a, "height"_a, py::kw_only(),
        "depth"_a = 0, "threads"_a = 0, "frame"_a = FrameTuple{},
        "parameters"_a = std::vector<ParameterName>{},
        "Scene in which it is decided at which lamps paths inside a medium aim: by a pilot, for\n"
        "this picture and these derivatives. `render` decides by itself where that is open.\n"
        "Raises KeyError.");
  m.def("aimed_lamps", &aimed_lamps, "scene"_a, "Objects of the lamps that paths aim at.");
  m.def("with_aimed_lamps", &with_aimed_lamps, "scene"_a, "objects"_a,
        "Scene whose paths aim at these lamps and no others.");

  m.def(
      "lanes_obstacle", [](const Scene& scene) { return lanes_obstacle(scene); }, "scene"_a,
      "What keeps a scene from being traced eight paths at a time; empty if nothing does.");
}

}  // namespace selenite

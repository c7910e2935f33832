// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>

#include "fit/objective/alignment.h"
#include "module/arrays.h"
#include "module/bindings.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/field_gradient.h"
#include "render/driver/render.h"
#include "render/lanes/lanes.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// A film with what is needed to name its derivatives.
struct NamedFilm {
  Film film;
  SlotLayout layout;
  std::vector<std::tuple<std::string, std::string, int>> unknowns;
};

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

std::unique_ptr<NamedFilm> render_named(
    const Scene& scene, const std::string& camera, int width, int height, int spp,
    std::uint64_t seed, int depth, int threads, const FrameTuple& frame, int lanes,
    const std::vector<std::pair<std::string, std::string>>& parameters,
    const std::array<double, 3>& alignment, Progress* progress) {
  auto out = std::make_unique<NamedFilm>();
  std::vector<ParameterRef> refs;
  for (const auto& [owner, name] : parameters) refs.push_back(scene.find(owner, name));
  out->layout = SlotLayout(scene, refs);
  for (std::size_t i = 0; i < refs.size(); ++i)
    for (int c = 0; c < scene.width(refs[i]); ++c)
      out->unknowns.emplace_back(parameters[i].first, parameters[i].second, c);
  const Alignment moved{alignment[0], alignment[1], alignment[2]};
  const Camera from = moved.apply(scene.camera(camera), width, height, frame_of(frame));
  py::gil_scoped_release release;
  out->film = render(scene, from, out->layout,
                     {width, height, spp, seed, depth, threads, frame_of(frame), lanes}, progress);
  return out;
}

/// A picture, and a loss's derivative by the texels of a base colour's image: (height, width, 3).
std::pair<std::unique_ptr<NamedFilm>, py::array_t<double>> texture_gradient(
    const Scene& scene, const std::string& camera, int width, int height, int spp,
    const std::string& material, const std::optional<Array<float>>& reference,
    const std::optional<Array<float>>& weight, std::uint64_t seed, int depth, int threads,
    const FrameTuple& frame, Progress* progress) {
  const ImageRef unknown{scene.material(material)};
  const Texture& image = *scene.image(unknown).texture;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  Picture photo;
  if (reference) {
    require_shape(*reference, "reference", {height, width, 3});
    photo = colors_of(*reference);
  }
  std::vector<float> weights(pixels, 1);
  if (weight) {
    if (reference)
      throw InvalidArgument("weight: give it without reference; the mean alone has one");
    require_shape(*weight, "weight", {height, width});
    weights.assign(weight->data(), weight->data() + weight->size());
  }
  auto out = std::make_unique<NamedFilm>();
  for (int c = 0; c < 3; ++c) {
    out->layout.rows.push_back({0, c, c});
    out->unknowns.emplace_back(material, kBaseColorTexture, c);
  }
  const Camera& from = scene.camera(camera);
  auto texels = std::make_unique<std::vector<double>>();
  {
    py::gil_scoped_release release;
    FieldGradient found = render_field_gradient(
        scene, from, {unknown}, {width, height, spp, seed, depth, threads, frame_of(frame)},
        reference ? squared_error(photo) : mean_of_pixels(std::move(weights)), progress);
    out->film = std::move(found.film);
    *texels = std::move(found.fields[0]);
  }
  // The array owns the sums: they are the larger part of a small picture's memory.
  const py::capsule owner(texels.get(),
                          [](void* sums) { delete static_cast<std::vector<double>*>(sums); });
  const double* values = texels.release()->data();
  return {std::move(out), py::array_t<double>({image.height(), image.width(), 3}, values, owner)};
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
                   const std::vector<std::pair<std::string, std::string>>& parameters) {
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

py::array_t<double> environment_gradient(const Scene& scene, const std::string& camera, int width,
                                         int height, int spp, const Array<float>& weight,
                                         std::uint64_t seed, int depth, int threads,
                                         const FrameTuple& frame) {
  require_shape(weight, "weight", {height, width});
  std::vector<float> weights(weight.data(), weight.data() + weight.size());
  const EnvironmentMap& image = scene.environment();
  const Camera& from = scene.camera(camera);
  std::vector<double> texels;
  {
    py::gil_scoped_release release;
    texels = render_field_gradient(scene, from, {EnvironmentRef{}},
                                   {width, height, spp, seed, depth, threads, frame_of(frame)},
                                   mean_of_pixels(std::move(weights)))
                 .fields[0];
  }
  py::array_t<double> found({image.height(), image.width(), 3});
  std::copy(texels.begin(), texels.end(), found.mutable_data());
  return found;
}

}  // namespace

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

  m.def(
      "render", &render_named, "scene"_a, "camera"_a, "width"_a, "height"_a, "spp"_a, py::kw_only(),
      "seed"_a = 0, "depth"_a = 0, "threads"_a = 0, "frame"_a = FrameTuple{}, "lanes"_a = 0,
      "parameters"_a = std::vector<std::pair<std::string, std::string>>{},
      "alignment"_a = std::array<double, 3>{}, "progress"_a = py::none(),
      "Image, standard error and, for `parameters` [(owner, name), ...], the Jacobian.\n\n"
      "depth 0: no limit; threads 0: one per core. Equal seeds give equal bytes whatever the\n"
      "number of threads. frame: (aspect, width, height) where the picture is\n"
      "compared with a photo of so many pixels that was brought to its size by an area filter;\n"
      "aspect is that of all that the camera takes, width / height; 0: no photo. A fourth entry\n"
      "(left, top, right, bottom) is what the picture shows of it, in [0, 1]: a crop. lanes:\n"
      "paths that a thread traces in lockstep, 1 or 8; 0: eight where processor and scene permit.\n"
      "alignment: how the camera moved, in pixels of this picture to the right and down, and by\n"
      "radians about its axis: `shift` in the captures of a fit's result.\n"
      "Raises ValueError, KeyError, Cancelled.");

  m.def("decide_aims", &decide_named, "scene"_a, "camera"_a, "width"_a, "height"_a, py::kw_only(),
        "depth"_a = 0, "threads"_a = 0, "frame"_a = FrameTuple{},
        "parameters"_a = std::vector<std::pair<std::string, std::string>>{},
        "Scene in which it is decided at which lamps paths inside a medium aim: by a pilot, for\n"
        "this picture and these derivatives. `render` decides by itself where that is open.\n"
        "Raises KeyError.");
  m.def("aimed_lamps", &aimed_lamps, "scene"_a, "Objects of the lamps that paths aim at.");
  m.def("with_aimed_lamps", &with_aimed_lamps, "scene"_a, "objects"_a,
        "Scene whose paths aim at these lamps and no others.");

  m.def(
      "lanes_obstacle", [](const Scene& scene) { return lanes_obstacle(scene); }, "scene"_a,
      "What keeps a scene from being traced eight paths at a time; empty if nothing does.");

  m.def(
      "texture_gradient", &texture_gradient, "scene"_a, "camera"_a, "width"_a, "height"_a, "spp"_a,
      "material"_a, py::kw_only(), "reference"_a = py::none(), "weight"_a = py::none(),
      "seed"_a = 0, "depth"_a = 0, "threads"_a = 0, "frame"_a = FrameTuple{},
      "progress"_a = py::none(),
      "(Film, gradient) where an image gives a material's base colour; the rest as `render`.\n\n"
      "gradient: the image's (height, width, 3) float64, row 0 at the top: derivative by each of\n"
      "its numbers, as it holds them (encoded if it is), of the mean squared error against\n"
      "`reference` (height, width, 3), unbiased, or without one of the picture's mean (weighted "
      "by\n"
      "`weight` (height, width), if given), each channel for itself. The film's Jacobian is that "
      "by a shift of the whole (decoded) image.\n"
      "Raises ValueError (no image, one with alpha, a subsurface, weights), KeyError, Cancelled.");

  m.def("environment_gradient", &environment_gradient, "scene"_a, "camera"_a, "width"_a, "height"_a,
        "spp"_a, py::kw_only(), "weight"_a, "seed"_a = 0, "depth"_a = 0, "threads"_a = 0,
        "frame"_a = FrameTuple{},
        "Derivative of the picture's mean, weighted by `weight` (height, width), by each pixel of\n"
        "the world's image, each channel for itself: its (height, width, 3) float64, row 0 at the\n"
        "top. The rest as `render`. Raises ValueError (no image, weights), KeyError, Cancelled.");
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <memory>
#include <utility>

#include "fit/inference/fisher_information.h"
#include "fit/photo/photo_render.h"
#include "fit/problem/fields.h"
#include "module/arrays.h"
#include "module/bindings.h"
#include "module/interruptible.h"
#include "module/named_film.h"
#include "render/driver/field_gradient.h"
#include "render/shape/shape_gradient.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// What photos show of a scene at its values.
struct PhotoScene {
  Scene scene;
  int depth = 0, threads = 0, lanes = 0;

  Sampling sampling(int spp, std::uint64_t seed) const {
    return {spp, seed, depth, threads, lanes};
  }
};

NamedFilm picture(const PhotoScene& self, const Photo& photo, int spp, std::uint64_t seed,
                  const std::vector<ParameterName>& parameters, Progress* progress) {
  NamedFilm out = film_of(self.scene, parameters);
  out.film = interruptible(progress, [&](Progress* watched) {
    return render_photo(self.scene, photo, out.layout, self.sampling(spp, seed), watched);
  });
  return out;
}

PhotoJacobian jacobian(const PhotoScene& self, const Photo& photo,
                       const std::vector<UnknownParameter>& asked, int spp, std::uint64_t seed,
                       Progress* progress) {
  const Unknowns unknowns(self.scene, asked);
  photo.lights.check(self.scene, "Photo '" + photo.id + "'");
  return interruptible(progress, [&](Progress* watched) {
    return photo_jacobian(self.scene, unknowns, photo,
                          render_settings(photo, self.sampling(spp, seed)), watched);
  });
}

double misfit(const PhotoScene& self, Photo photo, int spp, std::uint64_t seed,
              Progress* progress) {
  check_photo(photo);
  return interruptible(progress, [&](Progress* watched) {
    const SlotLayout none;
    return relative_misfit(render_photo(self.scene, photo, none, self.sampling(spp, seed), watched),
                           photo);
  });
}

/// A loss of what the photo shows, by what is rendered of it.
PixelLoss loss_of(const Photo& photo, bool squared) {
  const Colorf gain(photo.values.gain);
  if (!squared) {
    PixelLoss mean = mean_of_pixels(
        photo.weight.empty()
            ? std::vector<float>(static_cast<std::size_t>(photo.width) * photo.height, 1)
            : photo.weight);
    return [mean = std::move(mean), gain](std::size_t pixel, const Film& film) {
      PixelSlope found = mean(pixel, film);
      return PixelSlope{found.slope * gain, found.curvature * gain};
    };
  }
  if (photo.reference.empty())
    throw Refused("gradient", "photo '" + photo.id + "' has no pixels", "give its reference");
  // The loss refers to the picture: both go together.
  auto reference = std::make_shared<Picture>(photo.reference);
  for (Colorf& pixel : *reference) pixel = pixel / gain;
  return [reference, error = squared_error(*reference), square = gain * gain](std::size_t pixel,
                                                                              const Film& film) {
    PixelSlope found = error(pixel, film);
    return PixelSlope{found.slope * square, found.curvature * square};
  };
}

/// By the vertices of an object, in its own space; the channels together.
std::pair<NamedFilm, py::array_t<double>> vertex_gradient(const PhotoScene& self,
                                                          const Photo& photo,
                                                          const std::string& object, int spp,
                                                          bool squared, std::uint64_t seed,
                                                          Progress* progress) {
  const int instance = movable_object(self.scene, object);
  const Geometry& geometry = *self.scene.geometry;
  const Instance& moved = geometry.instances()[instance];
  const VertexNormals normals(geometry.meshes()[moved.mesh]);
  NamedFilm out;
  std::vector<Vec3d> found;
  {
    const py::gil_scoped_release release;
    photo.lights.check(self.scene, "Photo '" + photo.id + "'");
    const PixelLoss loss = loss_of(photo, squared);
    const RenderSettings settings = render_settings(photo, self.sampling(spp, seed));
    ShapeGradient gradient = render_shape_gradient(
        photo.lights.applied_to(self.scene), photo.camera_in(self.scene), instance, normals,
        settings,
        [&](const Film& film) {
          Picture slopes(film.size());
          for (std::size_t pixel = 0; pixel < slopes.size(); ++pixel)
            if (settings.has(pixel)) slopes[pixel] = loss(pixel, film).slope / 3.0f;
          return slopes;
        },
        progress);
    out.film = std::move(gradient.film);
    apply_gain(Colorf(photo.values.gain), out.film);
    found = std::move(gradient.vertices);
  }
  py::array_t<double> by_vertex({std::ssize(found), py::ssize_t{3}});
  for (py::ssize_t v = 0; v < std::ssize(found); ++v)
    for (int axis = 0; axis < 3; ++axis)
      by_vertex.mutable_at(v, axis) =
          dot(found[static_cast<std::size_t>(v)], moved.to_world.column(axis));
  return {std::move(out), std::move(by_vertex)};
}

std::pair<NamedFilm, py::array_t<double>> gradient(const PhotoScene& self, const Photo& photo,
                                                   const std::string& owner,
                                                   const std::string& parameter, int spp,
                                                   const std::string& loss, std::uint64_t seed,
                                                   Progress* progress) {
  if (loss != "mean" && loss != "squared_error")
    throw Refused("gradient", "loss = '" + loss + "' is not mean or squared_error");
  const FittedFieldRef field = field_named(self.scene, owner, parameter);
  const std::optional<FieldRef> by_paths = carried(field);
  if (!by_paths)
    return vertex_gradient(self, photo, owner, spp, loss == "squared_error", seed, progress);
  NamedFilm out;
  if (std::holds_alternative<ImageRef>(field))
    for (int c = 0; c < 3; ++c) {
      out.layout.rows.push_back({0, c, c});
      out.unknowns.emplace_back(owner, parameter, c);
    }
  photo.lights.check(self.scene, "Photo '" + photo.id + "'");
  FieldGradient found = interruptible(progress, [&](Progress* watched) {
    return render_field_gradient(photo.lights.applied_to(self.scene), photo.camera_in(self.scene),
                                 {*by_paths}, render_settings(photo, self.sampling(spp, seed)),
                                 loss_of(photo, loss == "squared_error"), watched);
  });
  out.film = std::move(found.film);
  apply_gain(Colorf(photo.values.gain), out.film);
  auto texels = std::make_unique<std::vector<double>>(std::move(found.fields[0]));
  // The array owns the sums: they are the larger part of a small picture's memory.
  const py::capsule owned(texels.get(),
                          [](void* sums) { delete static_cast<std::vector<double>*>(sums); });
  const double* values = texels.release()->data();
  return {std::move(out), py::array_t<double>(shape_of(self.scene, field), values, owned)};
}

}  // namespace

void bind_evaluator(py::module_& m) {
  py::class_<PhotoScene>(m, "Evaluator", R"(What photos show of a scene at its values: under their
lights, from their cameras as aligned, times their gains.

Args:
    scene: copied; geometry is shared.
    depth, threads, lanes: as for `render`.)")
      .def(py::init([](const Scene& scene, int depth, int threads, int lanes) {
             return PhotoScene{scene, depth, threads, lanes};
           }),
           "scene"_a, py::kw_only(), "depth"_a = 0, "threads"_a = 0, "lanes"_a = 0)
      .def("picture", &picture, "photo"_a, "spp"_a, py::kw_only(), "seed"_a = 0,
           "parameters"_a = std::vector<ParameterName>{}, "progress"_a = py::none(),
           R"(Film of the photo's size, with the Jacobian by `parameters` [(owner, name), ...].

Raises ValueError, KeyError, Cancelled.)")
      .def(
          "jacobian", &jacobian, "photo"_a, "unknowns"_a, "spp"_a, py::kw_only(), "seed"_a = 0,
          "progress"_a = py::none(),
          R"(PhotoJacobian of the unknowns at their starts: in four portions, as a refinement pass of
a fit does; its pixels take no part. Raises ValueError (spp below 8, more than 32 slots), KeyError,
Cancelled.)")
      .def("gradient", &gradient, "photo"_a, "owner"_a, "parameter"_a, "spp"_a, py::kw_only(),
           "loss"_a = "mean", "seed"_a = 0, "progress"_a = py::none(),
           R"((Film, derivative of a loss by each number of an image, (height, width, 3) float64, or
(height, width, 1) of a number, row 0 at the top, as the image holds them, or of a mesh, (n, 3)).

parameter: as "base_color_texture" of a material, "environment" of the world, "vertex_colors" or
"vertex_positions" of an object: of the latter (n, 3), by the coordinates in the object's own space, of the
mean over the channels; the film has no Jacobian. loss: "mean" of the
picture, weighted by the photo's weight, or the unbiased "squared_error" against its pixels, the
mean over them; each channel for itself. The film's Jacobian is that by a shift of the whole
(decoded) image of a material.
Raises ValueError (no image, one with alpha, a subsurface, weights), KeyError, Cancelled.)")
      .def("misfit", &misfit, "photo"_a, "spp"_a, py::kw_only(), "seed"_a = 0,
           "progress"_a = py::none(),
           R"(Mean square of what the photo differs by from a render beyond the render's noise, in
units of its brightness. Raises ValueError, KeyError, Cancelled.)");
}

}  // namespace selenite

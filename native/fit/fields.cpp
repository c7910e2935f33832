// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fields.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "fit/saved_state.h"
#include "math/error.h"

namespace selenite {
namespace {

/// What is wrong with bounds and rate; "" if nothing is.
std::string complaint(const UnknownParameter& one, GridKind kind, const Grid& grid) {
  const bool albedo = kind == GridKind::kAlbedo;
  // The renderer counts in single precision.
  const double most = albedo ? 1 : static_cast<double>(std::numeric_limits<float>::max());
  std::ostringstream text;
  if (!(one.minimum >= 0 && one.minimum < one.maximum && one.maximum <= most))
    text << "bounds [" << one.minimum << ", " << one.maximum << "] are no interval "
         << (albedo ? "inside [0, 1]; give bounds inside"
                    : "of finite numbers from 0 up; give bounds such as [0, 10]");
  else if (!one.start.empty())
    text << "start has " << one.start.size()
         << " values; a grid starts at the values that the scene has: leave start out";
  else if (!(one.learning_rate > 0) || !std::isfinite(one.learning_rate))
    text << "learning_rate = " << one.learning_rate << " must be above 0 and finite; "
         << (albedo ? "0.03 is usual" : "0.03 of a usual density is usual");
  else
    for (const float x : grid.values())
      if (!(x >= one.minimum && x <= one.maximum)) {
        text << "grid '" << grid.name() << "' holds " << x << ", outside its bounds ["
             << one.minimum << ", " << one.maximum << "]; clamp the grid or widen the bounds";
        break;
      }
  return text.str();
}

/// The loss of one pixel, where losses of pixels add up.
PixelSlope slope_of_pixel(const Loss& loss, const Film& film, const Capture& capture,
                          std::size_t pixel) {
  Film one;
  one.width = one.height = 1;
  one.spp = film.spp;
  one.mean = {film.mean[pixel]};
  one.half_a = {film.half_a[pixel]};
  one.variance = {film.variance[pixel]};
  Capture part;
  part.camera = capture.camera;
  part.width = part.height = 1;
  part.reference = {capture.reference[pixel]};
  part.weight = {capture.weight[pixel]};
  part.total_weight = capture.total_weight;
  const LossResult result = loss.evaluate(one, part);
  return {result.slope[0], result.curvature.empty() ? Colorf() : result.curvature[0]};
}

}  // namespace

std::optional<GridKind> Fields::kind_of(const UnknownParameter& one) {
  for (const GridKind kind : {GridKind::kAlbedo, GridKind::kDensity})
    if (one.parameter == grid_name(kind)) return kind;
  return std::nullopt;
}

Fields::Fields(const Scene& scene, const std::vector<UnknownParameter>& wanted) {
  std::string problems;
  bool only_names = true;
  const auto add = [&](const std::string& line, bool name = false) {
    problems += (problems.empty() ? "" : "\n") + line;
    only_names = only_names && name;
  };
  for (const UnknownParameter& one : wanted) {
    const auto kind = kind_of(one);
    if (!kind) continue;
    const std::string name = one.owner + ":" + one.parameter;
    int material = -1;
    try {
      material = scene.material(one.owner);
    } catch (const UnknownName& error) {
      add(error.what(), true);
      continue;
    }
    const GridRef ref{material, *kind};
    const auto& grid = scene.appearance.materials[static_cast<std::size_t>(material)].grid(*kind);
    if (!grid) {
      add(name + ": the material has no such grid; give it one, or fit its " +
          (*kind == GridKind::kAlbedo ? "albedo" : "extinction"));
      continue;
    }
    if (std::find(refs_.begin(), refs_.end(), ref) != refs_.end()) {
      add(name + " is listed twice; list it once");
      continue;
    }
    if (const std::string wrong = complaint(one, *kind, *grid.grid); !wrong.empty()) {
      add(name + ": " + wrong);
      continue;
    }
    refs_.push_back(ref);
    names_.push_back(name);
    wanted_.push_back(one);
    grids_.push_back(grid.grid);
    const auto& values = grid.grid->values();
    start_.push_back(
        Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size()))
            .cast<double>());
  }
  if (problems.empty()) return;
  if (only_names) throw UnknownName(problems);
  throw InvalidArgument(problems);
}

Scene Fields::scene_with(const Scene& scene, const FieldValues& values) const {
  Scene changed = scene;
  for (std::size_t f = 0; f < refs_.size(); ++f) {
    std::vector<float> numbers(static_cast<std::size_t>(values[f].size()));
    Eigen::Map<Eigen::VectorXf>(numbers.data(), values[f].size()) = values[f].cast<float>();
    changed = changed.with_grid(refs_[f], std::move(numbers));
  }
  return changed;
}

std::vector<Color<double>> Fields::means(const FieldValues& values) const {
  std::vector<Color<double>> means;
  for (std::size_t f = 0; f < refs_.size(); ++f) {
    if (grid(f).channels() == 1) {
      means.emplace_back(values[f].mean());
      continue;
    }
    Color<double> mean;
    for (Eigen::Index i = 0; i < values[f].size(); ++i)
      mean[static_cast<int>(i % 3)] += values[f][i];
    means.push_back(mean / static_cast<double>(grid(f).voxels()));
  }
  return means;
}

FieldAdam::FieldAdam(const Fields& fields) : fields_(&fields) {
  for (const Vector& start : fields.start()) moments_.emplace_back(start.size());
}

void FieldAdam::members(SavedState& state) {
  for (AdamMoments& moments : moments_) state(moments);
}

void FieldAdam::step(FieldValues& values, const std::vector<std::vector<double>>& gradients,
                     double rate) {
  for (std::size_t f = 0; f < values.size(); ++f) {
    const Eigen::Map<const Vector> gradient(gradients[f].data(),
                                            static_cast<Eigen::Index>(gradients[f].size()));
    for (Eigen::Index i = 0; i < gradient.size(); ++i)
      if (!std::isfinite(gradient[i]))
        throw std::runtime_error("The derivative with respect to number " + std::to_string(i) +
                                 " of " + fields_->names()[f] +
                                 " is not finite; report this scene");
    const UnknownParameter& one = fields_->wanted()[f];
    const auto same = [&](double x) { return Vector::Constant(gradient.size(), x); };
    values[f] = moments_[f].update(values[f], gradient, same(rate * one.learning_rate),
                                   same(one.minimum), same(one.maximum));
  }
}

FieldGradient loss_field_gradient(const Scene& scene, const Camera& camera, const Fields& fields,
                                  const Capture& capture, const Loss& loss,
                                  const RenderSettings& settings, Progress* progress) {
  const auto render = [&](const PixelLoss& pixel) {
    const std::vector<FieldRef> unknown(fields.refs().begin(), fields.refs().end());
    return render_field_gradient(scene, camera, unknown, settings, pixel, progress);
  };
  if (loss.per_pixel)
    return render([&](std::size_t pixel, const Film& film) {
      return slope_of_pixel(loss, film, capture, pixel);
    });
  const FieldGradient first = render({});
  const LossResult result = loss.evaluate(first.film, capture);
  FieldGradient second = render([&](std::size_t pixel, const Film&) {
    return PixelSlope{result.slope[pixel],
                      result.curvature.empty() ? Colorf() : result.curvature[pixel]};
  });
  second.film.seconds += first.film.seconds;
  second.film.cpu_seconds += first.film.cpu_seconds;
  return second;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/even_grids.h"

#include <algorithm>

namespace selenite {
namespace {

bool is_albedo(const GridRef& ref) { return ref.kind == GridKind::kAlbedo; }

bool is_even(const Vector& voxels, int channels) {
  for (Eigen::Index i = channels; i < voxels.size(); ++i)
    if (voxels[i] != voxels[i % channels]) return false;
  return true;
}

/// `wanted` without fields, then the albedos that stand for grids.
std::vector<UnknownParameter> with_albedos(const std::vector<UnknownParameter>& wanted,
                                           const Fields& fields) {
  std::vector<UnknownParameter> few;
  for (const UnknownParameter& one : wanted)
    if (!Fields::is_field(one)) few.push_back(one);
  for (std::size_t f = 0; f < fields.refs().size(); ++f) {
    if (!is_albedo(fields.refs()[f])) continue;
    UnknownParameter one = fields.wanted()[f];
    one.parameter = "albedo";
    const Vector& start = fields.start()[f];
    for (int c = 0; c < 3; ++c) one.start.push_back(start[c % fields.grid(f).channels()]);
    few.push_back(std::move(one));
  }
  return few;
}

Scene without_grids(Scene scene, const Fields& fields) {
  for (const GridRef& ref : fields.refs())
    if (is_albedo(ref))
      scene.appearance.materials[static_cast<std::size_t>(ref.material)].albedo_grid = {};
  return scene;
}

}  // namespace

std::unique_ptr<EvenGrids> EvenGrids::of(const Scene& scene,
                                         const std::vector<UnknownParameter>& wanted,
                                         const Fields& fields, const std::vector<Capture>& captures,
                                         const Loss& loss, int iterations) {
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (!is_even(fields.start()[f], fields.grid(f).channels())) return nullptr;
  if (std::ranges::none_of(fields.refs(), is_albedo) ||
      std::ranges::all_of(wanted, Fields::is_field))
    return nullptr;
  std::unique_ptr<EvenGrids> even(new EvenGrids(scene, wanted, fields, captures, loss, iterations));
  return even->unknowns_.size() <= kFewUnknowns ? std::move(even) : nullptr;
}

EvenGrids::EvenGrids(Scene scene, const std::vector<UnknownParameter>& wanted, const Fields& fields,
                     const std::vector<Capture>& captures, const Loss& loss, int iterations)
    : scene_(without_grids(std::move(scene), fields)),
      fields_(fields),
      unknowns_(scene_, with_albedos(wanted, fields)),
      scalars_(unknowns_.size() - 3 * std::ranges::count_if(fields.refs(), is_albedo)),
      layout_(scene_, unknowns_.parameters()),
      problem_{unknowns_, layout_, captures, loss, iterations},
      coordinates_(unknowns_) {}

FieldValues EvenGrids::fields(const Vector& x) const {
  FieldValues values = fields_.start();
  Eigen::Index at = scalars_;
  for (std::size_t f = 0; f < values.size(); ++f) {
    if (!is_albedo(fields_.refs()[f])) continue;
    const int channels = fields_.grid(f).channels();
    for (Eigen::Index i = 0; i < values[f].size(); ++i)
      values[f][i] = channels == 3 ? x[at + i % 3] : x.segment<3>(at).mean();
    at += 3;
  }
  return values;
}

}  // namespace selenite

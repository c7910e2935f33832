// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/uniform_fields.h"

#include <algorithm>
#include <variant>

namespace selenite {
namespace {

bool is_uniform(const Vector& values, int channels) {
  for (Eigen::Index i = channels; i < values.size(); ++i)
    if (values[i] != values[i % channels]) return false;
  return true;
}

}  // namespace

Color<double> UniformFields::Colour::stored(const Color<double>& linear) const {
  return image ? Color<double>(image->encode(Colorf(linear))) : linear;
}

Color<double> UniformFields::Colour::linear(const Color<double>& stored) const {
  return image ? Color<double>(image->decode(Colorf(stored))) : stored;
}

std::vector<UniformFields::Colour> UniformFields::colours_of(const Scene& scene,
                                                             const Fields& fields) {
  std::vector<Colour> colours;
  for (std::size_t f = 0; f < fields.refs().size(); ++f) {
    const FieldRef& ref = fields.refs()[f];
    if (const auto* image = std::get_if<ImageRef>(&ref))
      colours.push_back({f, scene.image(*image).texture});
    else if (const auto* grid = std::get_if<GridRef>(&ref); !grid)
      colours.push_back({f, nullptr, true});
    else if (grid->kind == GridKind::kAlbedo)
      colours.push_back({f, nullptr});
  }
  return colours;
}

/// `wanted` without fields, then the colours that stand for them.
std::vector<UnknownParameter> UniformFields::few_of(const std::vector<UnknownParameter>& wanted,
                                                    const Fields& fields,
                                                    const std::vector<Colour>& colours) {
  std::vector<UnknownParameter> few;
  for (const UnknownParameter& one : wanted)
    if (!Fields::is_field(one)) few.push_back(one);
  for (const Colour& colour : colours) {
    UnknownParameter one = fields.wanted()[colour.field];
    if (colour.tints) {
      one.parameter = "color";
      one.start = {1, 1, 1};
      one.minimum = 1 / kTintFactor;
      one.maximum = kTintFactor;
      few.push_back(std::move(one));
      continue;
    }
    one.parameter = colour.image ? "base_color" : "albedo";
    const Vector& values = fields.start()[colour.field];
    const int channels = fields.channels(colour.field);
    Color<double> start;
    for (int c = 0; c < 3; ++c) start[c] = values[c % channels];
    start = colour.linear(start);
    one.start = {start.r, start.g, start.b};
    one.minimum = colour.linear(Color<double>(one.minimum)).r;
    one.maximum = colour.linear(Color<double>(one.maximum)).r;
    few.push_back(std::move(one));
  }
  return few;
}

Scene UniformFields::without(Scene scene, const Fields& fields,
                             const std::vector<Colour>& colours) {
  for (const Colour& colour : colours) {
    const FieldRef& ref = fields.refs()[colour.field];
    if (const auto* image = std::get_if<ImageRef>(&ref)) {
      Material& material = scene.appearance.materials[static_cast<std::size_t>(image->material)];
      material.maps.erase(material.maps.begin() + (&scene.image(*image) - material.maps.data()));
    } else if (const auto* grid = std::get_if<GridRef>(&ref)) {
      scene.appearance.materials[static_cast<std::size_t>(grid->material)].albedo_grid = {};
    }
  }
  return scene;
}

std::unique_ptr<UniformFields> UniformFields::of(const Scene& scene,
                                                 const std::vector<UnknownParameter>& wanted,
                                                 const Fields& fields,
                                                 const std::vector<Photo>& photos, const Loss& loss,
                                                 int iterations) {
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (!fields.is_environment(f) && !is_uniform(fields.start()[f], fields.channels(f)))
      return nullptr;
  if (colours_of(scene, fields).empty() || std::ranges::all_of(wanted, Fields::is_field))
    return nullptr;
  std::unique_ptr<UniformFields> uniform(
      new UniformFields(scene, wanted, fields, photos, loss, iterations));
  return uniform->unknowns_.size() <= kFewUnknowns ? std::move(uniform) : nullptr;
}

UniformFields::UniformFields(const Scene& scene, const std::vector<UnknownParameter>& wanted,
                             const Fields& fields, const std::vector<Photo>& photos,
                             const Loss& loss, int iterations)
    : fields_(fields),
      colours_(colours_of(scene, fields)),
      base_(fields.start()),
      scene_(without(scene, fields, colours_)),
      unknowns_(scene_, few_of(wanted, fields, colours_), photos),
      scalars_(unknowns_.size() - 3 * static_cast<Eigen::Index>(colours_.size())),
      layout_(unknowns_.layout(scene_)),
      problem_{unknowns_, layout_, photos, loss, iterations},
      reparametrization_(unknowns_) {}

void UniformFields::set_light(const FieldValues& fields) {
  for (const Colour& colour : colours_) {
    if (!colour.tints) continue;
    base_[colour.field] = fields[colour.field];
    scene_ = fields_.scene_with_field(scene_, colour.field, base_[colour.field]);
  }
}

FieldValues UniformFields::fields(const Vector& x) const {
  FieldValues values = base_;
  Eigen::Index at = scalars_;
  for (const Colour& colour : colours_) {
    const Color<double> stored = colour.stored({x[at], x[at + 1], x[at + 2]});
    const UnknownParameter& wanted = fields_.wanted()[colour.field];
    const int channels = fields_.channels(colour.field);
    Vector& all = values[colour.field];
    for (Eigen::Index i = 0; i < all.size(); ++i) {
      const double mine =
          channels == 3 ? stored[static_cast<int>(i % 3)] : (stored.r + stored.g + stored.b) / 3;
      all[i] = std::clamp(colour.tints ? all[i] * mine : mine, wanted.minimum,
                          wanted.maximum);  // encoding rounds
    }
    at += 3;
  }
  return values;
}

}  // namespace selenite

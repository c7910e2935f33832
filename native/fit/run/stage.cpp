// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/stage.h"

#include <algorithm>

#include "math/fault.h"

namespace selenite {
namespace {

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// The scalar in whose place a field stands; "": none.
std::string colour_of(const UnknownParameter& field) {
  if (field.parameter == grid_name(GridKind::kAlbedo)) return field.owner + ":albedo";
  const std::string suffix = "_texture";
  if (field.parameter.ends_with(suffix))
    return field.name().substr(0, field.name().size() - suffix.size());
  if (field.parameter == kEnvironment) return field.owner + ":color";
  return "";
}

/// One colour at all places, as the field holds it, inside its bounds.
Vector filled(const Fields& alone, const UnknownParameter& wanted,
              const std::vector<double>& colour) {
  const int channels = alone.channels(0);
  Color<double> linear;
  for (int c = 0; c < 3; ++c) linear[c] = colour[colour.size() == 1 ? 0 : c];
  if (channels == 1) linear = Color<double>((linear.r + linear.g + linear.b) / 3);
  const Texture* image = alone.image(0);
  const Colorf stored = image ? image->encode(Colorf(linear)) : Colorf(linear);
  Vector values(alone.start()[0].size());
  for (Eigen::Index i = 0; i < values.size(); ++i)
    values[i] = std::clamp(stored[static_cast<int>(i % channels)],
                           static_cast<float>(wanted.minimum), static_cast<float>(wanted.maximum));
  return values;
}

}  // namespace

const std::vector<double>& RunPoint::scalar(const std::string& name) const {
  const auto found = std::ranges::find(scalars, name, &decltype(scalars)::value_type::first);
  if (found == scalars.end()) throw NotFound("", "'" + name + "' is not an unknown of this run");
  return found->second;
}

void RunPoint::take(const FitProblem& problem, const Vector& x, const FieldValues& values) {
  const Unknowns& unknowns = problem.unknowns();
  for (auto& [name, numbers] : scalars) {
    const auto found = std::ranges::find(unknowns.names(), name);
    if (found != unknowns.names().end())
      numbers = unknowns.values_of(static_cast<int>(found - unknowns.names().begin()), x);
  }
  const std::vector<std::string>& names = problem.fields().names();
  for (auto& [name, numbers] : fields) {
    const auto found = std::ranges::find(names, name);
    if (found != names.end()) numbers = values[static_cast<std::size_t>(found - names.begin())];
  }
}

RunUnknowns::RunUnknowns(std::vector<UnknownParameter> wanted, const std::vector<Stage>& stages) {
  std::vector<std::string> names;
  for (const UnknownParameter& one : wanted) names.push_back(one.name());
  for (UnknownParameter& one : wanted) {
    if (!Fields::is_field(one)) {
      scalars_.push_back(std::move(one));
      continue;
    }
    Field field{one, nullptr, colour_of(one)};
    if (!has(names, field.colour)) field.colour.clear();
    const auto stage =
        std::ranges::find_if(stages, [&](const Stage& s) { return has(s.fields, one.name()); });
    const Scene& scene = stage == stages.end() ? stages.front().scene : stage->scene;
    field.alone = std::make_shared<const Fields>(scene, std::vector{one});
    fields_.push_back(std::move(field));
  }
}

RunPoint RunUnknowns::start() const {
  RunPoint point = scalars_at_start();
  for (const Field& one : fields_)
    point.fields.emplace_back(one.wanted.name(), one.alone->start()[0]);
  return point;
}

RunPoint RunUnknowns::scalars_at_start() const {
  RunPoint point;
  for (const UnknownParameter& one : scalars_) point.scalars.emplace_back(one.name(), one.start);
  return point;
}

std::vector<std::pair<std::string, Color<double>>> RunUnknowns::means_at_start() const {
  std::vector<std::pair<std::string, Color<double>>> means;
  for (const Field& one : fields_)
    means.emplace_back(one.wanted.name(), one.alone->mean(0, one.alone->start()[0]));
  return means;
}

const RunUnknowns::Field& RunUnknowns::field(const std::string& name) const {
  const auto found =
      std::ranges::find_if(fields_, [&](const Field& f) { return f.wanted.name() == name; });
  if (found == fields_.end()) throw NotFound("", "'" + name + "' is not a field of this run");
  return *found;
}

const std::vector<std::ptrdiff_t>& RunUnknowns::shape(const std::string& name) const {
  return field(name).alone->shape(0);
}

void RunUnknowns::fill_waiting(RunPoint& point, const std::vector<Stage>& stages,
                               std::size_t stage) const {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const Field& one = fields_[f];
    const bool fitted =
        std::any_of(stages.begin(), stages.begin() + static_cast<std::ptrdiff_t>(stage),
                    [&](const Stage& s) { return has(s.parameters, one.wanted.name()); });
    if (!fitted && !one.colour.empty())
      point.fields[f].second = filled(*one.alone, one.wanted, point.scalar(one.colour));
  }
}

Scene RunUnknowns::scene_at(const Stage& stage, const RunPoint& point) const {
  std::vector<std::string> replaced;  // colours in whose place a field stands
  for (const Field& one : fields_)
    if (has(stage.fields, one.wanted.name())) replaced.push_back(one.colour);
  std::vector<std::pair<ParameterRef, std::vector<double>>> values;
  for (const UnknownParameter& one : scalars_)  // those of the stage itself are its fit's
    if (!has(replaced, one.name()) && !has(stage.parameters, one.name()))
      values.emplace_back(stage.scene.find(one.owner, one.parameter), point.scalar(one.name()));
  Scene scene = stage.scene.with(values);
  for (std::size_t f = 0; f < fields_.size(); ++f)
    if (has(stage.fields, fields_[f].wanted.name()))
      scene = fields_[f].alone->scene_with_field(scene, 0, point.fields[f].second);
  return scene;
}

std::vector<UnknownParameter> RunUnknowns::unknowns_at(const Stage& stage,
                                                       const RunPoint& point) const {
  std::vector<UnknownParameter> wanted;
  for (UnknownParameter one : scalars_) {
    if (!has(stage.parameters, one.name())) continue;
    one.start = point.scalar(one.name());
    wanted.push_back(std::move(one));
  }
  for (const Field& one : fields_)
    if (has(stage.parameters, one.wanted.name())) wanted.push_back(one.wanted);
  return wanted;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/unknowns.h"

#include <algorithm>
#include <cmath>

#include "fit/problem/fields.h"
#include "fit/problem/problem_list.h"

namespace selenite {
namespace {

void check_bounds(const std::string& name, const Parameter& table, const UnknownParameter& wanted,
                  ProblemList& problems) {
  const auto bound = [&](const char* what, double value) {
    if (value >= table.lower && value <= table.upper) return true;  // false for NaN
    problems.add(name, ": ", what, " = ", value, " lies outside [", table.lower, ", ", table.upper,
                 "]; give a value inside");
    return false;
  };
  const bool low = bound("minimum", wanted.minimum), high = bound("maximum", wanted.maximum);
  if (low && high && !(wanted.minimum < wanted.maximum)) {
    problems.add(name, ": minimum = ", wanted.minimum, " must be below maximum = ", wanted.maximum,
                 "; widen the bounds or leave the parameter out");
    return;
  }
  if (low && high)
    for (double value : wanted.start)
      if (!(value >= wanted.minimum && value <= wanted.maximum))
        problems.add(name, ": start = ", value, " lies outside its bounds [", wanted.minimum, ", ",
                     wanted.maximum, "]; move the start or widen the bounds");
  if (!(wanted.learning_rate > 0) || !std::isfinite(wanted.learning_rate))
    problems.add(name, ": learning_rate = ", wanted.learning_rate,
                 " must be above 0 and finite; 0.03 is usual");
}

}  // namespace

Unknowns::Unknowns(const Scene& scene, const std::vector<UnknownParameter>& wanted) {
  ProblemList problems;
  if (wanted.empty()) problems.add("Nothing to fit: tick at least one parameter");
  std::vector<double> start, minimum, maximum, rate;
  for (const UnknownParameter& one : wanted) {
    if (Fields::is_field(one)) continue;
    const std::string name = one.owner + ":" + one.parameter;
    ParameterRef ref;
    try {
      ref = scene.find(one.owner, one.parameter);
    } catch (const UnknownName& error) {
      problems.add_name(error.what());
      continue;
    }
    if (std::find(parameters_.begin(), parameters_.end(), ref) != parameters_.end()) {
      problems.add(name, " is listed twice; list it once");
      continue;
    }
    const int width = parameter_widths(ref.kind).at(static_cast<std::size_t>(ref.field));
    if (static_cast<int>(one.start.size()) != width) {
      problems.add(name, ": start has ", one.start.size(), " values; it takes ", width);
      continue;
    }
    check_bounds(name, scene.description(ref), one, problems);
    const int parameter = static_cast<int>(parameters_.size());
    parameters_.push_back(ref);
    descriptions_.push_back(scene.description(ref));
    names_.push_back(name);
    for (int i = 0; i < width; ++i) {
      components_.push_back(
          {parameter, i, width == 1 ? name : name + "[" + std::to_string(i) + "]"});
      start.push_back(one.start[static_cast<std::size_t>(i)]);
      minimum.push_back(one.minimum);
      maximum.push_back(one.maximum);
      rate.push_back(one.learning_rate);
    }
  }
  problems.raise();
  const auto vector = [](const std::vector<double>& v) {
    return Vector(Eigen::Map<const Vector>(v.data(), static_cast<Eigen::Index>(v.size())));
  };
  start_ = vector(start);
  minimum_ = vector(minimum);
  maximum_ = vector(maximum);
  learning_rate_ = vector(rate);
}

const Parameter& Unknowns::description_of(int component) const {
  const int parameter = components_.at(static_cast<std::size_t>(component)).parameter;
  return descriptions_.at(static_cast<std::size_t>(parameter));
}

std::vector<Vector> Unknowns::exchanged(const Vector& x) const {
  std::vector<Vector> found;
  for (int i = 0; i < size(); ++i)
    for (int k = 0; k < size(); ++k) {
      const Component &one = components_[static_cast<std::size_t>(i)],
                      &other = components_[static_cast<std::size_t>(k)];
      const auto owner = [this](const Component& c) {
        return parameters_[static_cast<std::size_t>(c.parameter)];
      };
      const std::string_view twin = description_of(i).twin;
      if (twin.empty() || twin != description_of(k).name || one.index != other.index ||
          !owner(one).same_owner(owner(other)))
        continue;
      Vector y = x;
      std::swap(y[i], y[k]);
      found.push_back(project(y));
    }
  return found;
}

std::vector<double> Unknowns::values_of(int parameter, const Vector& x) const {
  std::vector<double> values;
  for (int k = 0; k < size(); ++k)
    if (components_[static_cast<std::size_t>(k)].parameter == parameter) values.push_back(x[k]);
  return values;
}

Scene Unknowns::scene_with(const Scene& scene, const Vector& x) const {
  std::vector<std::pair<ParameterRef, std::vector<double>>> values;
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    values.emplace_back(parameters_[i], values_of(static_cast<int>(i), x));
  return scene.with(values);
}

}  // namespace selenite

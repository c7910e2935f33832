// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/unknowns.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "fit/problem/fields.h"
#include "math/overloaded.h"
#include "math/problem_list.h"

namespace selenite {
namespace {

void check_bounds(const std::string& name, const Parameter& table, const UnknownParameter& wanted,
                  ProblemList& problems) {
  const auto bound = [&](const char* what, double value) {
    if (value >= table.lower && value <= table.upper) return true;  // false for NaN
    problems.add(
        {name, joined(what, " = ", value, " lies outside [", table.lower, ", ", table.upper, "]"),
         "give a value inside"});
    return false;
  };
  const bool low = bound("minimum", wanted.minimum), high = bound("maximum", wanted.maximum);
  if (low && high && !(wanted.minimum < wanted.maximum)) {
    problems.add({name,
                  joined("minimum = ", wanted.minimum, " must be below maximum = ", wanted.maximum),
                  "widen the bounds or leave the parameter out"});
    return;
  }
  if (low && high)
    for (double value : wanted.start)
      if (!(value >= wanted.minimum && value <= wanted.maximum))
        problems.add({name,
                      joined("start = ", value, " lies outside its bounds [", wanted.minimum, ", ",
                             wanted.maximum, "]"),
                      "move the start or widen the bounds"});
  if (!(wanted.learning_rate > 0) || !std::isfinite(wanted.learning_rate))
    problems.add({name,
                  joined("learning_rate = ", wanted.learning_rate, " must be above 0 and finite"),
                  "0.03 is usual"});
}

/// What is known of a parameter before its bounds.
struct Target {
  UnknownRef ref;
  const Parameter& description;
  int width;
};

/// A name among the parameters of photos is one of a photo, whatever else is named like that photo.
/// UnknownName where there is no such owner or parameter.
Target target_of(const Scene& scene, const std::vector<Photo>& photos,
                 const UnknownParameter& wanted) {
  const ParameterTable& of_photos = photo_parameter_table();
  if (const int field = of_photos.find(wanted.parameter); field >= 0) {
    std::string ids;
    for (const Photo& photo : photos) {
      if (photo.id == wanted.owner) {
        const auto at = static_cast<std::size_t>(field);
        return {PhotoParameterRef{photo.id, field}, of_photos.rows[at], of_photos.widths[at]};
      }
      ids += (ids.empty() ? "'" : ", '") + photo.id + "'";
    }
    throw NotFound("",
                   "'" + wanted.owner + "' is no photo, and '" + wanted.parameter +
                       "' is a parameter of photos",
                   "photos: " + (ids.empty() ? "none" : ids));
  }
  const ParameterRef ref = scene.find(wanted.owner, wanted.parameter);
  return {ref, scene.description(ref), scene.width(ref)};
}

bool of_same_owner(const UnknownRef& one, const UnknownRef& other) {
  return std::visit(
      [](const auto& a, const auto& b) {
        if constexpr (std::is_same_v<decltype(a), decltype(b)>)
          return a.same_owner(b);
        else
          return false;
      },
      one, other);
}

Vector vector_of(const std::vector<double>& v) {
  return Eigen::Map<const Vector>(v.data(), static_cast<Eigen::Index>(v.size()));
}

}  // namespace

std::size_t film_slots(const SlotLayout& layout) {
  int count = 0;
  for (const UnknownRow& row : layout.rows) count = std::max(count, row.slot + 1);
  return static_cast<std::size_t>(count);
}

Unknowns::Unknowns(const Scene& scene, const std::vector<UnknownParameter>& wanted,
                   const std::vector<Photo>& photos) {
  ProblemList problems;
  if (wanted.empty()) problems.add({"Nothing to fit", "tick at least one parameter", ""});
  std::vector<double> start, minimum, maximum, rate;
  for (const UnknownParameter& one : wanted) {
    if (Fields::is_field(one)) continue;
    const std::string name = one.name();
    std::optional<Target> target;
    problems.collect([&] { target.emplace(target_of(scene, photos, one)); });
    if (!target) continue;
    const auto& [ref, description, width] = *target;
    if (std::find(parameters_.begin(), parameters_.end(), ref) != parameters_.end()) {
      problems.add({"", name + " is listed twice", "list it once"});
      continue;
    }
    if (static_cast<int>(one.start.size()) != width) {
      problems.add(
          {name, joined("start has ", one.start.size(), " values"), joined("it takes ", width)});
      continue;
    }
    check_bounds(name, description, one, problems);
    const int parameter = static_cast<int>(parameters_.size());
    parameters_.push_back(ref);
    descriptions_.push_back(description);
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
  start_ = vector_of(start);
  minimum_ = vector_of(minimum);
  maximum_ = vector_of(maximum);
  learning_rate_ = vector_of(rate);
}

const Parameter& Unknowns::description_of(int component) const {
  const int parameter = components_.at(static_cast<std::size_t>(component)).parameter;
  return descriptions_.at(static_cast<std::size_t>(parameter));
}

std::optional<int> Unknowns::component_of(const UnknownRef& ref) const {
  for (int k = 0; k < size(); ++k)
    if (parameters_[static_cast<std::size_t>(components_[static_cast<std::size_t>(k)].parameter)] ==
        ref)
      return k;
  return std::nullopt;
}

std::vector<Vector> Unknowns::exchanged(const Vector& x) const {
  std::vector<Vector> found;
  for (int i = 0; i < size(); ++i)
    for (int k = 0; k < size(); ++k) {
      const Component &one = components_[static_cast<std::size_t>(i)],
                      &other = components_[static_cast<std::size_t>(k)];
      const auto ref = [this](const Component& c) {
        return parameters_[static_cast<std::size_t>(c.parameter)];
      };
      const std::string_view twin = description_of(i).twin;
      if (twin.empty() || twin != description_of(k).name || one.index != other.index ||
          !of_same_owner(ref(one), ref(other)))
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
    std::visit(Overloaded{[&](const ParameterRef& ref) {
                            values.emplace_back(ref, values_of(static_cast<int>(i), x));
                          },
                          [](const PhotoParameterRef&) {}},
               parameters_[i]);
  return scene.with(values);
}

PhotoParameters Unknowns::photo_values(const Photo& photo, const Vector& x) const {
  PhotoParameters values = photo.values;
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    std::visit(Overloaded{[](const ParameterRef&) {},
                          [&](const PhotoParameterRef& ref) {
                            if (ref.photo != photo.id) return;
                            const std::vector<double> numbers = values_of(static_cast<int>(i), x);
                            visit_field(values, ref.field, [&](double* first, int) {
                              std::ranges::copy(numbers, first);
                            });
                          }},
               parameters_[i]);
  return values;
}

SlotLayout Unknowns::layout(const Scene& scene) const {
  std::vector<ParameterRef> of_scene;
  for (const UnknownRef& ref : parameters_)
    std::visit(Overloaded{[&](const ParameterRef& one) { of_scene.push_back(one); },
                          [](const PhotoParameterRef&) {}},
               ref);
  SlotLayout layout(scene, std::move(of_scene));
  const std::vector<UnknownRow> rendered = std::exchange(layout.rows, {});
  auto next = rendered.begin();
  int last = static_cast<int>(layout.slots.size()) - 1;
  for (const Component& component : components_)
    std::visit(
        Overloaded{[&](const ParameterRef&) { layout.rows.push_back(*next++); },
                   [&](const PhotoParameterRef& ref) {
                     // Channel c of a colour acts on channel c of the picture: one slot.
                     const auto field = static_cast<std::size_t>(ref.field);
                     const bool colour = photo_parameter_table().widths[field] == 3;
                     if (component.index == 0) ++last;
                     layout.rows.push_back({last, colour ? component.index : -1, component.index});
                   }},
        parameters_[static_cast<std::size_t>(component.parameter)]);
  return layout;
}

bool Unknowns::is_seen(std::size_t parameter, const Scene& scene, const Photo& photo) const {
  return std::visit(
      Overloaded{[&](const ParameterRef& ref) { return photo.lights.shows(scene, ref); },
                 [&](const PhotoParameterRef& ref) { return ref.photo == photo.id; }},
      parameters_[parameter]);
}

}  // namespace selenite

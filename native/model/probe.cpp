// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/probe.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "math/fault.h"
#include "model/bsdf.h"

namespace selenite {
namespace {

/// Parameters differentiated at once. More would make every operation wider, fewer the common part
/// run more often.
constexpr int kSlots = 8;
template <class S>
using Slopes = Dual<S, kSlots>;
/// Directions are read from text of a few digits.
constexpr double kUnitTolerance = 1e-3;
/// Blender's sockets do not limit a colour; the lobes clamp where those of Cycles do.
constexpr double kBrightest = 1e6;

template <class T, class S = scalar_t<T>>
Color<T> value(const Principled<T>& material, const Flavour& flavour, const Vec3<S>& wi,
               const Vec3<S>& wo) {
  const bool behind = wi.z < 0;
  const Vec3<S> normal{0, 0, behind ? S(-1) : S(1)};
  const SurfacePoint<S> point{normal, normal, normalize(wi), behind};
  return PrincipledBsdf<T>(material, flavour, point).value(normalize(wo));
}

/// A material and two directions, addressed by column.
template <class T>
struct Line {
  using S = scalar_t<T>;
  Principled<T> material;
  Vec3<S> direction[2]{{0, 0, 1}, {0, 0, 1}};

  Line() {
    Principled<T>::fields(material, [&](const Parameter&, auto& member) {
      if constexpr (requires { member.r; }) {
        scalars_.push_back({&member.r, &member.g, &member.b});
      } else {
        scalars_.push_back({&member});
      }
    });
  }
  Line(const Line&) = delete;  // it points into itself
  Line& operator=(const Line&) = delete;

  template <class Set>
  void each(const ProbeColumn& column, const Set& set) {
    const auto& scalars = scalars_[column.field];
    if (column.channel >= 0) {
      set(*scalars[column.channel]);
    } else {
      for (T* scalar : scalars) set(*scalar);
    }
  }
  void read(const std::vector<ProbeColumn>& columns, const double* numbers) {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (columns[k].parameter) {
        const T socket(static_cast<S>(static_cast<float>(numbers[k])));
        each(columns[k], [&](T& scalar) { scalar = socket; });
      } else {
        Vec3<S>& v = direction[columns[k].field];
        S* const axis[] = {&v.x, &v.y, &v.z};
        *axis[columns[k].channel] = static_cast<S>(numbers[k]);
      }
    }
    for (const Vec3<S>& v : direction)
      if (!(std::abs(length(v) - 1) <= kUnitTolerance))
        throw Refused("Probes",
                      "a direction has the length " + std::to_string(length(v)) + ", not 1");
    if (direction[0].z == 0) throw Refused("Probes", "wi lies in the surface");
  }

 private:
  std::vector<std::vector<T*>> scalars_;
};

}  // namespace

Color<double> probe(const Probe& row) { return value(row.material, row.flavour, row.wi, row.wo); }

std::vector<ProbeColumn> probe_columns(Flavour::Version version) {
  const bool version1 = version == Flavour::Version::kV1;
  std::vector<ProbeColumn> columns;
  int field = -1;
  const Principled<double> material;
  Principled<double>::fields(material, [&](const Parameter& p, const auto& member) {
    ++field;
    // What a walk under the surface sends back is no function of the two directions.
    if (p.effect != Effect::kSurface || p.name.starts_with("subsurface")) return;
    if (p.versions == (version1 ? Versions::k2 : Versions::k1)) return;
    std::string name(p.name);
    if (name == "base_color") name = "base";
    if (version1 && name == "specular_level") name = "specular";
    const bool required = !(version1 && name == "alpha");
    const auto add = [&](const std::string& suffix, int channel) {
      constexpr bool colour = requires { member.r; };
      const double upper = colour ? kBrightest : p.upper;
      columns.push_back({name + suffix, p.lower, upper, required, true, field, channel});
    };
    if constexpr (requires { member.r; }) {
      if (version1 && name == "specular_tint") {
        add("", -1);
      } else {
        for (int c = 0; c < 3; ++c) add(std::string("_") + "rgb"[c], c);
      }
    } else {
      add("", -1);
    }
  });
  for (int k = 0; k < 2; ++k)
    for (int c = 0; c < 3; ++c)
      columns.push_back({std::string(k == 0 ? "wi_" : "wo_") + "xyz"[c], -1 - kUnitTolerance,
                         1 + kUnitTolerance, true, false, k, c});
  return columns;
}

ProbeTable::ProbeTable(Flavour::Version version, const std::vector<std::string>& columns)
    : version_(version) {
  const auto known = probe_columns(version);
  for (const std::string& name : columns) {
    const auto found =
        std::find_if(known.begin(), known.end(), [&](const auto& c) { return c.name == name; });
    if (found == known.end())
      throw NotFound("Probes", "'" + name + "' is no column of numbers of this version");
    columns_.push_back(*found);
    parameters_ += found->parameter;
  }
}

Flavour ProbeTable::flavour(std::uint8_t multi_ggx) const {
  return {
      .distribution = multi_ggx ? Flavour::Distribution::kMultiGgx : Flavour::Distribution::kGgx,
      .version = version_};
}

void ProbeTable::check(const double* numbers, std::size_t line) const {
  for (std::size_t k = 0; k < columns_.size(); ++k)
    if (!(numbers[k] >= columns_[k].lower && numbers[k] <= columns_[k].upper))  // NaN as well
      throw Refused("Probes", "line " + std::to_string(line) + ": " + columns_[k].name + " = " +
                                  std::to_string(numbers[k]) + " lies outside [" +
                                  std::to_string(columns_[k].lower) + ", " +
                                  std::to_string(columns_[k].upper) + "]");
}

template <class S>
void ProbeTable::evaluate_in(const double* numbers, const std::uint8_t* multi_ggx,
                             std::size_t lines, double* f_cos) const {
  Line<S> line;
  for (std::size_t i = 0; i < lines; ++i, numbers += columns_.size(), f_cos += 3) {
    check(numbers, i);
    line.read(columns_, numbers);
    const auto f =
        value(line.material, flavour(multi_ggx[i]), line.direction[0], line.direction[1]);
    for (int c = 0; c < 3; ++c) f_cos[c] = f[c];
  }
}

template <class S>
void ProbeTable::differentiate_in(const double* numbers, const std::uint8_t* multi_ggx,
                                  std::size_t lines, double* slopes) const {
  std::vector<const ProbeColumn*> parameters;
  for (const ProbeColumn& column : columns_)
    if (column.parameter) parameters.push_back(&column);
  Line<Slopes<S>> line;
  for (std::size_t i = 0; i < lines; ++i, numbers += columns_.size()) {
    check(numbers, i);
    for (std::size_t first = 0; first < parameters.size(); first += kSlots) {
      const std::size_t count = std::min<std::size_t>(kSlots, parameters.size() - first);
      line.read(columns_, numbers);
      for (std::size_t k = 0; k < count; ++k)
        line.each(*parameters[first + k], [&](Slopes<S>& scalar) { scalar.d[k] = 1; });
      const auto f =
          value(line.material, flavour(multi_ggx[i]), line.direction[0], line.direction[1]);
      for (int c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < count; ++k)
          slopes[(3 * i + c) * parameters_ + first + k] = f[c].d[k];
    }
  }
}

void ProbeTable::evaluate(const double* numbers, const std::uint8_t* multi_ggx, std::size_t lines,
                          double* f_cos, Precision precision) const {
  if (precision == Precision::kSingle) return evaluate_in<float>(numbers, multi_ggx, lines, f_cos);
  evaluate_in<double>(numbers, multi_ggx, lines, f_cos);
}

void ProbeTable::differentiate(const double* numbers, const std::uint8_t* multi_ggx,
                               std::size_t lines, double* slopes, Precision precision) const {
  if (precision == Precision::kSingle)
    return differentiate_in<float>(numbers, multi_ggx, lines, slopes);
  differentiate_in<double>(numbers, multi_ggx, lines, slopes);
}

}  // namespace selenite

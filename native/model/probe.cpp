// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/probe.h"

#include <stdexcept>

#include "model/bsdf.h"

namespace selenite {
namespace {

using Slope = Dual<double, 1>;

template <class T>
Color<T> value(const Principled<T>& material, const Probe& row) {
  const bool behind = row.wi.z < 0;
  const Vec3d normal{0, 0, behind ? -1. : 1.};
  const SurfacePoint<double> point{normal, normal, normalize(row.wi), behind};
  return PrincipledBsdf<T>(material, row.flavour, point).value(normalize(row.wo));
}

double parse(std::string_view column, const std::string& text) {
  try {
    std::size_t used = 0;
    const double x = std::stod(text, &used);
    if (used == text.size()) return x;
  } catch (const std::exception&) {  // reported below, with the name of the column
  }
  throw std::invalid_argument("column " + std::string(column) + ": '" + text + "' is not a number");
}

int channel(std::string_view suffix) {
  return suffix == "_r" ? 0 : suffix == "_g" ? 1 : suffix == "_b" ? 2 : -1;
}

}  // namespace

bool Probe::set(std::string_view column, const std::string& text) {
  if (column == "distribution") {
    if (text != "GGX" && text != "MULTI_GGX")
      throw std::invalid_argument("column distribution: '" + text +
                                  "' is neither GGX nor MULTI_GGX");
    flavour.distribution =
        text == "GGX" ? Flavour::Distribution::kGgx : Flavour::Distribution::kMultiGgx;
    return true;
  }
  if (column == "sheen_weight" || column == "transmission_roughness") {
    if (parse(column, text) != 0)
      throw std::invalid_argument("column " + std::string(column) + ": " + text +
                                  ", but it is not modelled; permitted is 0");
    return true;
  }
  if (column == "specular") {  // the socket of Blender 3.x
    flavour.version = Flavour::Version::kV1;
    material.specular_level = static_cast<float>(parse(column, text));
    return true;
  }
  if (column == "specular_tint") {  // a number there
    material.specular_tint = Color<double>(static_cast<float>(parse(column, text)));
    return true;
  }
  if (column.size() == 4 && column[0] == 'w' && (column[1] == 'i' || column[1] == 'o') &&
      column[2] == '_') {
    Vec3d& v = column[1] == 'i' ? wi : wo;
    (column[3] == 'x' ? v.x : column[3] == 'y' ? v.y : v.z) = parse(column, text);
    return true;
  }
  const bool long_enough = column.size() > 2;
  const int c = long_enough ? channel(column.substr(column.size() - 2)) : -1;
  std::string_view name = c < 0 ? column : column.substr(0, column.size() - 2);
  if (c >= 0 && name == "base") name = "base_color";
  bool found = false;
  Principled<double>::fields(material, [&](const Parameter& p, auto& member) {
    if (p.name != name) return;
    if constexpr (requires { member.r; }) {
      if (c < 0) return;
      member[c] = static_cast<float>(parse(column, text));
      found = true;
    } else {
      if (c >= 0) return;
      member = static_cast<float>(parse(column, text));
      found = true;
    }
  });
  return found;
}

Color<double> probe(const Probe& row) { return value(row.material, row); }

std::vector<ProbeSlope> probe_slopes(const Probe& row) {
  std::vector<ProbeSlope> slopes;
  const auto moved = lift<Slope>(row.material);
  int count = 0;
  Principled<Slope>::fields(moved, [&](const Parameter&, const auto&) { ++count; });
  for (int k = 0; k < count; ++k) {
    const auto differentiate = [&](int first, int last, const std::string& suffix) {
      auto material = moved;
      int index = 0;
      std::string name;
      Principled<Slope>::fields(material, [&](const Parameter& p, auto& member) {
        if (index++ != k) return;
        name = std::string(p.name) + suffix;
        if constexpr (requires { member.r; }) {
          for (int c = first; c < last; ++c) member[c].d[0] = 1;
        } else {
          member.d[0] = 1;
        }
      });
      const Color<Slope> f = value(material, row);
      slopes.push_back({name, {f.r.d[0], f.g.d[0], f.b.d[0]}});
    };
    int index = 0;
    Principled<Slope>::fields(moved, [&](const Parameter& p, const auto&) {
      if (index++ != k) return;
      if (p.diagonal) {
        differentiate(0, 3, "");
      } else {
        for (int c = 0; c < 3; ++c) differentiate(c, c + 1, std::string("_") + "rgb"[c]);
      }
    });
  }
  return slopes;
}

}  // namespace selenite

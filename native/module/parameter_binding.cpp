// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "module/bindings.h"
#include "scene/scene_builder.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

py::list parameters() {
  py::list out;
  const std::pair<OwnerKind, const char*> owners[] = {{OwnerKind::kMaterial, "material"},
                                                      {OwnerKind::kLight, "light"},
                                                      {OwnerKind::kWorld, "world"}};
  for (const auto& [kind, owner] : owners) {
    const auto& table = parameter_table(kind);
    for (std::size_t i = 0; i < table.size(); ++i) {
      py::dict row = parameter_row(table[i]);
      row["owner"] = owner;
      row["width"] = parameter_widths(kind)[i];
      out.append(row);
    }
  }
  return out;
}

/// Of each kind of closure, by name.
py::dict closure_rows() {
  py::dict out;
  for (std::size_t kind = 0; kind < kClosureNames.size(); ++kind) {
    py::list rows;
    auto closure = default_closure<double>(static_cast<ClosureKind>(kind));
    struct Collect {
      py::list& rows;
      void add(const Parameter& p, int width) const {
        py::dict row = parameter_row(p);
        row["owner"] = "material";
        row["width"] = width;
        rows.append(row);
      }
      void operator()(const Parameter& p, double&) const { add(p, 1); }
      void operator()(const Parameter& p, Color<double>&) const { add(p, 3); }
    };
    closure_fields(closure, Collect{rows});
    out[py::str(std::string(kClosureNames[kind]))] = rows;
  }
  return out;
}

}  // namespace

py::dict parameter_row(const Parameter& p) {
  py::list sockets;
  for (std::string_view rest = p.sockets; !rest.empty();) {
    const auto bar = rest.find('|');
    sockets.append(std::string(rest.substr(0, bar)));
    rest = bar == std::string_view::npos ? std::string_view{} : rest.substr(bar + 1);
  }
  static constexpr const char* kScales[] = {"linear",    "log",         "log_excess",
                                            "roughness", "reflectance", "angle"};
  static const std::vector<std::string> kVersions[] = {{"v1", "v2"}, {"v1"}, {"v2"}};
  static constexpr const char* kEffects[] = {"surface", "emission", "volume", "visibility"};
  return py::dict("name"_a = std::string(p.name), "sockets"_a = sockets,
                  "unit"_a = std::string(p.unit), "lower"_a = p.lower, "upper"_a = p.upper,
                  "fit_lower"_a = p.fit_lower, "fit_upper"_a = p.fit_upper, "initial"_a = p.initial,
                  "scale"_a = kScales[static_cast<int>(p.scale)],
                  "effect"_a = kEffects[static_cast<int>(p.effect)],
                  "versions"_a = kVersions[static_cast<int>(p.versions)],
                  "help"_a = std::string(p.help));
}

void bind_parameters(py::module_& m) {
  m.def("parameters", &parameters,
        "The table of every parameter that can be fitted: owner kind, name, Blender sockets, unit, "
        "width, permitted range, default range of a fit, default value, scale, effect, "
        "versions of the Principled BSDF that have it, help.");
  m.def("closures", &closure_rows,
        "The parameters of each kind of closure, by the closure's name, in the form of "
        "`parameters`.");
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "model/probe.h"
#include "module/arrays.h"
#include "module/bindings.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

Flavour::Version version_of(const std::string& name) {
  if (name == "v1") return Flavour::Version::kV1;
  if (name == "v2") return Flavour::Version::kV2;
  throw Refused("Probes", "version '" + name + "' is neither v1 nor v2");
}

Precision precision_of(const std::string& name) {
  if (name == "single") return Precision::kSingle;
  if (name == "double") return Precision::kDouble;
  throw Refused("Probes", "precision '" + name + "' is neither single nor double");
}

py::list columns(const std::string& version) {
  py::list out;
  for (const ProbeColumn& c : probe_columns(version_of(version)))
    out.append(py::dict("name"_a = c.name, "lower"_a = c.lower, "upper"_a = c.upper,
                        "required"_a = c.required, "parameter"_a = c.parameter));
  return out;
}

py::array_t<double> evaluate(const std::string& version, const std::vector<std::string>& columns,
                             const Array<double>& numbers, const Array<bool>& multi_ggx,
                             const std::string& precision, bool derivatives) {
  const ProbeTable table(version_of(version), columns);
  const auto width = static_cast<py::ssize_t>(columns.size());
  require_shape(numbers, "Probes: numbers", {-1, width});
  const py::ssize_t lines = numbers.shape(0);
  require_shape(multi_ggx, "Probes: multi_ggx", {lines});
  std::vector<py::ssize_t> shape{lines, 3};
  if (derivatives) shape.push_back(static_cast<py::ssize_t>(table.parameters()));
  py::array_t<double> out(shape);
  const std::vector<std::uint8_t> distributions(multi_ggx.data(), multi_ggx.data() + lines);
  const Precision scalars = precision_of(precision);
  const auto run = derivatives ? &ProbeTable::differentiate : &ProbeTable::evaluate;
  const double* from = numbers.data();
  double* to = out.mutable_data();
  const py::gil_scoped_release release;
  (table.*run)(from, distributions.data(), static_cast<std::size_t>(lines), to, scalars);
  return out;
}

}  // namespace

void bind_probe(py::module_& m) {
  m.def("probe_columns", &columns, "version"_a,
        R"(Columns of numbers that a table of BSDF values may have.

Args:
    version: of the Principled BSDF: "v1" (Blender 3.x) or "v2".
Returns:
    dicts of name, lower, upper (permitted values), required (else the node's default stands in)
    and parameter (False for the components of wi and wo).)");
  m.def(
      "probe",
      [](const std::string& version, const std::vector<std::string>& columns,
         const Array<double>& numbers, const Array<bool>& multi_ggx, const std::string& precision) {
        return evaluate(version, columns, numbers, multi_ggx, precision, false);
      },
      "version"_a, "columns"_a, "numbers"_a, "multi_ggx"_a, py::kw_only(), "precision"_a = "double",
      R"(Values of the Principled BSDF times the cosine of the light, 1/sr.

Args:
    version: "v1" or "v2".
    columns: what each column of `numbers` is, by the names of probe_columns().
    numbers: (n, k) parameters (rounded to 32 bits here) and unit directions wi (to the viewer) and
        wo (to the light), both in the frame whose z is the outside normal.
    multi_ggx: (n,) the distribution is Multiscatter GGX, not GGX.
    precision: scalars of the evaluation, "double", or "single" as in the path tracer.
Returns:
    (n, 3) f |cos wo|, linear Rec. 709.
Raises:
    ValueError: a shape, or a number that is not permitted.
    KeyError: a column that the version does not have.)");
  m.def(
      "probe_slopes",
      [](const std::string& version, const std::vector<std::string>& columns,
         const Array<double>& numbers, const Array<bool>& multi_ggx, const std::string& precision) {
        return evaluate(version, columns, numbers, multi_ggx, precision, true);
      },
      "version"_a, "columns"_a, "numbers"_a, "multi_ggx"_a, py::kw_only(), "precision"_a = "double",
      R"(Derivatives of what probe() returns, by each parameter among `columns`, in their order.

Returns:
    (n, 3, p). Arguments and errors are those of probe().)");
}

}  // namespace selenite

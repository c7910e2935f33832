// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "math/fault.h"

namespace selenite {

/// Text that may hold a file's name, with bytes that are no UTF-8 as Python holds them.
inline pybind11::object text_with_paths(const std::string& text) {
  return pybind11::reinterpret_steal<pybind11::object>(PyUnicode_DecodeFSDefault(text.c_str()));
}

/// `Fault` as the `Problem` of a module; each of the two has its own.
inline void bind_problem(pybind11::module_& m) {
  namespace py = pybind11;
  py::class_<Fault>(m, "Problem", py::module_local(),
                    "One entry of `problems` of a ValueError, KeyError or OSError that this "
                    "module raises. object: \"\" where the caller knows it; cure: \"\" where it "
                    "follows from the cause.")
      .def_property_readonly("object", [](const Fault& p) { return text_with_paths(p.object); })
      .def_property_readonly("cause", [](const Fault& p) { return text_with_paths(p.cause); })
      .def_property_readonly("cure", [](const Fault& p) { return text_with_paths(p.cure); });
}

/// Sets an exception of Python with `problems` on it.
inline void set_error(PyObject* type, const char* text, const std::vector<Fault>& faults) {
  namespace py = pybind11;
  const py::object error = py::reinterpret_borrow<py::object>(type)(text_with_paths(text));
  py::list found;
  for (const Fault& fault : faults) found.append(py::cast(fault));
  error.attr("problems") = found;
  PyErr_SetObject(type, error.ptr());
}

}  // namespace selenite

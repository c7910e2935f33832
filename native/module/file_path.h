// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace selenite {

/// A file's name as the system has it, which need not be UTF-8: str, bytes or a Path of Python.
struct FilePath {
  std::string text;
};
}  // namespace selenite

namespace pybind11::detail {

template <>
struct type_caster<selenite::FilePath> {
  PYBIND11_TYPE_CASTER(selenite::FilePath, const_name("str | os.PathLike"));
  bool load(handle from, bool /*convert*/) {
    PyObject* bytes = nullptr;
    if (PyUnicode_FSConverter(from.ptr(), &bytes) == 0) {
      PyErr_Clear();
      return false;
    }
    value.text = reinterpret_steal<pybind11::bytes>(bytes);
    return true;
  }
};

}  // namespace pybind11::detail

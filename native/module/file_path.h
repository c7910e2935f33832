// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace selenite {

/// A file's name as the system has it, which need not be UTF-8: str, bytes or a Path of Python.
struct FilePath {
  std::string text;
};

/// The text of an exception, which may hold such a name.
inline void raise_os_error(const char* text) {
  const pybind11::object words =
      pybind11::reinterpret_steal<pybind11::object>(PyUnicode_DecodeFSDefault(text));
  PyErr_SetObject(PyExc_OSError, words.ptr());
}

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

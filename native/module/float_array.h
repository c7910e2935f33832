// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>

#include <string>
#include <utility>
#include <vector>

namespace selenite {

using FloatArray = pybind11::array_t<float, pybind11::array::c_style | pybind11::array::forcecast>;

inline std::string shape_text(const pybind11::array& array) {
  std::string text = "(";
  for (pybind11::ssize_t i = 0; i < array.ndim(); ++i)
    text += (i ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

/// A numpy float32 array in C order (copied only if strided); ValueError says what `name` is
/// instead. No silent conversion of the type: uint8 pixels taken for radiance are 255 times too
/// bright.
inline FloatArray float_array(const pybind11::handle& object, const std::string& name) {
  namespace py = pybind11;
  if (!py::isinstance<py::array>(object))
    throw py::value_error(name + " must be a numpy array of float32, not " +
                          std::string(py::str(py::type::handle_of(object).attr("__name__"))));
  const auto array = py::reinterpret_borrow<py::array>(object);
  if (array.dtype().kind() != 'f' || array.dtype().itemsize() != 4)
    throw py::value_error(name + " has dtype " + std::string(py::str(array.dtype())) +
                          "; it must be float32 (use .astype(numpy.float32))");
  return FloatArray::ensure(array);
}

/// Hands a vector over to numpy without copying it.
template <class T>
pybind11::array_t<T> to_array(std::vector<T>&& values, std::vector<pybind11::ssize_t> shape) {
  auto* owner = new std::vector<T>(std::move(values));
  const pybind11::capsule keep(owner, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return pybind11::array_t<T>(std::move(shape), owner->data(), keep);
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>

#include <cstring>
#include <string>
#include <vector>

#include "math/color.h"
#include "math/fault.h"
#include "math/vec.h"
#include "scene/transform.h"

// Numpy arrays in and out: shapes are checked with the name of what they hold, data is copied.
namespace selenite {

template <class T>
using Array = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

template <class T>
void require_shape(const Array<T>& a, const std::string& what,
                   std::vector<pybind11::ssize_t> shape) {
  bool good = a.ndim() == static_cast<pybind11::ssize_t>(shape.size());
  for (std::size_t i = 0; good && i < shape.size(); ++i)
    good = shape[i] < 0 || a.shape(static_cast<pybind11::ssize_t>(i)) == shape[i];
  if (good) return;
  const auto text = [](auto begin, auto end) {
    std::string s = "(";
    for (auto it = begin; it != end; ++it)
      s += (it == begin ? "" : ", ") + (*it < 0 ? "n" : std::to_string(*it));
    return s + ")";
  };
  throw Refused(what, "shape " + text(a.shape(), a.shape() + a.ndim()) + " given, " +
                          text(shape.begin(), shape.end()) + " needed");
}

/// Rows of an (n, k) array as n values of a plain struct of k scalars.
template <class Out, class T>
std::vector<Out> rows(const Array<T>& a, const std::string& what) {
  constexpr auto k = static_cast<pybind11::ssize_t>(sizeof(Out) / sizeof(T));
  static_assert(sizeof(Out) == k * sizeof(T));
  require_shape(a, what, {-1, k});
  std::vector<Out> out(static_cast<std::size_t>(a.shape(0)));
  if (!out.empty()) std::memcpy(static_cast<void*>(out.data()), a.data(), out.size() * sizeof(Out));
  return out;
}

/// The colours of an (..., 3) array, whose shape has been checked.
inline std::vector<Colorf> colors_of(const Array<float>& a) {
  static_assert(sizeof(Colorf) == 3 * sizeof(float));
  std::vector<Colorf> out(static_cast<std::size_t>(a.size()) / 3);
  std::memcpy(static_cast<void*>(out.data()), a.data(), out.size() * sizeof(Colorf));
  return out;
}

inline Color<double> color_of(const Array<double>& a, const std::string& what) {
  require_shape(a, what, {3});
  return {a.at(0), a.at(1), a.at(2)};
}

inline Transform transform_of(const Array<double>& a, const std::string& what) {
  require_shape(a, what, {4, 4});
  Transform t;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      t.m[i][j] = a.at(i, j);
      if (!std::isfinite(t.m[i][j])) throw Refused(what, "an entry is not a finite number");
    }
  return t;
}

/// (height, width, 3) from a picture.
inline pybind11::array_t<float> picture_array(const std::vector<Colorf>& picture, int width,
                                              int height) {
  pybind11::array_t<float> out({height, width, 3});
  std::memcpy(out.mutable_data(), picture.data(), picture.size() * sizeof(Colorf));
  return out;
}

}  // namespace selenite

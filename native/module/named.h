// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace selenite {

namespace py = pybind11;

/// A dict of named values: an unknown key is an error, so that a misspelt one is not ignored.
class Named {
 public:
  Named(const py::handle& object, std::string what, std::vector<const char*> keys)
      : what_(std::move(what)), keys_(std::move(keys)) {
    if (!py::isinstance<py::dict>(object)) throw py::value_error(what_ + " must be a dict");
    values_ = py::reinterpret_borrow<py::dict>(object);
    for (const auto& [key, value] : values_) {
      const std::string name = py::str(key);
      if (std::find(keys_.begin(), keys_.end(), name) == keys_.end())
        throw py::value_error(what_ + ": key '" + name + "' is unknown; the keys are " + listed());
    }
  }
  bool has(const char* key) const { return values_.contains(key) && !values_[key].is_none(); }
  py::object get(const char* key) const {
    if (!has(key))
      throw py::value_error(what_ + ": '" + key + "' is missing; the keys are " + listed());
    return values_[key];
  }
  template <class T>
  T as(const char* key) const {
    try {
      return get(key).cast<T>();
    } catch (const py::cast_error&) {
      throw py::value_error(what_ + ": " + key + " = " + std::string(py::repr(values_[key])) +
                            " has the wrong type or is out of range");
    }
  }
  template <class T>
  void take(const char* key, T& value) const {
    if (has(key)) value = as<T>(key);
  }

 private:
  std::string listed() const {
    std::string text;
    for (const char* key : keys_) text += (text.empty() ? "" : ", ") + std::string(key);
    return text;
  }
  std::string what_;
  std::vector<const char*> keys_;
  py::dict values_;
};

}  // namespace selenite

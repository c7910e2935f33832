// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sstream>
#include <string>

#include "math/error.h"

namespace selenite {

/// Everything that is wrong with an input, a line each: users mend all of it in one go.
class ProblemList {
 public:
  template <class... Parts>
  void add(const Parts&... parts) {
    only_names_ = false;
    append(parts...);
  }
  /// A name that does not exist.
  void add_name(const std::string& message) { append(message); }
  /// Calls `check` and takes the problems that it raises.
  template <class Check>
  void collect(Check&& check) {
    try {
      check();
    } catch (const UnknownName& error) {
      add_name(error.what());
    } catch (const InvalidArgument& error) {
      add(error.what());
    }
  }
  bool empty() const { return text_.str().empty(); }
  /// Throws InvalidArgument, or UnknownName when names that do not exist are the only problem.
  void raise() const {
    if (empty()) return;
    if (only_names_) throw UnknownName(text_.str());
    throw InvalidArgument(text_.str());
  }

 private:
  template <class... Parts>
  void append(const Parts&... parts) {
    if (!empty()) text_ << '\n';
    (text_ << ... << parts);
  }
  std::ostringstream text_;
  bool only_names_ = true;
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "math/fault.h"

namespace selenite {

/// Texts and numbers, one after the other.
template <class... Parts>
std::string joined(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

/// Everything that is wrong with an input: users mend all of it in one go.
class ProblemList {
 public:
  void add(Fault fault) {
    only_names_ = false;
    faults_.push_back(std::move(fault));
  }
  /// Calls `check` and takes the problems that it raises.
  template <class Check>
  void collect(Check&& check) {
    try {
      check();
    } catch (const NotFound& error) {
      append(error.faults());
    } catch (const Refused& error) {
      only_names_ = false;
      append(error.faults());
    }
  }
  /// Throws Refused, or NotFound when names that do not exist are the only problem.
  void raise() const {
    if (faults_.empty()) return;
    if (only_names_) throw NotFound(faults_);
    throw Refused(faults_);
  }

 private:
  void append(const std::vector<Fault>& more) {
    faults_.insert(faults_.end(), more.begin(), more.end());
  }
  std::vector<Fault> faults_;
  bool only_names_ = true;
};

}  // namespace selenite

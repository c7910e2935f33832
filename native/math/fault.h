// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "math/error.h"

namespace selenite {

/// One thing that is wrong with an input: of which object, why, and what its user can do about it.
/// object: "" where the caller knows it; cure: "" where it follows from the cause.
struct Fault {
  std::string object, cause, cure;

  /// "object: cause; cure", without the parts that are empty.
  std::string line() const {
    return (object.empty() ? "" : object + ": ") + cause + (cure.empty() ? "" : "; " + cure);
  }
  /// The same fault, as one of `whole`, of which the object is a part.
  Fault within(const std::string& whole) const {
    if (whole.empty()) return *this;
    return {whole, (object.empty() ? "" : object + ": ") + cause, cure};
  }
};

/// A line for each.
inline std::string text_of(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) text += (text.empty() ? "" : "\n") + fault.line();
  return text;
}

/// An error with everything that is wrong with an input.
template <class Error>
class WithFaults : public Error {
 public:
  explicit WithFaults(std::vector<Fault> faults)
      : Error(text_of(faults)),
        faults_(std::make_shared<const std::vector<Fault>>(std::move(faults))) {}
  WithFaults(std::string object, std::string cause, std::string cure = {})
      : WithFaults(std::vector<Fault>{{std::move(object), std::move(cause), std::move(cure)}}) {}
  const std::vector<Fault>& faults() const { return *faults_; }

 private:
  std::shared_ptr<const std::vector<Fault>> faults_;  // an error is copied without throwing
};

/// An input that is refused.
struct Refused : WithFaults<InvalidArgument> {
  using WithFaults::WithFaults;
};
/// A name that is not there.
struct NotFound : WithFaults<UnknownName> {
  using WithFaults::WithFaults;
};

}  // namespace selenite

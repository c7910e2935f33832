// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/failure.h"

#include <new>

namespace selenite {

std::vector<Fault> failure(const std::exception& error, const std::string& where) {
  std::vector<Fault> found;
  if (const auto* refused = dynamic_cast<const Refused*>(&error))
    found = refused->faults();
  else if (const auto* missing = dynamic_cast<const NotFound*>(&error))
    found = missing->faults();
  else if (dynamic_cast<const std::bad_alloc*>(&error))
    found = {{"", "the computer's memory does not suffice",
              "lower the height or fit fewer photos at once"}};
  else
    found = {{"", error.what(), ""}};
  for (Fault& fault : found)
    if (fault.object.empty()) fault.object = where;
  return found;
}

}  // namespace selenite

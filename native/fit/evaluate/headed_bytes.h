// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "math/fault.h"

namespace selenite {

/// Two parts as one; the first goes with its size.
inline std::string headed(std::string_view head, std::string_view body) {
  const std::uint64_t size = head.size();
  std::string all;
  all.reserve(sizeof size + head.size() + body.size());
  all.append(reinterpret_cast<const char*>(&size), sizeof size);
  return all.append(head).append(body);
}

/// The first part; `bytes` keeps the second. InvalidArgument: there is none.
inline std::string_view take_head(std::string_view& bytes) {
  std::uint64_t size = 0;
  if (bytes.size() >= sizeof size) std::memcpy(&size, bytes.data(), sizeof size);
  if (bytes.size() < sizeof size || size > bytes.size() - sizeof size)
    throw Refused("", "A message between a fit and its workers is damaged", "");
  const std::string_view head = bytes.substr(sizeof size, size);
  bytes.remove_prefix(sizeof size + size);
  return head;
}

}  // namespace selenite

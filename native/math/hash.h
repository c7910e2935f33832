// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "math/rng.h"

namespace selenite {

/// Hash of so many bytes that come in pieces, against damage and mix-ups, not against malice.
class Hash64 {
 public:
  explicit Hash64(std::uint64_t size) : sum_(mix64(size)) {}
  void add(std::string_view bytes) {
    while (!bytes.empty()) {
      if (filled_ == 0 && bytes.size() >= sizeof word_) {
        std::memcpy(&word_, bytes.data(), sizeof word_);
        bytes.remove_prefix(sizeof word_);
        end_word();
        continue;
      }
      const std::size_t taken = std::min(sizeof word_ - filled_, bytes.size());
      std::memcpy(reinterpret_cast<char*>(&word_) + filled_, bytes.data(), taken);
      bytes.remove_prefix(taken);
      filled_ += taken;
      if (filled_ == sizeof word_) end_word();
    }
  }
  /// After the last piece.
  std::uint64_t value() {
    if (filled_ > 0) end_word();
    return sum_;
  }

 private:
  void end_word() {
    sum_ = mix64(sum_ ^ word_);
    word_ = filled_ = 0;
  }
  std::uint64_t sum_, word_ = 0;
  std::size_t filled_ = 0;  ///< bytes of `word_`
};

inline std::uint64_t hash64(std::string_view bytes) {
  Hash64 hash(bytes.size());
  hash.add(bytes);
  return hash.value();
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "math/hash.h"

namespace selenite {

/// The bytes of a state in a file. Their checksum stands behind them. All throw std::system_error where the
/// file cannot be read or written.
class StateFile {
 public:
  enum Mode { kRead, kWrite };
  /// `size`: of the content.
  StateFile(const std::filesystem::path& file, Mode mode, std::size_t size);
  /// What was written and not sealed goes.
  ~StateFile();
  StateFile(const StateFile&) = delete;
  StateFile& operator=(const StateFile&) = delete;
  /// Of content and checksum.
  static std::size_t size_of(const std::filesystem::path& file);

  void write(std::string_view bytes);
  /// After the last piece.
  void seal();
  void read(void* data, std::size_t size);
  /// Reads all by the checksum, and returns to the begin.
  bool check_sum();

 private:
  void check() const;

  std::filesystem::path file_;
  bool sealed_;  ///< or read
  std::fstream stream_;
  std::size_t size_;
  Hash64 hash_;
};

}  // namespace selenite

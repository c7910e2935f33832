// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>

namespace selenite {

/// Bytes of a file, or of a part of it, that are read on demand. Nothing outside can be reached,
/// whatever offsets the file names.
class FileView {
 public:
  /// Throws FileError when the file cannot be opened.
  explicit FileView(const std::string& path);

  std::uint64_t size() const { return size_; }
  /// Up to `count` bytes from `at` on: fewer at the end, none behind it.
  std::string bytes(std::uint64_t at, std::uint64_t count) const;
  /// Whole number of 1 to 8 bytes; nothing behind the end.
  std::optional<std::uint64_t> number(std::uint64_t at, int size, bool big_endian) const;
  /// Bytes [at, at + count), cut at the end of this view.
  FileView part(std::uint64_t at, std::uint64_t count) const;

 private:
  std::shared_ptr<std::ifstream> stream_;
  std::uint64_t first_ = 0, size_ = 0;
};

/// The first `size` bytes of `bytes` as a whole number; missing bytes count as 0.
std::uint64_t whole_number(const char* bytes, int size, bool big_endian);

}  // namespace selenite

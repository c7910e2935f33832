// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace selenite {

/// A file that cannot be read or written; the message names file, cause and cure. Python: OSError.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Path from UTF-8 text, which is what Python hands over on every system.
inline std::filesystem::path path_from_utf8(const std::string& text) {
  return std::filesystem::path(std::u8string(text.begin(), text.end()));
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include "math/fault.h"

namespace selenite {

/// A file that cannot be read or written. Python: OSError.
struct FileError : std::runtime_error {
  /// cause: what follows the file's name in a sentence.
  FileError(const std::string& path, const std::string& cause, const std::string& cure)
      : std::runtime_error("'" + path + "' " + cause + "; " + cure),
        fault(std::make_shared<const Fault>(Fault{path, cause, cure})) {}

  std::shared_ptr<const Fault> fault;  ///< of the file; an error is copied without throwing
};

[[noreturn]] inline void refuse(const std::string& path, const std::string& cause,
                                const std::string& cure) {
  throw FileError(path, cause, cure);
}

/// Runs `read` and names the file when memory runs out.
template <class Read>
auto with_memory(const std::string& path, Read&& read) {
  try {
    return read();
  } catch (const std::bad_alloc&) {
    refuse(path, "takes more memory than there is", "scale it down or close other programs");
  } catch (const std::length_error&) {
    refuse(path, "says it is larger than any memory", "copy or export it again");
  }
}

/// Path from UTF-8 text, which is what Python hands over on every system.
inline std::filesystem::path path_from_utf8(const std::string& text) {
  return std::filesystem::path(std::u8string(text.begin(), text.end()));
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/state_file.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <vector>

namespace selenite {
namespace {

std::ios::openmode flags(StateFile::Mode mode) {
  return std::ios::binary |
         (mode == StateFile::kRead ? std::ios::in : std::ios::out | std::ios::trunc);
}

/// The last error of the system. Of a stream that failed for a reason of its own: an input/output error.
[[noreturn]] void fail() {
  throw std::system_error(errno != 0 ? errno : EIO, std::generic_category());
}

}  // namespace

StateFile::StateFile(const std::filesystem::path& file, Mode mode, std::size_t size)
    : file_(file), sealed_(mode == kRead), size_(size), hash_(size) {
  errno = 0;
  stream_.open(file, flags(mode));
  check();
}

StateFile::~StateFile() {
  if (sealed_) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

std::size_t StateFile::size_of(const std::filesystem::path& file) {
  return static_cast<std::size_t>(std::filesystem::file_size(file));
}

void StateFile::write(std::string_view bytes) {
  errno = 0;
  hash_.add(bytes);
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  check();
}

void StateFile::seal() {
  errno = 0;
  const std::uint64_t sum = hash_.value();
  stream_.write(reinterpret_cast<const char*>(&sum), sizeof sum);
  stream_.close();
  check();
  sealed_ = true;
}

void StateFile::read(void* data, std::size_t size) {
  errno = 0;
  stream_.read(static_cast<char*>(data), static_cast<std::streamsize>(size));
  check();
}

bool StateFile::check_sum() {
  std::vector<char> piece(std::size_t{1} << 20);
  for (std::size_t left = size_; left > 0;) {
    const std::size_t size = std::min(left, piece.size());
    read(piece.data(), size);
    hash_.add({piece.data(), size});
    left -= size;
  }
  std::uint64_t sum = 0;
  read(&sum, sizeof sum);
  stream_.seekg(0);
  check();
  return sum == hash_.value();
}

void StateFile::check() const {
  if (!stream_) fail();
}

}  // namespace selenite

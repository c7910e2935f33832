// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/file_view.h"

#include <algorithm>

#include "image/file_error.h"

namespace selenite {

FileView::FileView(const std::string& path)
    : stream_(std::make_shared<std::ifstream>(path_from_utf8(path), std::ios::binary)) {
  if (!*stream_) refuse(path, "cannot be opened", "check its permissions");
  stream_->seekg(0, std::ios::end);
  const auto end = stream_->tellg();
  if (end < 0) refuse(path, "cannot be read", "check its permissions");
  size_ = static_cast<std::uint64_t>(end);
}

std::string FileView::bytes(std::uint64_t at, std::uint64_t count) const {
  if (at >= size_) return {};
  count = std::min(count, size_ - at);
  std::string result(static_cast<std::size_t>(count), '\0');
  stream_->clear();
  stream_->seekg(static_cast<std::streamoff>(first_ + at));
  stream_->read(result.data(), static_cast<std::streamsize>(count));
  result.resize(static_cast<std::size_t>(stream_->gcount()));
  return result;
}

std::optional<std::uint64_t> FileView::number(std::uint64_t at, int size, bool big_endian) const {
  const std::string found = bytes(at, static_cast<std::uint64_t>(size));
  if (found.size() != static_cast<std::size_t>(size)) return std::nullopt;
  return whole_number(found.data(), size, big_endian);
}

FileView FileView::part(std::uint64_t at, std::uint64_t count) const {
  FileView result = *this;
  const std::uint64_t skipped = std::min(at, size_);
  result.first_ = first_ + skipped;
  result.size_ = std::min(count, size_ - skipped);
  return result;
}

std::uint64_t whole_number(const char* bytes, int size, bool big_endian) {
  std::uint64_t result = 0;
  for (int i = 0; i < size; ++i) {
    const auto byte = static_cast<unsigned char>(bytes[big_endian ? i : size - 1 - i]);
    result = result << 8 | byte;
  }
  return result;
}

}  // namespace selenite

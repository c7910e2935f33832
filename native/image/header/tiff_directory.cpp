// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/tiff_directory.h"

#include <array>
#include <bit>
#include <set>
#include <utility>

namespace selenite {
namespace {

constexpr std::size_t kMostDirectories = 64;  // in a chain or below a tag
constexpr std::uint64_t kMostEntries = 4096;  // of a directory
// Of a value, and of all in a directory; longer ones count as absent.
constexpr std::uint64_t kMostBytes = 1u << 24, kMostOfDirectory = 1u << 25;

enum Type {
  kByte = 1,
  kAscii,
  kShort,
  kLong,
  kRational,
  kSignedByte,
  kUndefined,
  kSignedShort,
  kSignedLong,
  kSignedRational,
  kFloat,
  kDouble,
  kDirectory,
  kLong8 = 16,
  kSignedLong8,
  kDirectory8
};  // clang-format off: one list, as in the standard

constexpr std::array<int, 19> kSizes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};

int size_of(int type) {
  return type > 0 && type < static_cast<int>(kSizes.size()) ? kSizes[static_cast<std::size_t>(type)]
                                                            : 0;
}

bool is_whole(int type) {
  return type == kByte || type == kShort || type == kLong || type == kDirectory || type == kLong8 ||
         type == kDirectory8 || type == kUndefined;
}

}  // namespace

std::optional<std::uint64_t> TiffDirectory::integer(std::uint16_t tag, std::size_t index) const {
  const auto found = entries_.find(tag);
  if (found == entries_.end() || !is_whole(found->second.type)) return std::nullopt;
  const int size = size_of(found->second.type);
  const std::size_t at = index * static_cast<std::size_t>(size);
  const std::string& data = found->second.data;
  if (at + static_cast<std::size_t>(size) > data.size()) return std::nullopt;
  return whole_number(data.data() + at, size, big_endian_);
}

std::vector<double> TiffDirectory::numbers(std::uint16_t tag) const {
  std::vector<double> result;
  const auto found = entries_.find(tag);
  if (found == entries_.end()) return result;
  const auto& [type, data] = found->second;
  const std::size_t size = static_cast<std::size_t>(size_of(type));
  for (std::size_t at = 0; size > 0 && at + size <= data.size(); at += size) {
    const char* bytes = data.data() + at;
    const std::uint64_t whole = whole_number(bytes, static_cast<int>(size), big_endian_);
    if (is_whole(type)) {
      result.push_back(static_cast<double>(whole));
    } else if (type == kRational) {
      result.push_back(static_cast<double>(whole_number(bytes, 4, big_endian_)) /
                       static_cast<double>(whole_number(bytes + 4, 4, big_endian_)));
    } else if (type == kFloat) {
      result.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(whole)));
    } else if (type == kDouble) {
      result.push_back(std::bit_cast<double>(whole));
    }
  }
  return result;
}

std::string TiffDirectory::bytes(std::uint16_t tag) const {
  const auto found = entries_.find(tag);
  return found == entries_.end() ? "" : found->second.data;
}

std::string TiffDirectory::text(std::uint16_t tag) const {
  const auto found = entries_.find(tag);
  return found == entries_.end() ? "" : std::string(found->second.data.c_str());
}

TiffFile::TiffFile(FileView view) : view_(std::move(view)) {
  const std::string head = view_.bytes(0, 16);
  if (head.size() < 8) return;
  big_endian_ = head[0] == 'M';
  is_big_ = whole_number(head.data() + 2, 2, big_endian_) == 43;
  if (is_big_ && head.size() < 16) return;
  first_ = is_big_ ? whole_number(head.data() + 8, 8, big_endian_)
                   : whole_number(head.data() + 4, 4, big_endian_);
}

std::vector<TiffDirectory> TiffFile::pages() const {
  std::vector<TiffDirectory> result;
  std::set<std::uint64_t> seen;
  for (std::uint64_t at = first_; at != 0 && result.size() < kMostDirectories;) {
    if (!seen.insert(at).second) break;
    std::optional<TiffDirectory> found = directory(at);
    if (!found) break;
    at = found->next();
    result.push_back(std::move(*found));
  }
  return result;
}

std::vector<TiffDirectory> TiffFile::below(const TiffDirectory& parent, std::uint16_t tag) const {
  std::vector<TiffDirectory> result;
  for (std::size_t i = 0; i < kMostDirectories; ++i) {
    const auto at = parent.integer(tag, i);
    if (!at) break;
    if (std::optional<TiffDirectory> found = directory(*at)) result.push_back(std::move(*found));
  }
  return result;
}

std::optional<TiffDirectory> TiffFile::directory(std::uint64_t at) const {
  const int count_size = is_big_ ? 8 : 2, value_size = is_big_ ? 8 : 4;
  const auto count = view_.number(at, count_size, big_endian_);
  if (!count || *count == 0 || *count > kMostEntries) return std::nullopt;
  TiffDirectory result;
  result.big_endian_ = big_endian_;
  std::uint64_t read = 0;
  const std::uint64_t entry_size = is_big_ ? 20 : 12;
  const std::string table =
      view_.bytes(at + static_cast<std::uint64_t>(count_size),
                  *count * entry_size + static_cast<std::uint64_t>(value_size));
  for (std::uint64_t i = 0; i < *count && (i + 1) * entry_size <= table.size(); ++i) {
    const char* entry = table.data() + i * entry_size;
    const auto tag = static_cast<std::uint16_t>(whole_number(entry, 2, big_endian_));
    const int type = static_cast<int>(whole_number(entry + 2, 2, big_endian_));
    const std::uint64_t elements = whole_number(entry + 4, value_size, big_endian_);
    const char* value = entry + 4 + value_size;
    const auto size = static_cast<std::uint64_t>(size_of(type));
    if (size == 0 || elements > kMostBytes / size) continue;
    const std::uint64_t bytes = elements * size;
    if (bytes > kMostOfDirectory - read) continue;
    const auto [at_tag, is_new] = result.entries_.try_emplace(tag);
    if (!is_new) continue;  // the first counts, as in libtiff
    read += bytes;
    TiffDirectory::Entry& kept = at_tag->second;
    kept.type = type;
    if (bytes <= static_cast<std::uint64_t>(value_size))
      kept.data.assign(value, static_cast<std::size_t>(bytes));
    else
      kept.data = view_.bytes(whole_number(value, value_size, big_endian_), bytes);
  }
  if (table.size() == *count * entry_size + static_cast<std::uint64_t>(value_size))
    result.next_ = whole_number(table.data() + *count * entry_size, value_size, big_endian_);
  return result;
}

}  // namespace selenite

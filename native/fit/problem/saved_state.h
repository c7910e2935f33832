// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "math/fault.h"
#include "math/hash.h"
#include "render/film/film.h"

namespace selenite {

/// A state as bytes. A class lists its members once, in `members(SavedState&)`, for writing and for
/// reading. The bytes are for the machine and the version that wrote them.
class SavedState {
 public:
  /// For writing.
  SavedState() = default;
  /// For reading. InvalidArgument when the bytes are not what `sealed` gave.
  explicit SavedState(std::string_view sealed) : reading_(true) {
    std::uint64_t sum = 0;
    if (sealed.size() < sizeof sum) damaged();
    bytes_ = sealed.substr(0, sealed.size() - sizeof sum);
    std::memcpy(&sum, sealed.data() + bytes_.size(), sizeof sum);
    if (sum != checksum()) damaged();
  }

  bool reading() const { return reading_; }
  /// What was written, with a checksum. It is handed out: a state may be large.
  std::string sealed() {
    append_checksum(0);
    return std::exchange(bytes_, {});
  }
  /// When writing: the sealed state of another object, as a string. It is written in its place.
  template <class Part>
  void nested(Part& part) {
    std::int64_t size = 0;
    const std::size_t before = bytes_.size(), begin = before + sizeof size;
    one(size);
    part.members(*this);
    append_checksum(begin);
    size = static_cast<std::int64_t>(bytes_.size() - begin);
    std::memcpy(bytes_.data() + before, &size, sizeof size);
  }
  /// When reading: InvalidArgument unless everything has been read.
  void expect_end() const {
    if (reading_ && at_ != bytes_.size()) damaged();
  }

  template <class... T>
  void operator()(T&... parts) {
    (one(parts), ...);
  }

 private:
  [[noreturn]] static void damaged() {
    throw Refused("", "The saved state is damaged or of another version", "start without it");
  }
  std::uint64_t checksum(std::size_t begin = 0) const {
    return hash64(std::string_view(bytes_).substr(begin));
  }
  void append_checksum(std::size_t begin) {
    const std::uint64_t sum = checksum(begin);
    bytes_.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  }
  void raw(void* data, std::size_t size) {
    if (size == 0) return;
    if (!reading_) {
      bytes_.append(static_cast<const char*>(data), size);
      return;
    }
    if (size > bytes_.size() - at_) damaged();
    std::memcpy(data, bytes_.data() + at_, size);
    at_ += size;
  }
  /// A count of things that take at least a byte each.
  std::int64_t count(std::int64_t n) {
    raw(&n, sizeof n);
    if (n < 0 || (reading_ && static_cast<std::uint64_t>(n) > bytes_.size() - at_)) damaged();
    return n;
  }

  template <class T>
  void one(T& part) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      raw(&part, sizeof part);
    } else {
      part.members(*this);
    }
  }
  template <class T, int Rows, int Columns, int Order>
  void one(Eigen::Matrix<T, Rows, Columns, Order>& part) {
    const std::int64_t rows = count(part.rows()), columns = count(part.cols());
    constexpr std::int64_t kMost = std::int64_t{1} << 40;
    if (rows > 0 && columns > kMost / rows) damaged();
    const std::size_t size = static_cast<std::size_t>(rows * columns) * sizeof(T);
    if (reading_) {
      if (size > bytes_.size() - at_) damaged();
      part.resize(rows, columns);
    }
    raw(part.data(), size);
  }
  template <class T, int Rows, int Columns, int Order>
  void one(Eigen::Array<T, Rows, Columns, Order>& part) {
    Eigen::Matrix<T, Rows, Columns, Order> matrix = part;
    one(matrix);
    if (reading_) part = matrix.array();
  }
  void one(std::string& part) { list(part); }
  void one(SlotFilm& part) { (*this)(part.mean, part.half_a, part.variance, part.covariance); }
  void one(Film& part) {
    (*this)(part.width, part.height, part.spp, part.mean, part.half_a, part.variance, part.slots,
            part.dropped, part.first_dropped, part.truncated, part.seconds, part.cpu_seconds);
  }
  template <class T, std::size_t N>
  void one(std::array<T, N>& part) {
    for (T& item : part) one(item);
  }
  template <class T>
  void one(std::optional<T>& part) {
    bool has_value = part.has_value();
    one(has_value);
    if (reading_) part = has_value ? std::optional<T>(T{}) : std::nullopt;
    if (has_value) one(*part);
  }
  template <class T>
  void one(std::vector<T>& part) {
    list(part);
  }
  void one(std::vector<bool>& part) {
    std::vector<char> items(part.begin(), part.end());
    list(items);
    if (reading_) part.assign(items.begin(), items.end());
  }
  template <class T>
  void one(std::map<std::string, T>& part) {
    std::vector<std::string> keys;
    std::vector<T> values;
    for (const auto& [key, value] : part) {
      keys.push_back(key);
      values.push_back(value);
    }
    (*this)(keys, values);
    if (keys.size() != values.size()) damaged();
    for (std::size_t i = 0; i < keys.size(); ++i) part[keys[i]] = values[i];
  }
  template <class T>
  void one(std::deque<T>& part) {
    list(part);
  }
  template <class List>
  void list(List& part) {
    const std::int64_t n = count(static_cast<std::int64_t>(part.size()));
    if (reading_) part.resize(static_cast<std::size_t>(n));
    for (auto& item : part) one(item);
  }

  bool reading_ = false;
  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "fit/problem/state_file.h"
#include "math/fault.h"
#include "math/hash.h"
#include "render/film/film.h"

namespace selenite {

/// A state as bytes. A class lists its members once, in `members(SavedState&)`, for writing and for
/// reading. The bytes are for the machine and the version that wrote them.
class SavedState {
 public:
  /// For writing, into memory.
  SavedState() = default;
  /// For reading. InvalidArgument when the bytes are not what `sealed` gave.
  explicit SavedState(std::string_view sealed)
      : reading_(true), left_(content_size(sealed.size())) {
    bytes_ = sealed.substr(0, left_);
    std::uint64_t sum = 0;
    std::memcpy(&sum, sealed.data() + left_, sizeof sum);
    if (sum != hash64(bytes_)) damaged();
  }

  /// Writes the state of `part` to a file, piece by piece: a state may be as large as the fit itself.
  /// Throws std::system_error.
  template <class Part>
  static void write(const std::filesystem::path& file, Part& part) {
    SavedState counted(nullptr);
    counted(part);
    StateFile out(file, StateFile::kWrite, counted.size_);
    SavedState state(&out);
    state(part);
    out.seal();
  }
  /// Reads what `write` has written. InvalidArgument when it is damaged, std::system_error.
  template <class Part>
  static void read(const std::filesystem::path& file, Part& part) {
    const std::size_t size = content_size(StateFile::size_of(file));
    StateFile in(file, StateFile::kRead, size);
    if (!in.check_sum()) damaged();
    SavedState state(&in);
    state.reading_ = true;
    state.left_ = size;
    state(part);
    state.expect_end();
  }

  bool reading() const { return reading_; }
  /// What was written, with a checksum. It is handed out.
  std::string sealed() {
    const std::uint64_t sum = hash64(bytes_);
    bytes_.append(reinterpret_cast<const char*>(&sum), sizeof sum);
    return std::exchange(bytes_, {});
  }
  /// When reading: InvalidArgument unless everything has been read.
  void expect_end() const {
    if (reading_ && left_ != 0) damaged();
  }

  template <class... T>
  void operator()(T&... parts) {
    (one(parts), ...);
  }

 private:
  /// To or from a file; none: nothing is kept but the size.
  explicit SavedState(StateFile* file) : in_memory_(false), file_(file) {}

  [[noreturn]] static void damaged() {
    throw Refused("", "The saved state is damaged or of another version", "start without it");
  }
  /// Of a sealed state.
  static std::size_t content_size(std::size_t sealed) {
    if (sealed < sizeof(std::uint64_t)) damaged();
    return sealed - sizeof(std::uint64_t);
  }
  void raw(void* data, std::size_t size) {
    if (size == 0) return;
    if (!reading_) {
      size_ += size;
      if (in_memory_) bytes_.append(static_cast<const char*>(data), size);
      if (file_) file_->write({static_cast<const char*>(data), size});
      return;
    }
    if (size > left_) damaged();
    if (file_)
      file_->read(data, size);
    else
      std::memcpy(data, bytes_.data() + (bytes_.size() - left_), size);
    left_ -= size;
  }
  /// A count of things that take at least a byte each.
  std::int64_t count(std::int64_t n) {
    raw(&n, sizeof n);
    if (n < 0 || (reading_ && static_cast<std::uint64_t>(n) > left_)) damaged();
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
      if (size > left_) damaged();
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

  bool reading_ = false, in_memory_ = true;
  std::size_t left_ = 0;  ///< bytes that have not been read
  std::size_t size_ = 0;  ///< bytes that have been written
  std::string bytes_;
  StateFile* file_ = nullptr;
};

}  // namespace selenite

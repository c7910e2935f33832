// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fit/evaluate/finite_differences.h"
#include "fit/photo/photo.h"
#include "fit/problem/point.h"

namespace selenite {

/// How a photo is evaluated. Without `derivatives` the film holds the picture alone.
struct Evaluation {
  int spp;
  std::uint64_t seed;
  std::optional<Differences> derivatives{};
  Purpose purpose = Purpose::kInstrumental;
  bool halves = true;         ///< whether anybody asks for those of the picture
  bool all_pictures = false;  ///< also those that no phase reads
};

/// What a fit has rendered.
struct RenderCounts {
  std::int64_t samples = 0;  ///< paths traced, validation included
  std::int64_t dropped = 0;  ///< of them left out because they were not finite
  double cpu_seconds = 0;
  std::string first_dropped{};

  void add(const Film& film, const Photo& photo);
  void add(const RenderCounts& other);
  /// More than one sample in a thousand was left out: the derivatives describe another picture.
  bool too_many_dropped() const;
  std::string dropped_text() const;
  void members(SavedState& state) { state(samples, dropped, cpu_seconds, first_dropped); }
};

/// All that a picture of a photo depends on, beside the scene and the unknowns. A worker has the photo
/// without its pixels.
struct PhotoQuestion {
  Point point;
  std::string photo;  ///< its id
  int width = 0, height = 0;
  PhotoFrame frame;
  Alignment alignment;
  std::shared_ptr<const PixelMask> pixels;  ///< null: all
  std::vector<char> aims;                   ///< at which lamps paths aim
  Evaluation how{1, 0};

  void members(SavedState& state);
  std::string bytes();
  /// InvalidArgument: they are damaged.
  static PhotoQuestion of(std::string_view bytes);
};

/// A picture without the gain of its photo, and what it took.
struct PhotoAnswer {
  Film film;
  RenderCounts counts;

  std::string bytes(const PixelMask* pixels);
  /// InvalidArgument: they are damaged, or of another question.
  static PhotoAnswer of(std::string_view bytes, const PixelMask* pixels);
};

}  // namespace selenite

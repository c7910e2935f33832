// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fit/problem/fields.h"

namespace selenite {

/// The numbers of fields that equations are solved for.
///
/// They come field by field, in the order of `FieldValues`. An image of more texels than are solved for at
/// once has numbers on a coarser lattice. Changes are interpolated between its points: photos of few pixels
/// determine no finer ones, and detail of the start stays.
///
/// A channel of a colour that acts on its own channel of the pictures has equations of its own. A number
/// such as a roughness acts on all channels. Where a field has such numbers, all numbers of all fields are
/// unknowns of one part. Its rows are those of the three channels.
///
/// A place of a field is what pictures have one derivative by, channel by channel: a colour, or such a
/// number.
class FieldNumbers {
 public:
  /// `most_texels`: of all images together.
  FieldNumbers(const Fields& fields, std::ptrdiff_t most_texels);

  /// The numbers of a field.
  struct Lattice {
    Eigen::Index count = 0;     ///< numbers
    int channels = 0;           ///< of them at a point
    int width = 0, height = 0;  ///< of an image, in points
    int factor = 1;             ///< texels along the side of a point
    bool repeats = false;
    bool normals = false;    ///< three numbers encode a unit vector
    bool by_channel = true;  ///< a place has three numbers, each of its own channel
    /// Numbers at a point that are unknowns of the same part, and places at a point.
    int columns = 1, places = 1;

    Eigen::Index place_count() const { return count / channels * places; }
  };
  const std::vector<Lattice>& lattices() const { return lattices_; }
  Eigen::Index size() const { return size_; }

  /// Means over the texels of each point.
  Eigen::VectorXd of(const FieldValues& values) const;
  /// Adds changes of all numbers to the values, within [minimum, maximum] of their fields. Vectors become unit
  /// vectors again.
  void add(const Eigen::VectorXd& step, FieldValues& values) const;
  /// Takes from a step of all numbers what would change the lengths of vectors: no picture shows them.
  void keep_lengths(const Eigen::VectorXd& values, Eigen::VectorXd& step) const;
  /// Calls `sink(place, weight)` for the places, counted over all fields, on which a field's place depends.
  template <class Sink>
  void each_place(std::size_t field, std::uint32_t place, Sink&& sink) const {
    const Lattice& lattice = lattices_[field];
    const std::uint32_t first = first_places_[field];
    if (lattice.factor == 1) return sink(first + place, 1.f);
    const auto places = static_cast<std::uint32_t>(lattice.places);
    for (const Tap& tap : taps_[field].of(place / places))
      if (tap.weight > 0) sink(first + tap.point * places + place % places, tap.weight);
  }

  /// The equations of some channels.
  struct Part {
    int first_channel, channels;
    Eigen::ArithmeticSequence<Eigen::Index, Eigen::Index, Eigen::Index> numbers;

    /// Of a column a channel, those of its channels after each other.
    Eigen::VectorXf rows_of(const Eigen::MatrixXf& by_channel) const {
      return by_channel.middleCols(first_channel, channels).reshaped();
    }
    /// Of rows that are so already.
    auto blocks_of(const Eigen::MatrixXf& all) const {
      const Eigen::Index one = all.rows() / 3;
      return all.middleRows(first_channel * one, channels * one);
    }
  };
  const std::vector<Part>& parts() const { return parts_; }
  /// In its part, of the number that a channel has the derivative by a place by.
  Eigen::Index column(std::size_t place, int channel) const {
    return by_place_.empty() ? static_cast<Eigen::Index>(place)
                             : by_place_[place].first + (by_place_[place].by_channel ? channel : 0);
  }

 private:
  struct Column {
    Eigen::Index first;
    bool by_channel;
  };
  struct Tap {
    std::uint32_t point;
    float weight;
  };
  /// Bilinear weights of the points around a texel.
  class Taps {
   public:
    Taps() = default;
    Taps(const Lattice& lattice, int width, int height);
    std::array<Tap, 4> of(std::uint32_t texel) const;

   private:
    struct Between {
      int first, second;
      float share;  ///< of the second
    };
    static std::vector<Between> along(int texels, int points, int factor, bool repeats);

    int points_ = 0;  ///< along a row
    std::vector<Between> columns_, rows_;
  };

  std::vector<Lattice> lattices_;
  std::vector<std::uint32_t> first_places_;
  std::vector<Taps> taps_;
  std::vector<double> minimum_, maximum_;  ///< of each field
  std::vector<Part> parts_;
  std::vector<Column> by_place_;  ///< empty: each channel has a part
  Eigen::Index size_ = 0;
};

}  // namespace selenite

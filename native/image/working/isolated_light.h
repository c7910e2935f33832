// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace selenite {

/// The light of isolated bright pixels: rare bright paths of a render that has not converged, or hot
/// pixels of a camera.
///
/// A pixel is isolated if it is more than three times as bright as all but the brightest of its 8 neighbours.
/// An edge, a line and a highlight of a lens have two bright pixels side by side. A highlight of one
/// pixel is isolated too, as bright as its lamp. So the 8 brightest are left out of the share.
/// False alarms: docs/measurements/fits.md, "Photos with too few samples".
class IsolatedLight {
 public:
  /// Of a picture of this size.
  IsolatedLight(int width, int height) : width_(width), height_(height) {}

  /// Row `y`, in any order and each once: `rgb` (width, 3) linear, `inside` (width): neither masked nor
  /// transparent. Pixels with a neighbour that is not inside are not judged.
  void add(int y, const float* rgb, const std::uint8_t* inside);

  /// Isolated pixels so far.
  std::int64_t count() const { return count_; }
  /// What they have beyond their neighbours, without the brightest: a share of all light.
  double share() const;

 private:
  static constexpr std::size_t kLeftOut = 8;
  struct Row {
    std::vector<float> level;  ///< mean over channels; below 0: not inside
    int uses = 0;              ///< of the three rows beside which it is judged, those to come
  };
  bool judged(int y) const { return y > 0 && y + 1 < height_; }
  void judge(int y);

  int width_, height_;
  std::map<int, Row> rows_;
  std::int64_t count_ = 0;
  double light_ = 0, beyond_ = 0;
  std::array<double, kLeftOut> brightest_{};
};

}  // namespace selenite

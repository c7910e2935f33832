// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/film/render_settings.h"
#include "render/film/tile.h"
#include "render/lanes/lane_random.h"
#include "render/prepared/prepared.h"

namespace selenite {

// Vectors and packets lane by lane.
inline void set(Vec3<Lanes>& v, int lane, const Vec3f& x) {
  v.x.set(lane, x.x), v.y.set(lane, x.y), v.z.set(lane, x.z);
}
inline Vec3f at(const Vec3<Lanes>& v, int lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }
inline Lanes load(const Packet<float>& from) {
  return Lanes(*reinterpret_cast<const Lanes::Raw*>(from.lane));
}
inline LaneInts load(const Packet<int>& from) {
  return LaneInts(*reinterpret_cast<const LaneInts::Raw*>(from.lane));
}
inline void store(const Lanes& x, Packet<float>& to) {
  *reinterpret_cast<Lanes::Raw*>(to.lane) = x.v;
}
inline void store(const Vec3<Lanes>& v, Packet<float>* to) {
  store(v.x, to[0]), store(v.y, to[1]), store(v.z, to[2]);
}

/// Eight camera rays and what they meet.
struct LaneCameraRays {
  LaneRandom random;
  Vec3<Lanes> origin, direction;
  Lanes t_min, t_max;
  HitPacket hits;
};

/// CameraSamples for the lanes: the samples of a tile one after another, with their camera rays and
/// what these meet, of which eight are worked out together.
class LaneCamera {
 public:
  /// A sample whose turn it is.
  struct Sample {
    int pixel, number;  ///< counted in the tile; counted in the pixel
    int lane;           ///< of `rays`
  };

  template <int L>
  LaneCamera(const Prepared<L>& prepared, const PixelCamera& camera, const RenderSettings& settings,
             const Tile& tile)
      : geometry_(prepared.geometry),
        any_medium_(prepared.any_medium),
        camera_(camera),
        settings_(settings),
        tile_(tile) {}

  bool next(Sample& sample) {
    if (at_ == count_) trace_more();
    if (at_ == count_) return false;
    sample = {pixel_[at_], number_[at_], at_};
    ++at_;
    return true;
  }

  /// Of the sample that came last, in its lane.
  const LaneCameraRays& rays() const { return rays_; }

 private:
  void trace_more() {
    at_ = count_ = 0;
    const int width = tile_.x1 - tile_.x0, pixels = width * (tile_.y1 - tile_.y0);
    LaneInts pixel_of_picture(0), number(0);
    Lanes x(0), y(0);
    while (count_ < kLanes && next_pixel_ < pixels) {
      const int column = tile_.x0 + next_pixel_ % width, row = tile_.y0 + next_pixel_ / width;
      if (!settings_.has(static_cast<std::size_t>(row) * settings_.width + column)) {
        ++next_pixel_;
        continue;
      }
      pixel_[count_] = next_pixel_, number_[count_] = next_number_;
      pixel_of_picture.set(count_, row * settings_.width + column);
      number.set(count_, next_number_);
      x.set(count_, static_cast<float>(column));
      y.set(count_, static_cast<float>(row));
      ++count_;
      if (++next_number_ == settings_.spp) next_number_ = 0, ++next_pixel_;
    }
    if (count_ == 0) return;
    auto& [random, origin, direction, t_min, t_max, hits] = rays_;
    random.start(settings_.seed, pixel_of_picture, number);
    Vec2<Lanes> at{x + random.uniform(0), y + random.uniform(1)};
    if (camera_.cuts_photo())
      at = camera_.in_photo(at.x, at.y, random.uniform(2), random.uniform(3));
    camera_.ray<LaneDoubles>(at.x, at.y, origin, direction, t_min, t_max);
    // Before the near clip plane there is no medium either, as in Cycles.
    if (any_medium_) {
      origin = origin + direction * t_min;
      t_max -= t_min;
      t_min = 0;
    }
    RayPacket packet;
    store(origin, packet.origin);
    store(direction, packet.direction);
    store(t_min, packet.t_min);
    store(t_max, packet.t_max);
    geometry_.intersect(packet, (1u << count_) - 1, true, hits);
  }

  const Geometry& geometry_;
  bool any_medium_;
  const PixelCamera& camera_;
  const RenderSettings& settings_;
  Tile tile_;
  LaneCameraRays rays_;
  int next_pixel_ = 0, next_number_ = 0;
  int pixel_[kLanes], number_[kLanes];
  int at_ = 0, count_ = 0;
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "math/color.h"
#include "math/vec.h"

namespace selenite {

/// The kernel whose paths keep a tape. Its one derivative slot is that of a shift of all values of
/// all fields together: it keeps a path alive that is black but whose derivative is not.
inline constexpr int kTaped = 1;

/// Where a path has looked up a field of unknowns (a grid; a texture would do): its throughput took
/// the factor `value` there, whose derivative by the looked-up colour is `slope`, channel by channel.
struct TapeEvent {
  Colorf throughput;  ///< of the whole path just before
  Colorf since;       ///< of the part of the path since the event before, or since the camera
  Colorf light;       ///< that this part brought home, per throughput at its start
  Colorf value, slope;
  Vec3f position;
  int field;
};

/// What one path has to remember so that its derivatives by any number of unknowns can be told once
/// the weight of its pixel is known.
///
/// With L the light that the path brings home from event k on, per throughput at that event, the
/// derivative by the event's colour is throughput slope L, and towards the camera
/// L becomes light + since value L. Nothing is divided by `value`: at albedo 0 it is what counts.
class Tape {
 public:
  void clear() {
    events_.clear();
    leaves_.clear();
    light_ = Colorf();
  }
  void add_light(const Colorf& light) { light_ += light; }
  void record(const Colorf& throughput, const Colorf& since, const Colorf& value,
              const Colorf& slope, const Vec3f& position, int field) {
    events_.push_back({throughput, since, light_, value, slope, position, field});
    light_ = Colorf();
  }

  /// A lookup on a branch of the path that ended at a light: `derivative` of the path's radiance by
  /// the looked-up colour.
  void add_leaf(const Colorf& derivative, const Vec3f& position, int field) {
    leaves_.push_back({derivative, position, field});
  }

  /// Calls `sink(field, position, derivative)` for every leaf and every event, last first, where `weight` is that of
  /// the path's radiance in what is differentiated. Returns the path's radiance.
  template <class Sink>
  Colorf sweep(const Colorf& weight, Sink&& sink) const {
    for (const Leaf& leaf : leaves_) sink(leaf.field, leaf.position, weight * leaf.derivative);
    Colorf light = light_;
    for (auto event = events_.rbegin(); event != events_.rend(); ++event) {
      sink(event->field, event->position, weight * event->throughput * event->slope * light);
      light = event->light + event->since * event->value * light;
    }
    return light;
  }
  bool empty() const { return events_.empty() && leaves_.empty(); }

 private:
  struct Leaf {
    Colorf derivative;
    Vec3f position;
    int field;
  };
  std::vector<Leaf> leaves_;
  std::vector<TapeEvent> events_;
  Colorf light_;  ///< brought home since the last event
};

/// What a throughput keeps for the tape: nothing in other kernels.
template <bool taped>
struct SinceEvent {
  void multiply(const Colorf&) {}
  void multiply(float) {}
};
template <>
struct SinceEvent<true> {
  Colorf since{1, 1, 1};
  Tape* tape = nullptr;
  /// A branch towards a light may look up one colour, at `place`: throughput before and since.
  bool is_branch = false, has_leaf = false;
  Colorf before, after;
  Vec3f place;
  int field = 0;

  void branches() { is_branch = true; }
  void multiply(const Colorf& f) {
    since = since * f;
    after = after * f;
  }
  void multiply(float f) {
    since = since * f;
    after = after * f;
  }
  /// `light`, per throughput, is brought home.
  void bring(const Colorf& light) const {
    tape->add_light(since * light);
    if (has_leaf) tape->add_leaf(before * after * light, place, field);
  }
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <vector>

#include "math/color.h"
#include "math/vec.h"

namespace selenite {

/// The kernel whose paths keep a tape. Its one derivative slot is that of a shift of all values of
/// all fields together: it keeps a path alive that is black but whose derivative is not. Only values
/// that can make a path black have a part in it.
inline constexpr int kTaped = 1;
/// The same where several maps of a material are unknown: a derivative for each of what they give.
inline constexpr int kTapedMaps = 6;
/// Whether a kernel keeps a tape. It has one slot, whatever the derivatives of a material.
constexpr bool is_taped(int slots) { return slots == kTaped || slots == kTapedMaps; }

/// Where a field of unknowns was looked up: a grid at a point of the scene, an image at (u, v, 0), the
/// world's image at a direction of its own frame, the colours of a mesh at what `on_triangle` says.
struct FieldPlace {
  Vec3f position;
  int field;
  /// Of the three numbers looked up, the one that the derivative is by, in all channels; -1: each
  /// channel depends on its own, or all of them on a single number.
  int number = -1;

  static FieldPlace on_triangle(int triangle, float b1, float b2, int field) {
    return {{b1, b2, std::bit_cast<float>(triangle)}, field};
  }
};

/// How a factor depends on what was looked up in one field: its derivative by the looked-up colour,
/// channel by channel. `unit`: what counts as a shift of the field in the one slot that there is.
struct FieldSlope {
  Colorf slope;
  FieldPlace place;
  float unit;
};

/// A path has looked up a field: its throughput took the factor `value` there, whose derivative by the
/// looked-up colour is `slope`, channel by channel.
struct TapeEvent {
  Colorf throughput;  ///< of the whole path just before
  Colorf since;       ///< of the part of the path since the event before, or since the camera
  Colorf light;       ///< that this part brought home, per throughput at its start
  Colorf value, slope;
  FieldPlace place;
  bool same_factor = false;  ///< as the event before: a factor that depends on several fields
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
  /// A factor that depends on `count` fields, at least one.
  void record(const Colorf& throughput, const Colorf& since, const Colorf& value,
              const FieldSlope* slopes, int count) {
    append(events_, throughput, since, light_, value, slopes, count);
    light_ = Colorf();
  }

  /// A branch towards a light forgets the one before it. Its factors become leaves if light is found
  /// at its end, and nothing otherwise.
  void start_branch() { branch_.clear(); }
  void record_on_branch(const Colorf& throughput, const Colorf& since, const Colorf& value,
                        const FieldSlope* slopes, int count) {
    append(branch_, throughput, since, Colorf(), value, slopes, count);
  }
  /// `light`: per throughput after the last factor.
  void end_branch(const Colorf& light) {
    back(branch_, light, [this](const TapeEvent& event, const Colorf& derivative) {
      leaves_.push_back({derivative, event.place});
    });
  }

  /// A factor at the end of the path or of a branch, on which nothing that follows depends.
  void add_leaf(const Colorf& derivative, const FieldPlace& place) {
    leaves_.push_back({derivative, place});
  }

  /// Calls `sink(place, derivative)` for every leaf and every event, last first, where `weight` is that of
  /// the path's radiance in what is differentiated. Returns the path's radiance.
  template <class Sink>
  Colorf sweep(const Colorf& weight, Sink&& sink) const {
    for (const Leaf& leaf : leaves_) sink(leaf.place, weight * leaf.derivative);
    return back(events_, light_, [&](const TapeEvent& event, const Colorf& derivative) {
      sink(event.place, weight * derivative);
    });
  }
  bool empty() const { return events_.empty() && leaves_.empty(); }

 private:
  struct Leaf {
    Colorf derivative;
    FieldPlace place;
  };
  using Events = std::vector<TapeEvent>;

  static void append(Events& events, const Colorf& throughput, const Colorf& since,
                     const Colorf& light, const Colorf& value, const FieldSlope* slopes,
                     int count) {
    for (int i = 0; i < count; ++i)
      events.push_back({throughput, since, light, value, slopes[i].slope, slopes[i].place, i > 0});
  }
  /// From the light after the last event back to that before the first.
  template <class Found>
  static Colorf back(const Events& events, Colorf light, Found&& found) {
    for (auto event = events.rbegin(); event != events.rend(); ++event) {
      found(*event, event->throughput * event->slope * light);
      if (!event->same_factor) light = event->light + event->since * event->value * light;
    }
    return light;
  }

  std::vector<Leaf> leaves_;
  Events events_, branch_;
  Colorf light_;  ///< brought home since the last event
};

/// What a throughput keeps for the tape: nothing in other kernels.
template <bool taped>
struct SinceEvent {
  void branches() {}
  void multiply(const Colorf&) {}
  void multiply(float) {}
};
template <>
struct SinceEvent<true> {
  Colorf since{1, 1, 1};  ///< the last event of the path
  Tape* tape = nullptr;
  bool is_branch = false;
  Colorf after{1, 1, 1};  ///< the last event of the branch, or its start

  /// From here on this is a branch of the path, towards a light.
  void branches() {
    is_branch = true;
    after = Colorf(1);
    tape->start_branch();
  }
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
    if (is_branch) tape->end_branch(after * light);
  }
};

}  // namespace selenite

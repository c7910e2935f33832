// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <limits>

#include "math/rng.h"
#include "render/media/grid_flight.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// The media that a path is inside of. A medium fills the inside of its object, by the
/// winding of the faces; where objects overlap, their media add, as in Cycles.
template <int L>
class MediaStack {
 public:
  explicit MediaStack(const Prepared<L>& prepared) : p_(&prepared) {}

  bool empty() const { return count_ == 0; }
  /// Some of them vary along a ray.
  bool vary() const {
    for (int i = 0; i < count_; ++i)
      if (material(i).density_grid) return true;
    return false;
  }

  /// Finds the media around a point: those whose boundary is left, and not entered before, along a
  /// ray from there.
  void locate(const Vec3f& point) {
    if (!p_->media_bounds.contains(point)) return;
    // No direction along which scenes are built.
    const Vec3f direction = normalize(Vec3f{0.3137f, 0.2719f, 0.9097f});
    std::array<Entry, kMost> entered;
    int entered_count = 0;
    Ray ray{point, direction, 0, std::numeric_limits<float>::infinity()};
    for (int i = 0; i < kMostSurfaces; ++i) {
      const auto hit = p_->geometry.intersect(ray, kCameraRay);
      if (!hit) return;
      const Surface s = p_->geometry.surface(*hit);
      if (p_->materials[s.material].has_medium) {
        const Entry entry{hit->instance, s.material};
        const auto end = entered.begin() + entered_count;
        if (dot(direction, s.ng) < 0) {
          if (entered_count < kMost) entered[entered_count++] = entry;
        } else if (const auto at = std::find(entered.begin(), end, entry); at != end) {
          *at = entered[--entered_count];
        } else {
          push(entry);
        }
      }
      ray.origin = s.leave(direction);
    }
  }

  /// A path goes on from a surface towards `direction`, by either side of it: nothing changes if it
  /// stays on the side that it came from.
  void cross(const Hit& hit, const Surface& surface, const Vec3f& direction) {
    if (!p_->materials[surface.material].has_medium) return;
    const Entry entry{hit.instance, surface.material};
    if (dot(direction, surface.ng) < 0) {
      push(entry);
      return;
    }
    const auto end = entries_.begin() + count_;
    if (const auto at = std::find(entries_.begin(), end, entry); at != end)
      *at = entries_[--count_];
  }

  /// The object whose medium was entered first; -1: none.
  int object() const { return count_ > 0 ? entries_[0].instance : -1; }
  /// Leaves the media of objects that shadow rays do not see.
  void hide_from_shadow_rays() {
    const auto& instances = p_->geometry.instances();
    for (int i = count_; i-- > 0;)
      if (!(instances[entries_[i].instance].visible_to & kShadowRay))
        entries_[i] = entries_[--count_];
  }

  /// What passes a length of the ray without being met. `dimension` of the random numbers is used
  /// where the media vary.
  void attenuate(const Ray& ray, float length, const Random& random, std::uint32_t dimension,
                 Throughput<L>& beta) const {
    if (vary()) grids(ray, true).attenuate(inside(length), random.branch(dimension), beta);
    for (int i = 0; i < count_; ++i) {
      const PreparedMaterial<L>& m = material(i);
      if (!m.density_grid)
        carry(m, transmittance(value_of(m.values.extinction), length), length, beta);
    }
  }

  /// A ray leaves a surface from a point beside it: what lies between counts as flown, else dense
  /// media would begin below their surface.
  void leave(const Surface& surface, const Vec3f& direction) {
    beside_ = surface.offset / std::max(std::abs(dot(direction, surface.ng)), kLeastCosine);
  }

  /// The same, over a length of a ray that has just left a surface.
  void attenuate_from_surface(const Ray& ray, float length, const Random& random,
                              std::uint32_t dimension, Throughput<L>& beta) const {
    attenuate(ray, length + beside_, random, dimension, beta);
  }

  struct Flight {
    const PreparedMaterial<L>* scatterer = nullptr;  ///< none: the path arrives at `distance`
    float length = 0;
    float density = 0;  ///< per length, if it scatters
  };
  /// Density of a free path of that length, per length. Where media vary it is only near that, but
  /// the same for everybody: good for weights.
  float density(float length, const Throughput<L>& beta) const {
    const Colorf rate = rates(), share = channel_shares(beta.value);
    length += beside_;
    const Colorf through = transmittance(rate, length);
    float density = 0;
    for (int c = 0; c < 3; ++c)
      if (share[c] > 0) density += share[c] * rate[c] * through[c];
    return density;
  }
  /// Of meeting the media, per length; where they vary it is a typical one.
  Colorf rates() const {
    Colorf rate;
    for (int i = 0; i < count_; ++i) rate += material(i).typical_rate;
    return rate;
  }
  /// True inside a closed boundary that no shadow ray passes, with every light outside of it.
  bool sealed() const {
    for (int i = 0; i < count_; ++i)
      if (material(i).sealed) return true;
    return false;
  }
  /// Draws the length of a free flight from the surface that the ray has left, or from its origin: for
  /// one channel. Where media vary, `fly` draws it.
  float draw(float u_channel, float u_length, const Throughput<L>& beta) const {
    if (vary()) return std::numeric_limits<float>::infinity();
    const Colorf rate = rates(), share = channel_shares(beta.value);
    const int channel = u_channel < share.r ? 0 : (u_channel < share.r + share.g ? 1 : 2);
    if (!(rate[channel] > 0)) return std::numeric_limits<float>::infinity();
    return exponential(u_length) / rate[channel];
  }
  /// Flies the length that was drawn, at most `distance`, and multiplies `beta` by what it carries:
  /// weighted for all channels (balance heuristic), or by null collisions from `dimension` of the
  /// random numbers where the media vary.
  Flight fly(const Ray& ray, float drawn, float distance, float u_medium, const Random& random,
             std::uint32_t dimension, Throughput<L>& beta) {
    if (vary())
      return fly_by_nulls(ray, distance + beside_, u_medium, random.branch(dimension), beta);
    Flight flight;
    const bool scatters = drawn < distance + beside_;
    const float flown = std::min(drawn, distance + beside_);
    // A flight that ends before the ray's origin has no place of its own: it takes the origin.
    flight.length = std::max(flown - beside_, 0.0f);
    const Colorf rate = rates(), share = channel_shares(beta.value);
    const Colorf through = transmittance(rate, flown);
    float density = 0;
    for (int c = 0; c < 3; ++c)
      if (share[c] > 0) density += share[c] * (scatters ? rate[c] * through[c] : through[c]);
    if (count_ == 1 && rate == value_of(material(0).values.extinction))
      carry(material(0), through, flown, beta);
    else
      attenuate(ray, flown, random, dimension, beta);
    beta.multiply(1 / density);
    beside_ = 0;
    if (!scatters) return flight;
    flight.density = density;
    flight.scatterer = &scatter(ray.origin + ray.direction * flight.length, u_medium, beta);
    return flight;
  }
  /// Chooses the medium that scatters at a place; `beta` takes its coefficient.
  const PreparedMaterial<L>& scatter(const Vec3f& position, float u, Throughput<L>& beta) const {
    std::array<float, kMost> weight{};
    float sum = 0;
    for (int i = 0; i < count_; ++i) sum += weight[i] = mean_channel(material(i).rate_at(position));
    if (!(sum > 0)) {  // nothing is there
      beta.multiply(0);
      return material(0);
    }
    int chosen = 0;
    for (float left = u * sum; chosen + 1 < count_ && left >= weight[chosen]; ++chosen)
      left -= weight[chosen];
    selenite::scatter(material(chosen), position, beta);
    beta.multiply(sum / weight[chosen]);
    return material(chosen);
  }

 private:
  struct Entry {
    int instance = -1, material = -1;
    bool operator==(const Entry&) const = default;
  };
  static constexpr int kMost = 8;  // media around one point; more are left out
  static constexpr int kMostSurfaces = 1000;
  static constexpr float kLeastCosine = 0.01f;  // flatter rays soon leave a curved surface

  const PreparedMaterial<L>& material(int i) const { return p_->materials[entries_[i].material]; }

  Flight fly_by_nulls(const Ray& ray, float distance, float u_medium, const Random& random,
                      Throughput<L>& beta) {
    const Throughput<L> before = beta;
    const Ray start{ray.origin - ray.direction * beside_, ray.direction, 0, distance};
    const auto met = grids(start, false).fly(inside(distance), random, beta, channel_shares);
    Flight flight;
    flight.length = std::max((met ? *met : distance) - beside_, 0.0f);
    if (met) {
      flight.density = density(flight.length, before);
      flight.scatterer = &scatter(ray.origin + ray.direction * flight.length, u_medium, beta);
    }
    beside_ = 0;
    return flight;
  }
  /// All media, or those alone that vary.
  GridFlight<L> grids(const Ray& ray, bool varying) const {
    static_assert(kMost <= GridFlight<L>::kMost);
    GridFlight<L> flight(ray);
    for (int i = 0; i < count_; ++i)
      if (!varying || material(i).density_grid) flight.add(material(i));
    return flight;
  }
  /// Beyond the scene nothing is: a ray that leaves an open object there has left the grid too.
  float inside(float length) const { return std::min(length, 4 * p_->geometry.radius().all); }
  void push(const Entry& entry) {
    const auto end = entries_.begin() + count_;
    if (count_ < kMost && std::find(entries_.begin(), end, entry) == end)
      entries_[count_++] = entry;
  }

  static float transmittance(float sigma, float length) {
    return sigma == 0 ? 1 : std::exp(sigma * -length);
  }
  /// By channel; equal ones, as those of a grey medium, are worked out once.
  static Colorf transmittance(const Colorf& sigma, float length) {
    Colorf through(transmittance(sigma.r, length));
    if (sigma.g != sigma.r) through.g = transmittance(sigma.g, length);
    if (sigma.b != sigma.r) through.b = transmittance(sigma.b, length);
    return through;
  }
  /// `beta` takes what is `through` after a length of a medium.
  static void carry(const PreparedMaterial<L>& medium, const Colorf& through, float length,
                    Throughput<L>& beta) {
    if constexpr (L == 0) {
      beta.multiply(medium.factor(through));
    } else {
      // An endless way: nothing is left, and nothing of a derivative.
      const bool endless = length == std::numeric_limits<float>::infinity();
      Color<PathScalar<L>> factor;
      for (int c = 0; c < 3; ++c)
        factor[c] =
            chain(medium.values.extinction[c], through[c], endless ? 0 : -length * through[c]);
      beta.multiply(medium.factor(factor));
    }
  }

  static Colorf channel_shares(const Colorf& throughput) {
    const float sum = throughput.r + throughput.g + throughput.b;
    const Colorf even(1.0f / 3);
    if (!(sum > 0)) return even;
    // Derivatives may live in a channel whose light is gone.
    return L > 0 ? throughput * (0.9f / sum) + even * 0.1f : throughput / sum;
  }

  const Prepared<L>* p_;
  std::array<Entry, kMost> entries_;
  int count_ = 0;
  float beside_ = 0;  // from the surface that the ray has left to its origin, along the ray
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/aim_pilot.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "render/driver/render.h"
#include "render/lanes/lanes.h"
#include "render/prepared/prepared.h"

namespace selenite {
namespace {

/// A larger lamp is found by chance from inside a body, whatever the scene. Steradians.
constexpr float kLargeLamp = 1;
/// Lamps within this factor of each other, in solid angle, are aimed at together or not at all.
constexpr float kAlike = 3;
constexpr int kMostGroups = 3;
/// The same between lamps of which one pilot is enough.
constexpr float kSameVerdict = 1.5f;

/// Pixels on the pilot's longer side; more where a body is small in the picture.
constexpr int kSide = 40, kLongestSide = 160;
constexpr std::size_t kLeastPixels = 64, kMostPixels = 256;
constexpr int kSamples = 16;
/// By less than this aims do not pay: a fit gives pixels little weight that chance makes noisy, so it
/// loses less by them than their variance says, and with aims its iterations take several times as long.
constexpr double kLeastGain = 3;
constexpr double kLeastRatio = 1e-3;  // noise of the estimate can make an excess negative
constexpr std::uint64_t kSeed = 0x61696d;

/// Times in units of a vertex traced in lanes: of a vertex of a path that is traced alone, and of a place
/// on a surface that is looked at on the way to a lamp.
/// Measured: docs/measurements/extremes.md, "A small lamp over a medium".
constexpr double kVertexAlone = 1.4, kExit = 2.0;

/// Mean place of an instance's surface; specks beside it do not move that.
Vec3f middle_of(const Geometry& geometry, int instance) {
  const int mesh = geometry.instances()[instance].mesh;
  const auto count = static_cast<int>(geometry.meshes()[mesh].triangles.size());
  Vec3d sum(0, 0, 0);
  double area = 0;
  for (int t = 0; t < count; ++t) {
    const auto corners = geometry.corners(instance, t);
    const Vec3d a(corners[0]), b(corners[1]), c(corners[2]);
    const double doubled_area = length(cross(b - a, c - a));
    sum = sum + (a + b + c) * (doubled_area / 3);
    area += doubled_area;
  }
  return Vec3f(area > 0 ? sum / area : sum);
}

/// Instances that hold a medium.
std::vector<int> bodies_of(const Prepared<0>& prepared) {
  std::vector<int> found;
  const auto& instances = prepared.geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (std::ranges::any_of(instances[i].materials,
                            [&](int m) { return prepared.materials[m].has_medium; }))
      found.push_back(static_cast<int>(i));
  return found;
}

/// Lamps, by their numbers in the scene, and the largest solid angle that each is seen at from a body.
struct Candidate {
  int lamp;
  float solid_angle;
};

bool may_have_medium(const Scene& scene) {
  return scene.geometry && std::ranges::any_of(scene.appearance.materials, [](const Material& m) {
           return max_channel(m.values.extinction) > 0;
         });
}

bool is_open(const Light& lamp) { return lamp.on && !lamp.aimed; }

Scene with_aims(Scene scene, std::span<const Candidate> aimed) {
  for (Light& lamp : scene.appearance.lights)
    if (is_open(lamp)) lamp.aimed = false;
  for (const Candidate& one : aimed) scene.appearance.lights[one.lamp].aimed = true;
  return scene;
}

/// As if all open lamps were aimed at: those that can be are its `aims`.
Prepared<0> all_aimed(Scene scene) {
  for (Light& lamp : scene.appearance.lights)
    if (is_open(lamp)) lamp.aimed = true;
  return {scene, SlotLayout()};
}

/// From the smallest lamp on; empty if none is open.
std::vector<Candidate> candidates_of(const Scene& scene, const Prepared<0>& prepared) {
  std::vector<Vec3f> middles;
  for (const int body : bodies_of(prepared)) middles.push_back(middle_of(prepared.geometry, body));
  std::vector<Candidate> found;
  for (const int i : prepared.aims) {
    const Light& lamp = scene.appearance.lights[i];
    if (!is_open(lamp)) continue;
    Candidate one{i, 0};
    for (const Vec3f& middle : middles)
      one.solid_angle = std::max(one.solid_angle, solid_angle_of(lamp, middle));
    if (one.solid_angle < kLargeLamp) found.push_back(one);
  }
  std::ranges::stable_sort(found, {}, &Candidate::solid_angle);
  return found;
}

/// Those of the lamps that earlier pilots aimed at; empty unless something is known of each.
std::optional<std::vector<Candidate>> all_known(const std::vector<Candidate>& lamps,
                                                const std::vector<AimVerdict>& verdicts,
                                                bool world) {
  std::vector<Candidate> aimed;
  for (const Candidate& lamp : lamps) {
    const auto alike = [&](const AimVerdict& one) {
      const auto [less, more] = std::minmax(one.solid_angle, lamp.solid_angle);
      return one.beside_world == world && more <= kSameVerdict * less;
    };
    const auto found = std::ranges::find_if(verdicts, alike);
    if (found == verdicts.end()) return std::nullopt;
    if (found->aimed) aimed.push_back(lamp);
  }
  return aimed;
}

/// Ends of groups of lamps of about one size, at most `kMostGroups`.
std::vector<std::size_t> groups_of(const std::vector<Candidate>& lamps) {
  std::vector<std::size_t> ends;
  float first = 0;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const bool begins = i == 0 || lamps[i].solid_angle > kAlike * first;
    if (begins) first = lamps[i].solid_angle;
    if (begins && i > 0 && ends.size() + 1 < kMostGroups) ends.push_back(i);
  }
  if (!lamps.empty()) ends.push_back(lamps.size());
  return ends;
}

/// A picture in the shape of another one, with that many pixels on its longer side.
RenderSettings scaled(RenderSettings like, int side) {
  const double scale = static_cast<double>(side) / std::max(like.width, like.height);
  like.width = std::max(1, static_cast<int>(std::lround(like.width * scale)));
  like.height = std::max(1, static_cast<int>(std::lround(like.height * scale)));
  return like;
}

/// Pixels through which a body is seen.
std::vector<std::size_t> body_pixels(const Prepared<0>& prepared, const Camera& camera,
                                     const RenderSettings& settings) {
  const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
  const std::vector<int> bodies = bodies_of(prepared);
  std::vector<std::size_t> seen;
  for (int y = 0; y < settings.height; ++y)
    for (int x = 0; x < settings.width; ++x) {
      const auto hit = prepared.geometry.intersect(
          pixels.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f), kCameraRay);
      if (hit && std::ranges::find(bodies, hit->instance) != bodies.end())
        seen.push_back(static_cast<std::size_t>(y) * settings.width + x);
    }
  return seen;
}

/// A small picture of the bodies, of at most `kMostPixels` of their pixels.
RenderSettings pilot_of(const Prepared<0>& prepared, const Camera& camera,
                        const RenderSettings& like) {
  RenderSettings settings = scaled(like, kSide);
  std::vector<std::size_t> seen = body_pixels(prepared, camera, settings);
  for (int side = 2 * kSide; seen.size() < kLeastPixels && side <= kLongestSide; side *= 2) {
    settings = scaled(like, side);
    seen = body_pixels(prepared, camera, settings);
  }
  settings.lanes = 0;
  settings.spp = kSamples;
  settings.seed = kSeed;
  settings.aim_pilot = true;
  settings.pixels = nullptr;
  if (seen.empty()) return settings;
  const auto mask = std::make_shared<PixelMask>(
      static_cast<std::size_t>(settings.width) * settings.height, std::uint8_t{0});
  const std::size_t count = std::min(seen.size(), kMostPixels);
  for (std::size_t i = 0; i < count; ++i) (*mask)[seen[i * seen.size() / count]] = 1;
  settings.pixels = mask;
  return settings;
}

double cost_of(const Film& aimed) {
  return static_cast<double>(aimed.vertices) * kVertexAlone +
         static_cast<double>(aimed.exits) * kExit;
}

/// 1 / brightness^2 of each pixel, so that noise counts as a share of what is seen.
std::vector<double> weights_of(const Film& film) {
  std::vector<double> found(film.size());
  double sum = 0;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < film.size(); ++i) {
    found[i] = static_cast<double>(mean_channel(film.mean[i]));
    sum += found[i];
    seen += found[i] > 0;
  }
  const double floor = seen > 0 ? 0.3 * sum / static_cast<double>(seen) : 0;
  for (double& x : found) x = x > 0 ? 1 / square(x + floor) : 0;
  return found;
}

/// Logarithm of the noise without aims over that with them.
double log_ratio(const Picture& variance, const Picture& excess,
                 const std::vector<double>& weights) {
  double with = 0, beyond = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    with += weights[i] * static_cast<double>(mean_channel(variance[i]));
    beyond += weights[i] * static_cast<double>(mean_channel(excess[i]));
  }
  return with > 0 ? std::log(std::max(1 + beyond / with, kLeastRatio)) : 0;
}

/// By how much less noise times cost there is with aims; the derivatives count as much as the picture.
double gain_of(const Film& aimed, bool plain_by_lanes) {
  const std::vector<double> weights = weights_of(aimed);
  double log_gain = log_ratio(aimed.variance, aimed.aim_excess, weights);
  if (!aimed.slots.empty()) {
    double sum = 0;
    for (const SlotFilm& slot : aimed.slots)
      sum += log_ratio(slot.variance, slot.aim_excess, weights);
    log_gain = (log_gain + sum / static_cast<double>(aimed.slots.size())) / 2;
  }
  const double vertices = static_cast<double>(aimed.vertices);
  const double plain = vertices * (plain_by_lanes ? 1 : kVertexAlone);
  return std::exp(log_gain) * plain / cost_of(aimed);
}

}  // namespace

float solid_angle_of(const Light& lamp, const Vec3f& place) {
  if (lamp.kind == LightKind::kSun) return 2 * kPi<float> * lamp.one_minus_cos_sun;
  const Vec3f apart = lamp.position - place;
  return lamp.area > 0 ? lamp.area / dot(apart, apart) : 0;
}

bool has_undecided_aims(const Scene& scene) {
  return std::ranges::any_of(scene.appearance.lights, is_open);
}

Scene decide_aims(Scene scene, const Camera& camera, const SlotLayout& layout,
                  const RenderSettings& like, std::vector<AimVerdict>* verdicts,
                  Progress* progress) {
  if (!has_undecided_aims(scene)) return scene;
  if (!may_have_medium(scene)) return with_aims(std::move(scene), {});
  const Prepared<0> prepared = all_aimed(scene);
  const std::vector<Candidate> lamps = candidates_of(scene, prepared);
  if (lamps.empty()) return with_aims(std::move(scene), {});
  const bool world = scene.appearance.world.on;
  if (verdicts)
    if (const auto known = all_known(lamps, *verdicts, world))
      return with_aims(std::move(scene), *known);

  const RenderSettings settings = pilot_of(prepared, camera, like);
  const Scene plain = with_aims(scene, {});
  const bool plain_by_lanes = lanes_obstacle(Prepared<0>(plain, SlotLayout())).empty();
  double best = kLeastGain;
  std::size_t chosen = 0;
  for (const std::size_t end : groups_of(lamps)) {
    const Scene aimed = with_aims(scene, std::span<const Candidate>(lamps.data(), end));
    const Film film = render(aimed, camera, layout, settings, progress);
    if (const double gain = gain_of(film, plain_by_lanes); gain > best) {
      best = gain;
      chosen = end;
    }
  }
  if (verdicts)
    for (std::size_t i = 0; i < lamps.size(); ++i)
      verdicts->push_back({lamps[i].solid_angle, world, i < chosen});
  return with_aims(std::move(scene), std::span<const Candidate>(lamps.data(), chosen));
}

}  // namespace selenite

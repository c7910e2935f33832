// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/world.h"

#include <algorithm>
#include <string>

#include "math/fault.h"

namespace selenite {
namespace {

float luminance(const Colorf& c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }

/// What counts for sampling: a direction of negative light is left to the bsdf.
float weight_of(const Colorf& c) { return std::max(luminance(c), 0.0f); }

/// Index of the step of a cumulative table that holds `x`; the position inside it goes back into x.
int pick(const float* cdf, int count, float& x) {
  const float* upper = std::upper_bound(cdf, cdf + count, x);
  const int i = std::min(static_cast<int>(upper - cdf), count - 1);
  const float below = i > 0 ? cdf[i - 1] : 0;
  const float step = cdf[i] - below;
  x = step > 0 ? clamp((x - below) / step, 0.0f, 0x1.fffffep-1f) : 0.5f;
  return i;
}

void require_rotation(const std::array<Vec3f, 3>& to_map) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j)
      if (!(std::abs(dot(to_map[i], to_map[j]) - (i == j ? 1 : 0)) < 1e-4f))
        throw Refused("World", "the mapping of its image is not a rotation",
                      "set the scale of the Mapping node to 1");
}

}  // namespace

EnvironmentMap::EnvironmentMap(int width, int height, std::vector<Colorf> pixels, float even,
                               std::optional<SunDisc> sun)
    : width_(width), height_(height), pixels_(std::move(pixels)), sun_(std::move(sun)) {
  if (width < 1 || height < 1 || pixels_.size() != static_cast<std::size_t>(width) * height)
    throw Refused(
        "World image",
        std::to_string(width) + " x " + std::to_string(height) + " pixels do not match the data",
        "give an image of at least 1 x 1 pixel");
  for (const Colorf& c : pixels_)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(c[k]))
        throw Refused("World image", "a pixel is infinite or not a number", "repair the file");

  // Bilinear lookups reach one pixel further than the pixel itself: the table takes the 3x3 maximum,
  // so that no direction with radiance has zero density.
  std::vector<float> weight(pixels_.size());
  double sum = 0, solid = 0;
  for (int y = 0; y < height; ++y) {
    const float sine = std::sin(kPi<float> * (y + 0.5f) / height);
    for (int x = 0; x < width; ++x) {
      float largest = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int yy = std::clamp(y + dy, 0, height - 1), xx = (x + dx + width) % width;
          largest =
              std::max(largest, weight_of(pixels_[static_cast<std::size_t>(yy) * width + xx]));
        }
      const float own = weight_of(pixels_[static_cast<std::size_t>(y) * width + x]);
      weight[static_cast<std::size_t>(y) * width + x] = (0.5f * own + 0.5f * largest) * sine;
      sum += own * sine;
      cycles_sum_ +=
          std::max(mean_channel(pixels_[static_cast<std::size_t>(y) * width + x]), 0.0f) * sine;
      solid += sine;
    }
  }
  mean_ = static_cast<float>(sum / solid);
  if (sun_ && sun_->flux() > 0) {
    // Neither is left without samples.
    const double of_sun = sun_->flux() / (4 * kPi<double>);
    sun_share_ = static_cast<float>(std::clamp(of_sun / (of_sun + mean_), 0.1, 0.9));
    mean_ += static_cast<float>(of_sun);
  }
  if (even > 0) {
    double weighted = 0;
    for (const float one : weight) weighted += one;
    // A black image is sampled evenly alone.
    const double base = weighted > 0 ? even / (1 - even) * weighted / solid : 1;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        weight[static_cast<std::size_t>(y) * width + x] +=
            static_cast<float>(base * std::sin(kPi<float> * (y + 0.5f) / height));
  }

  row_cdf_.resize(height);
  column_cdf_.resize(pixels_.size());
  double total = 0;
  for (int y = 0; y < height; ++y) {
    double row = 0;
    float* columns = &column_cdf_[static_cast<std::size_t>(y) * width];
    for (int x = 0; x < width; ++x) {
      row += weight[static_cast<std::size_t>(y) * width + x];
      columns[x] = static_cast<float>(row);
    }
    for (int x = 0; x < width; ++x)
      columns[x] = row > 0 ? static_cast<float>(columns[x] / row) : (x + 1.0f) / width;
    total += row;
    row_cdf_[y] = static_cast<float>(total);
  }
  for (int y = 0; y < height; ++y)
    row_cdf_[y] = total > 0 ? static_cast<float>(row_cdf_[y] / total) : (y + 1.0f) / height;
}

EnvironmentMap::Corners EnvironmentMap::corners(const Vec3f& d) const {
  const float u = 0.5f - std::atan2(d.y, d.x) * (0.5f * kInvPi<float>);
  const float v = 0.5f - std::asin(clamp(d.z, -1.0f, 1.0f)) * kInvPi<float>;  // from the top
  const float x = u * width_ - 0.5f, y = v * height_ - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  const auto texel = [&](int i, int j) {
    const int column = ((i % width_) + width_) % width_, row = std::clamp(j, 0, height_ - 1);
    return static_cast<std::uint32_t>(row * width_ + column);
  };
  const int i = static_cast<int>(fx), j = static_cast<int>(fy);
  const float a = x - fx, b = y - fy;
  return {{{{texel(i, j), (1 - a) * (1 - b)},
            {texel(i + 1, j), a * (1 - b)},
            {texel(i, j + 1), (1 - a) * b},
            {texel(i + 1, j + 1), a * b}}},
          b};
}

Colorf EnvironmentMap::radiance(const Vec3f& d) const {
  Colorf sum;
  for (const auto& [pixel, share] : corners(d).at) sum += pixels_[pixel] * share;
  if (sun_) sum += sun_->radiance(d);
  return sum;
}

Colorf EnvironmentMap::azimuth_slope(const Vec3f& d) const {
  const auto [at, down] = corners(d);
  const auto step = [&](const Corner& left, const Corner& right) {
    return pixels_[right.pixel] - pixels_[left.pixel];
  };
  // The image's columns run against the azimuth.
  const float columns = -static_cast<float>(width_) * 0.5f * kInvPi<float>;
  return (step(at[0], at[1]) * (1 - down) + step(at[2], at[3]) * down) * columns;
}

EnvironmentMap::Place EnvironmentMap::place(const Vec3f& d) const {
  const float u = 0.5f - std::atan2(d.y, d.x) * (0.5f * kInvPi<float>);
  const float v = 0.5f - std::asin(clamp(d.z, -1.0f, 1.0f)) * kInvPi<float>;
  const float sine = std::hypot(d.x, d.y);  // 1 - z^2 has no digits left near the poles
  return {
      std::clamp(static_cast<int>(u * width_), 0, width_ - 1),
      std::clamp(static_cast<int>(v * height_), 0, height_ - 1),
      sine > 0 ? static_cast<float>(width_) * height_ / (2 * kPi<float> * kPi<float> * sine) : 0};
}

float EnvironmentMap::density(const Vec3f& d) const {
  if (!sun_) return image_density(d);
  return (1 - sun_share_) * image_density(d) + sun_share_ * sun_->density(d);
}

float EnvironmentMap::image_density(const Vec3f& d) const {
  const auto [x, y, per_share] = place(d);
  const float* columns = &column_cdf_[static_cast<std::size_t>(y) * width_];
  const float row = row_cdf_[y] - (y > 0 ? row_cdf_[y - 1] : 0);
  const float column = columns[x] - (x > 0 ? columns[x - 1] : 0);
  return row * column * per_share;
}

float EnvironmentMap::cycles_density(const Vec3f& d) const {
  const float of_sun = sun_ ? kCyclesSunShare * sun_->density(d) : 0;
  if (!(cycles_sum_ > 0)) return of_sun;
  const auto [x, y, per_share] = place(d);
  const float own = std::max(mean_channel(pixels_[static_cast<std::size_t>(y) * width_ + x]), 0.0f);
  const float share =
      own * std::sin(kPi<float> * (y + 0.5f) / height_) / static_cast<float>(cycles_sum_);
  return share * per_share * (sun_ ? 1 - kCyclesSunShare : 1) + of_sun;
}

Vec3f EnvironmentMap::sample(float u1, float u2, float& density_out) const {
  Vec3f d;
  if (u1 < sun_share_) {
    d = sun_->sample(u1 / sun_share_, u2);
  } else {
    // Without a sun the number goes on bit by bit.
    d = sample_image(sun_ ? (u1 - sun_share_) / (1 - sun_share_) : u1, u2);
  }
  density_out = density(d);
  return d;
}

Vec3f EnvironmentMap::sample_image(float u1, float u2) const {
  const int y = pick(row_cdf_.data(), height_, u1);
  const int x = pick(&column_cdf_[static_cast<std::size_t>(y) * width_], width_, u2);
  const float u = (x + u2) / width_, v = (y + u1) / height_;
  const float azimuth = (0.5f - u) * 2 * kPi<float>, elevation = (0.5f - v) * kPi<float>;
  const float c = std::cos(elevation);
  return {c * std::cos(azimuth), c * std::sin(azimuth), std::sin(elevation)};
}

void World::check() const {
  for (const Backdrop& one : backdrops) {
    if (!one.map) throw Refused("World", "a backdrop has no image", "give it one");
    require_rotation(one.to_map);
  }
  for (int c = 0; c < 3; ++c)
    if (!(values.color[c] >= 0) || !std::isfinite(values.color[c]))
      throw Refused("World", "colour = " + std::to_string(values.color[c]) + " is not permitted",
                    "set it to a finite number, at least 0");
  if (!(values.strength >= 0) || !std::isfinite(values.strength))
    throw Refused("World", "strength = " + std::to_string(values.strength) + " is not permitted",
                  "set it to a finite number, at least 0");
  if (!std::isfinite(values.rotation))
    throw Refused("World", "rotation = " + std::to_string(values.rotation) + " is not permitted",
                  "set it to a finite number");
  require_rotation(to_map);
}

Colorf World::factor(const Vec3f& d) const {
  if (!on) return {};
  if (!map) return {1, 1, 1};
  return map->radiance(to_map_frame(d));
}
Colorf World::rotation_slope(const Vec3f& d) const {
  if (!map || !on) return {};
  return map->azimuth_slope(to_map_frame(d));
}
World World::at_rotation_0() const {
  World same = *this;
  if (values.rotation == 0) return same;
  const double c = std::cos(values.rotation), s = std::sin(values.rotation);
  const Vec3d x(to_map[0]), y(to_map[1]);
  same.to_map[0] = Vec3f(x * c - y * s);
  same.to_map[1] = Vec3f(x * s + y * c);
  same.values.rotation = 0;
  return same;
}
float World::density(const Vec3f& d) const {
  if (!map || !on) return 0;
  return map->density(to_map_frame(d));
}
float World::cycles_density(const Vec3f& d) const {
  if (!map || !on) return 0;
  return map->cycles_density(to_map_frame(d));
}
Vec3f World::sample(float u1, float u2, float& density_out) const {
  const Vec3f d = rotated(map->sample(u1, u2, density_out), -values.rotation);
  return to_map[0] * d.x + to_map[1] * d.y + to_map[2] * d.z;
}

}  // namespace selenite

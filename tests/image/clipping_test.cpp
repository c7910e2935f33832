// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/clipping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kSize = 96;
using Picture = std::vector<double>;

class Scene {
 public:
  explicit Scene(unsigned seed) : random_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  /// A sum of waves in [0, 1]: smooth, with maxima inside.
  Picture smooth() {
    Picture picture(kSize * kSize, 0.0);
    for (int wave = 0; wave < 4; ++wave) {
      const double a = uniform(-6, 6), b = uniform(-6, 6), phase = uniform(0, 6.3),
                   height = uniform(0.3, 1);
      for (int i = 0; i < kSize * kSize; ++i)
        picture[i] +=
            height *
            std::cos(2 * std::numbers::pi * (a * (i % kSize) + b * (i / kSize)) / kSize + phase);
    }
    return scaled(picture, 1, *std::min_element(picture.begin(), picture.end()));
  }
  /// Highlights on a smooth ground.
  Picture highlights() {
    Picture picture = scaled(smooth(), 0.3);
    for (int k = 0; k < 3; ++k) {
      const double x = uniform(20, 76), y = uniform(20, 76), width = uniform(4, 20),
                   height = uniform(0.4, 1);
      for (int i = 0; i < kSize * kSize; ++i) {
        const double r2 = std::pow(i % kSize - x, 2) + std::pow(i / kSize - y, 2);
        picture[i] += height * std::exp(-r2 / (2 * width * width));
      }
    }
    return scaled(picture, 1);
  }
  /// An evenly lit disc, brighter than all else, with an edge that a box filter of a pixel blurs.
  Picture even_disc(double level) {
    const double x = uniform(30, 66), y = uniform(30, 66), radius = uniform(8, 25);
    Picture picture = scaled(smooth(), 0.9 * level);
    for (int i = 0; i < kSize * kSize; ++i) {
      int inside = 0;
      for (int k = 0; k < 64; ++k) {
        const double u = i % kSize + (k % 8 + 0.5) / 8 - x, v = i / kSize + (k / 8 + 0.5) / 8 - y;
        inside += u * u + v * v < radius * radius;
      }
      picture[i] += (level - picture[i]) * inside / 64.0;
      if (inside == 64) picture[i] = level;
    }
    return picture;
  }
  Picture noisy(Picture picture, double amount) {
    Normal<double> normal(0, amount);
    for (double& value : picture) value = std::max(0.0, value * (1 + normal(random_)));
    return picture;
  }
  static Picture scaled(Picture picture, double maximum, double offset = 0) {
    for (double& value : picture) value -= offset;
    const double top = *std::max_element(picture.begin(), picture.end());
    for (double& value : picture) value *= maximum / top;
    return picture;
  }

 private:
  std::mt19937 random_;
};

/// An even sky over the upper part of the picture that ends in a ramp of `ramp` pixels, as one of
/// coarse texels does. `value` is what lies below, `sky` above.
Picture with_sky(const Picture& value, double sky, int horizon, int ramp) {
  Picture picture = value;
  for (int i = 0; i < kSize * kSize; ++i) {
    const double share = std::clamp((horizon + ramp - i / kSize) / double(ramp), 0.0, 1.0);
    picture[i] = share * sky + (1 - share) * value[i];
  }
  return picture;
}

/// A grey picture of these numbers: floats, halves, 16 bits, 12 bits shifted, or 8 bits.
enum class Numbers { kFloat, kHalf, k16, k12, k8 };
constexpr std::array kNumbers{Numbers::kFloat, Numbers::kHalf, Numbers::k16, Numbers::k12,
                              Numbers::k8};

Samples samples(const Picture& picture, Numbers numbers) {
  Samples result;
  result.width = result.height = kSize;
  result.channels = 1;
  std::vector<float> floats;
  std::vector<std::uint16_t> sixteen;
  std::vector<std::uint8_t> eight;
  for (const double value : picture) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    const double half = std::ldexp(std::round(std::ldexp(mantissa, 11)), exponent - 11);
    floats.push_back(static_cast<float>(numbers == Numbers::kHalf ? half : value));
    sixteen.push_back(static_cast<std::uint16_t>(
        numbers == Numbers::k12 ? std::lround(value * 4095) * 16 : std::lround(value * 65535)));
    eight.push_back(static_cast<std::uint8_t>(std::lround(value * 255)));
  }
  if (numbers == Numbers::k8)
    result.values = eight;
  else if (numbers == Numbers::k16 || numbers == Numbers::k12)
    result.values = sixteen;
  else
    result.values = floats;
  return result;
}

/// The same of red, green and blue.
Samples samples(const std::array<Picture, 3>& pictures, Numbers numbers) {
  Samples result = samples(pictures[0], numbers);
  result.channels = 3;
  result.color = {0, 1, 2};
  std::visit(
      [&](auto& values) {
        using Values = std::decay_t<decltype(values)>;
        std::array<Values, 3> planes;
        for (std::size_t c = 0; c < 3; ++c)
          planes[c] = std::get<Values>(samples(pictures[c], numbers).values);
        values.clear();
        for (std::size_t i = 0; i < planes[0].size(); ++i)
          for (const Values& plane : planes) values.push_back(plane[i]);
      },
      result.values);
  return result;
}

int channels_clipped(const Samples& samples) {
  const auto levels = clipping_levels(samples);
  return static_cast<int>(std::count_if(
      levels.begin(), levels.end(), [](const auto& level) { return std::isfinite(level.from); }));
}

bool is_clipped(const Picture& picture, Numbers numbers) {
  return std::isfinite(clipping_levels(samples(picture, numbers))[0].from);
}

TEST(Clipping, SmoothPicturesRaiseNoFalseAlarm) {
  // 5 kinds of numbers, 3 amounts of noise, 2 of scenes, 20 seeds: 600 pictures without an alarm
  // leave a rate below 0.5 % (95 % confidence, rule of three).
  int alarms = 0, pictures = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const Numbers numbers : kNumbers) {
      for (const double noise : {0.0, 0.002, 0.02}) {
        Scene scene(seed);
        const double top = scene.uniform(0.4, 0.95);
        for (const Picture& picture : {scene.smooth(), scene.highlights()}) {
          alarms += is_clipped(Scene::scaled(scene.noisy(picture, noise), top), numbers);
          ++pictures;
        }
      }
    }
  }
  EXPECT_EQ(pictures, 600);
  EXPECT_EQ(alarms, 0);
}

TEST(Clipping, AnEvenlyLitAreaRaisesNoFalseAlarm) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    for (const Numbers numbers : kNumbers) {
      Scene scene(seed);
      EXPECT_FALSE(is_clipped(scene.even_disc(scene.uniform(0.4, 0.95)), numbers)) << seed;
    }
  }
}

TEST(Clipping, AClearSkyThatEndsSoftlyRaisesNoFalseAlarm) {
  // Brightest in all channels, or in blue alone, beside a highlight; grey as well.
  int alarms = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const Numbers numbers : {Numbers::kFloat, Numbers::kHalf, Numbers::k16}) {
      for (const double red : {0.9, 0.25}) {
        Scene scene(seed);
        const Picture ground = scene.noisy(scene.highlights(), 0.01);
        const double top = scene.uniform(0.5, 0.95);
        const int horizon = 24, ramp = 8 + static_cast<int>(seed % 6);
        std::array<Picture, 3> pictures;
        const std::array<double, 3> sky{red, 0.95, 1.0};
        for (std::size_t c = 0; c < 3; ++c)
          pictures[c] = with_sky(Scene::scaled(ground, 0.4 * top), sky[c] * top, horizon, ramp);
        alarms += channels_clipped(samples(pictures, numbers));
        alarms += is_clipped(pictures[2], numbers);
      }
    }
  }
  EXPECT_EQ(alarms, 0);
}

TEST(Clipping, ACutTopOfColoursIsFound) {
  // Levels alike in all channels or as white balance leaves them; the light may be grey or coloured.
  int found = 0, pictures = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const Numbers numbers : {Numbers::kFloat, Numbers::kHalf, Numbers::k16}) {
      for (const double balance : {1.0, 0.7}) {
        Scene scene(seed + 200);
        const Picture light = scene.highlights();
        Picture sorted = light;
        std::sort(sorted.begin(), sorted.end());
        const double level = sorted[static_cast<std::size_t>(0.95 * sorted.size())];
        const std::array<double, 3> color{1, 0.9, 0.75}, levels{balance, 1, 0.5 + balance / 2};
        std::array<Picture, 3> channels;
        for (std::size_t c = 0; c < 3; ++c) {
          channels[c] = scene.noisy(light, 0.002);
          for (double& value : channels[c])
            value = 0.8 * levels[c] * std::min(color[c] * value / level, 1.0);
        }
        found += channels_clipped(samples(channels, numbers)) > 0;
        ++pictures;
      }
    }
  }
  EXPECT_EQ(pictures, 120);
  EXPECT_GE(found, 118);
}

TEST(Clipping, ACutTopIsFoundAtAnyLevel) {
  // 97 % of the range of what a camera shows is left; below, eight bits are too coarse to know.
  int found = 0, pictures = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const Numbers numbers : {Numbers::kFloat, Numbers::kHalf, Numbers::k16, Numbers::k12}) {
      for (const double noise : {0.0, 0.002, 0.02}) {
        Scene scene(seed + 100);
        const double top = scene.uniform(0.4, 0.95);
        for (Picture picture : {scene.smooth(), scene.highlights()}) {
          picture = scene.noisy(picture, noise);
          Picture sorted = picture;
          std::sort(sorted.begin(), sorted.end());
          const double level = sorted[static_cast<std::size_t>(0.97 * sorted.size())];
          for (double& value : picture) value = std::min(value, level) * top / level;
          found += is_clipped(picture, numbers);
          ++pictures;
        }
      }
    }
  }
  EXPECT_EQ(pictures, 480);
  EXPECT_GE(found, 475);
}

TEST(Clipping, TheTopOfIntegersIsClippedWhateverItLooksLike) {
  const auto level = [](std::vector<std::uint16_t> values) {
    Samples samples{.width = 64, .height = 1, .channels = 1};
    values.resize(64, 256);
    samples.values = values;
    return clipping_levels(samples)[0].from;
  };
  EXPECT_EQ(level({65535}), 65534);
  EXPECT_EQ(level({65532, 400, 1004}), 65532);       // multiples of 4
  EXPECT_EQ(level({65520, 1600, 16}), 65520);        // of 16
  EXPECT_EQ(level({65280, 512}), 65280);             // of 256
  EXPECT_FALSE(std::isfinite(level({65532, 401})));  // not multiples of 4
  EXPECT_FALSE(std::isfinite(level({65000, 401})));
  EXPECT_EQ(level(std::vector<std::uint16_t>(16, 16383)), 16383);
  EXPECT_FALSE(std::isfinite(level(std::vector<std::uint16_t>(15, 16383))));
}

TEST(Clipping, OneInFloatsIsClippedUnlessItIsAnEvenArea) {
  Scene scene(7);
  Picture picture = Scene::scaled(scene.highlights(), 1.6);
  for (double& value : picture) value = std::min(value, 1.0);
  EXPECT_EQ(clipping_levels(samples(picture, Numbers::kFloat))[0].from, 1.0);
  const ClippingLevel even = clipping_levels(samples(scene.even_disc(1.0), Numbers::kFloat))[0];
  EXPECT_FALSE(std::isfinite(even.from));
  EXPECT_TRUE(even.is_even_white);
  // One pixel at exactly 1 among floats is no chance.
  Picture single = Scene::scaled(scene.smooth(), 0.9);
  single[1000] = 1;
  EXPECT_EQ(clipping_levels(samples(single, Numbers::kFloat))[0].from, 1.0);
}

TEST(Clipping, ChannelsHaveLevelsOfTheirOwn) {
  Scene scene(3);
  Samples samples{.width = kSize, .height = kSize, .channels = 3, .color = {0, 1, 2}};
  std::vector<float> values;
  for (const double value : scene.highlights())
    values.insert(values.end(),
                  {static_cast<float>(std::min(0.5, value)), static_cast<float>(0.8 * value),
                   static_cast<float>(std::min(0.375, value))});
  samples.values = values;
  const auto levels = clipping_levels(samples);
  EXPECT_FLOAT_EQ(levels[0].from, 0.5f);
  EXPECT_FALSE(std::isfinite(levels[1].from));
  EXPECT_FLOAT_EQ(levels[2].from, 0.375f);
}

}  // namespace
}  // namespace selenite

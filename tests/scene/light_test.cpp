// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/light.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "math/error.h"
#include "math/rng.h"
#include "math/sampling.h"
#include "math/statistics.h"
#include "scene/small_scenes.h"

// Radiometry of every kind of lamp: what `sample` brings, what uniform directions through
// `intersect` bring, and the closed forms of docs/method/rendering.md are one number.
namespace selenite {
namespace {

constexpr double kPi2 = kPi<double>;
constexpr float kFar = std::numeric_limits<float>::infinity();

Light lamp(LightKind kind, double radius, bool soft, const Transform& at) {
  Light light;
  light.name = "Lamp";
  light.kind = kind;
  light.radius = radius;
  light.soft_falloff = soft;
  light.to_world = at;
  return light;
}
Light area(double sx, double sy, bool ellipse, const Transform& at) {
  Light light = lamp(LightKind::kArea, 0, true, at);
  light.size_x = sx;
  light.size_y = sy;
  light.ellipse = ellipse;
  return light;
}
Light with(Light light, const std::function<void(Light&)>& change) {
  change(light);
  return light;
}

/// Form factor of a 2a x 2b rectangle seen from distance 1 below its centre.
double rectangle_factor(double a, double b) {
  const double sa = std::sqrt(1 + a * a), sb = std::sqrt(1 + b * b);
  return 2 / kPi2 * (a / sa * std::atan(b / sa) + b / sb * std::atan(a / sb));
}
double smooth(double x) { return x * x * (3 - 2 * x); }
/// Factor of an area light's radiance towards `angle` for a spread.
double spread_factor(double spread, double angle) {
  const double t = std::tan(spread / 2);
  return t / (t - spread / 2) * std::max(0.0, 1 - std::tan(angle) / t);
}

/// A lamp and the irradiance, per watt and colour, of a floor facing up at the world's origin.
struct Case {
  const char* name;
  Light light;
  double irradiance;  ///< 0: no closed form
  double tolerance = 1e-5;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

std::vector<Case> cases() {
  using enum LightKind;
  const Vec3d above{0, 0, 2}, aside{1.2, 0, 1.6};  // both at distance 2; cosine 0.8
  const Transform up = translation(above), side = translation(aside);
  const Transform down_at = looking_at(aside, {0, 0, 0});
  const double intensity = 1 / (4 * kPi2);
  const auto old = [](Light light) {
    return with(light, [](Light& l) { l.units = LightUnits::kBlender3; });
  };
  const auto sun = [&](double angle) {
    return with(lamp(kSun, 0, true, down_at), [&](Light& l) { l.angle = angle; });
  };
  // A spot that looks past the origin: 0.2 rad off its axis.
  const Transform off_axis = looking_at(above, {2 * std::tan(0.2), 0, 0});
  const auto spot = [&](double radius, double size, double blend) {
    return with(lamp(kSpot, radius, false, off_axis), [&](Light& l) {
      l.spot_size = size;
      l.spot_blend = blend;
    });
  };
  const double blend_at = (std::cos(0.2) - std::cos(0.3)) / ((1 - std::cos(0.3)) * 0.8);
  const auto spread = [&](Light light, double s) {
    return with(light, [&](Light& l) { l.spread = s; });
  };
  const Transform tilted = matrix({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, aside);  // looks straight down
  const Transform stretched = matrix({3, 0, 0}, {0, 0.5, 0}, {0, 0, 7}, above);
  const Transform mirrored = matrix({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, above);
  return {
      {"Point", lamp(kPoint, 0, true, side), intensity / 4 * 0.8},
      {"PointBlender3", old(lamp(kPoint, 0, true, side)), intensity / 4 * 0.8},
      {"PointScaledBy2Stops",
       with(lamp(kPoint, 0, true, side), [](Light& l) { l.radiance_scale = 4; }), intensity * 0.8},
      {"SoftDisc", lamp(kPoint, 0.5, true, up), intensity / (4 + 0.25), 2e-3},
      {"LargeSoftDisc", lamp(kPoint, 3, true, up), intensity / (4 + 9), 2e-3},
      {"SoftDiscAside", lamp(kPoint, 0.5, true, side), 0},
      {"Sphere", lamp(kPoint, 0.5, false, side), intensity / 4 * 0.8, 2e-3},
      {"TinySphere", lamp(kPoint, 1e-3, false, side), intensity / 4 * 0.8, 2e-3},
      {"SphereThatTouchesTheHorizon", lamp(kPoint, 1.5, false, side), intensity / 4 * 0.8, 4e-3},
      {"SphereAround", lamp(kPoint, 3, false, up), 1 / (4 * kPi2 * 9), 4e-3},
      {"Sun", sun(0), 0.8},
      {"SunOfHalfADegree", sun(0.00918), 0.8, 1e-4},
      {"WideSun", sun(1), 0.8, 2e-3},
      {"WideSunBlender3", old(sun(1)), 0.8 * square(std::cos(0.5)), 2e-3},
      {"SpotInsideItsCone", spot(0, 0.6, 0), intensity / 4},
      {"SpotOutsideItsCone", spot(0, 0.39, 0), 0},
      {"SpotInItsBlend", spot(0, 0.6, 0.8), intensity / 4 * smooth(blend_at), 1e-4},
      {"SpotInItsBlendBlender3", old(spot(0, 0.6, 0.8)),
       intensity / 4 * smooth(blend_at) * std::cos(0.2), 1e-4},
      {"SoftSpot", spot(0.3, 0.6, 0.8), 0},
      {"SpotWiderThanAHalfSpace", spot(0, kPi2, 0), intensity / 4},
      {"Square", area(2, 2, false, up), rectangle_factor(0.5, 0.5) / 4, 2e-3},
      {"Rectangle", area(4, 1, false, up), rectangle_factor(1, 0.25) / 4, 2e-3},
      {"Disk", area(2, 2, true, up), 1.0 / (1 + 4) / kPi2, 2e-3},
      {"Ellipse", area(3, 1, true, up), 0},
      {"SmallSquareAside", area(0.02, 0.02, false, tilted), 0.8 * 0.8 / 4 / kPi2, 1e-3},
      {"SmallEllipseAside", area(0.02, 0.01, true, tilted), 0.8 * 0.8 / 4 / kPi2, 1e-3},
      {"SquareBlender3", old(area(2, 2, false, up)), rectangle_factor(0.5, 0.5) / 4 * kPi2 / 4,
       2e-3},
      // Measured in Blender 3.4.1: radiance P / (4 A), A the area of the disk.
      {"DiskBlender3", old(area(2, 2, true, up)), 1.0 / (1 + 4) / kPi2 * kPi2 / 4, 2e-3},
      // 3 x 0.5 of radiance 1 / (1.5 pi).
      {"StretchedSquare", area(1, 1, false, stretched), rectangle_factor(0.75, 0.125) / 1.5, 2e-3},
      {"MirroredSquare", area(2, 2, false, mirrored), rectangle_factor(0.5, 0.5) / 4, 2e-3},
      {"NarrowSpread", spread(area(0.02, 0.02, false, tilted), 1.6),
       0.8 * 0.8 / 4 / kPi2 * spread_factor(1.6, std::acos(0.8)), 1e-2},
      {"SpreadOfNearlyEverything", spread(area(0.02, 0.02, false, tilted), 3.1),
       0.8 * 0.8 / 4 / kPi2 * spread_factor(3.1, std::acos(0.8)), 1e-2},
      {"SpreadThatMisses", spread(area(0.02, 0.02, false, tilted), 1.2), 0},
      {"LargeSquareWithSpread", spread(area(3, 3, false, up), 1.5), 0},
  };
}

class LightCase : public testing::TestWithParam<Case> {
 protected:
  Light light() const {
    Light light = GetParam().light;
    light.prepare({});
    return light;
  }
};

/// Sampled irradiance of a floor facing up at the origin.
Estimate by_sampling(const Light& light, int count) {
  Tally tally;
  Random random(1, 0, 0);
  for (int i = 0; i < count; ++i) {
    random.start_bounce(i);
    const auto s = light.sample({0, 0, 0}, random.uniform(0), random.uniform(1));
    tally.add(s ? s->factor * std::max(s->direction.z, 0.0f) / double(s->density) : 0);
  }
  return tally.estimate();
}

/// The same by uniform directions of a cone that holds the lamp.
Estimate by_searching(const Light& light, int count) {
  // Lamps here lie within 75 degrees of +z or everywhere; small ones need a narrow cone.
  const Vec3d centre =
      light.kind == LightKind::kSun ? Vec3d(light.axis) * -1e6 : light.to_world.translation();
  const double size = light.kind == LightKind::kSun    ? 1e6 * std::tan(light.angle / 2)
                      : light.kind == LightKind::kArea ? length(light.u) + length(light.v)
                                                       : light.radius;
  const double distance = length(centre);
  const double width =
      size * 1.01 < distance * 0.9 ? 1 - std::sqrt(1 - square(size * 1.01 / distance)) : 2.0;
  const Frame<double> frame = Frame<double>::from_normal(normalize(centre));
  Tally tally;
  Random random(2, 0, 0);
  for (int i = 0; i < count; ++i) {
    random.start_bounce(i);
    const Vec3d local = square_to_cone<double>(random.uniform(0), random.uniform(1), width);
    const Vec3f direction(normalize(frame.to_world(local)));
    const auto hit = light.intersect({0, 0, 0}, direction, 0, kFar);
    tally.add(hit ? hit->factor * std::max(direction.z, 0.0f) * 2 * kPi2 * width : 0);
  }
  return tally.estimate();
}

TEST_P(LightCase, IrradianceIsThatOfTheClosedForm) {
  const Case& c = GetParam();
  const Estimate sampled = by_sampling(light(), 200000);
  if (c.irradiance > 0) {
    EXPECT_NEAR(sampled.mean, c.irradiance, c.tolerance * c.irradiance);
  }
  const bool dark = std::string(c.name).starts_with("SpotOutside") ||
                    std::string(c.name).starts_with("SpreadThat");
  EXPECT_EQ(sampled.mean == 0, dark);
}

TEST_P(LightCase, SamplesAndUniformDirectionsBringTheSameLight) {
  const Light light = this->light();
  if (light.is_delta()) {
    EXPECT_FALSE(light.intersect({0, 0, 0}, normalize(Vec3f(light.position)), 0, kFar));
    return;
  }
  const Estimate sampled = by_sampling(light, 200000), found = by_searching(light, 400000);
  if (sampled.mean == 0) {
    EXPECT_EQ(found.mean, 0);
    return;
  }
  EXPECT_LT(std::abs(sampled.mean - found.mean),
            4 * std::hypot(sampled.error, found.error) + 1e-3 * sampled.mean);
  EXPECT_LT(found.error, 0.02 * found.mean);
}

TEST_P(LightCase, IntersectingFindsWhatWasSampledWithTheSameDensity) {
  const Light light = this->light();
  if (light.is_delta()) return;
  Random random(3, 0, 0);
  int sampled = 0, found = 0;
  for (int i = 0; i < 5000; ++i) {
    random.start_bounce(i);
    const Vec3f point{random.uniform(2) - 0.5f, random.uniform(3) - 0.5f, random.uniform(4) - 0.5f};
    const auto s = light.sample(point, random.uniform(0), random.uniform(1));
    if (!s) continue;
    ++sampled;
    EXPECT_NEAR(length(s->direction), 1, 1e-5);
    ASSERT_GT(s->density, 0);
    const auto hit = light.intersect(point, s->direction, 0, kFar);
    if (!hit) continue;  // the rim, by rounding
    ++found;
    EXPECT_NEAR(hit->density, s->density, 1e-3 * s->density);
    EXPECT_NEAR(hit->factor, s->factor, 2e-3 * s->factor + 1e-6 * light.scale);
    if (s->distance == kFar) continue;
    // The distance is where it stands: closer rays do not meet it.
    EXPECT_FALSE(light.intersect(point, s->direction, 0, s->distance * 0.999f));
    EXPECT_FALSE(light.intersect(point, s->direction, s->distance * 1.001f, kFar));
  }
  EXPECT_GE(found, sampled * 0.98);
}
INSTANTIATE_TEST_SUITE_P(Lamps, LightCase, testing::ValuesIn(cases()),
                         [](const auto& info) { return info.param.name; });

TEST(Light, AnAreaLightShinesToItsFrontOnly) {
  Light light = area(2, 2, false, looking_at({0, 0, 2}, {0, 0, 5}));
  light.prepare({});
  EXPECT_FALSE(light.sample({0, 0, 0}, 0.3f, 0.6f));
  EXPECT_FALSE(light.intersect({0, 0, 0}, {0, 0, 1}, 0, kFar));
  EXPECT_TRUE(light.sample({0, 0, 4}, 0.3f, 0.6f));
  EXPECT_TRUE(light.intersect({0, 0, 4}, {0, 0, -1}, 0, kFar));
}

TEST(Light, SunsShineFromBehindEverything) {
  Light light = lamp(LightKind::kSun, 0, true, Transform{});
  light.angle = 0.1;
  light.prepare({});
  EXPECT_TRUE(light.intersect({0, 0, 0}, {0, 0, 1}, 0, kFar));
  EXPECT_FALSE(light.intersect({0, 0, 0}, {0, 0, 1}, 0, 1e6f));
  EXPECT_FALSE(light.intersect({0, 0, 0}, normalize(Vec3f{0.06f, 0, 1}), 0, kFar));
  EXPECT_TRUE(light.intersect({0, 0, 0}, normalize(Vec3f{0.04f, 0, 1}), 0, kFar));
}

TEST(Light, SpreadKeepsThePower) {
  // Integral over the half space of radiance times cosine: pi times that of no spread.
  for (const double s : {0.1, 1.0, 2.5, 3.0}) {
    Light light = area(1, 1, false, Transform{});
    light.spread = s;
    light.prepare({});
    double sum = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      const double theta = kPi2 / 2 * (i + 0.5) / kSteps;
      const Vec3f towards_lamp(Vec3d{-std::sin(theta), 0, std::cos(theta)});
      const auto hit = light.intersect(towards_lamp * -1.0f, towards_lamp, 0, kFar);
      if (hit) sum += hit->factor * std::cos(theta) * std::sin(theta) * 2 * kPi2;
    }
    EXPECT_NEAR(sum * kPi2 / 2 / kSteps, 1, 2e-3) << "spread " << s;
  }
}

TEST(Light, PlacesItselfRelativeToTheScenesOrigin) {
  Light light = lamp(LightKind::kPoint, 0, true, translation({1e6 + 1, 5, 2}));
  light.prepare({1e6, 5, 0});
  const auto s = light.sample({0, 0, 0}, 0, 0);
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->distance, std::sqrt(5.0), 1e-6);
}

struct BadLight {
  const char* words;
  std::function<void(Light&)> spoil;
};
void PrintTo(const BadLight& b, std::ostream* out) { *out << b.words; }
class LightCheck : public testing::TestWithParam<BadLight> {};

TEST_P(LightCheck, RefusesBadValuesNamingLightAndValue) {
  Light light;
  light.name = "Key";
  EXPECT_NO_THROW(light.prepare({}));
  GetParam().spoil(light);
  try {
    light.prepare({});
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("'Key'"), std::string::npos) << text;
    EXPECT_NE(text.find(GetParam().words), std::string::npos) << text;
  }
}
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
INSTANTIATE_TEST_SUITE_P(
    Bad, LightCheck,
    testing::Values(
        BadLight{"power", [](Light& l) { l.values.power = -1; }},
        BadLight{"power", [](Light& l) { l.values.power = kNan; }},
        BadLight{"colour", [](Light& l) { l.values.color.g = -0.1; }},
        BadLight{"radius", [](Light& l) { l.radius = -1; }},
        BadLight{"radiance scale", [](Light& l) { l.radiance_scale = kNan; }},
        BadLight{"location", [](Light& l) { l.to_world.m[0][3] = kNan; }},
        BadLight{"scale", [](Light& l) { l.to_world.m = {}; }},
        BadLight{"angle", [](Light& l) { l.kind = LightKind::kSun, l.angle = 4; }},
        BadLight{"spot size", [](Light& l) { l.kind = LightKind::kSpot, l.spot_size = 0; }},
        BadLight{"spot blend", [](Light& l) { l.kind = LightKind::kSpot, l.spot_blend = 2; }},
        BadLight{"size x", [](Light& l) { l.kind = LightKind::kArea, l.size_x = 0; }},
        BadLight{"size y", [](Light& l) { l.kind = LightKind::kArea, l.size_y = kNan; }},
        BadLight{"spread", [](Light& l) { l.kind = LightKind::kArea, l.spread = 7; }}));

}  // namespace
}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/difference.h"
#include "render/media/refracted_exit.h"
#include "render/media_scenes.h"
#include "render/picture_statistics.h"
#include "render/prepared/prepared.h"

// Lamps light a medium through the surface of its body.
namespace selenite {
namespace {

Light lamp_at(const Vec3d& from, LightKind kind, double power) {
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = kind;
  lamp.values.power = power;
  lamp.to_world = looking_at(from, {0, 0, 0});
  lamp.aimed = true;
  return lamp;
}
Scene lit(const Mesh& mesh, const Material& material, const Light& lamp) {
  SceneBuilder builder;
  place(builder, mesh, builder.add_material(material));
  builder.add_light(lamp);
  add_view(builder, {0, -5, 0}, {0, 0, 0}, 60);
  return builder.build();
}
Mesh body(bool round) { return round ? sphere_mesh(1, 16) : box_mesh(0.8, 0.7, 0.6); }

double fresnel(double cosine, double ior) {
  const double through = std::sqrt(1 - (1 - square(cosine)) / square(ior));
  const double s = (cosine - ior * through) / (cosine + ior * through);
  const double p = (through - ior * cosine) / (through + ior * cosine);
  return (square(s) + square(p)) / 2;
}

class SmoothHalfSpace : public testing::TestWithParam<double> {};

TEST_P(SmoothHalfSpace, ScattersTheSunOnceAsSolvedOnPaper) {
  const double ior = GetParam(), albedo = 0.6, g = 0.4, strength = 3;
  Material m = filled_glass(0, ior, 60, albedo, g);
  SceneBuilder builder;
  place(builder, box_mesh(1, 1, 1), builder.add_material(m));
  const Vec3d to_sun = normalize(Vec3d{0.4, -1, 0.3});
  Light sun = lamp_at(to_sun, LightKind::kSun, strength);
  sun.angle = 0.02;
  builder.add_light(sun);
  add_view(builder, {0, -4, 0}, {0, 0, 0}, 500);
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(16, 64, 3, 3));
  ASSERT_TRUE(complete(film));

  // Radiance is not scaled by the squared index, as in Cycles: beams narrow without getting brighter.
  const double cosine = -to_sun.y, bent = std::sqrt(1 - (1 - square(cosine)) / square(ior));
  const double irradiance = strength * (1 - fresnel(cosine, ior)) * cosine / (bent * square(ior));
  const double phase = henyey_greenstein(g, -bent);
  const double want = (1 - fresnel(1, ior)) * irradiance * albedo * phase / (1 + 1 / bent);
  const Estimate found = mean_of(film);
  EXPECT_NEAR(found.mean, want, 4 * found.error + 2e-3 * want);
  EXPECT_LT(found.error, 0.02 * want);
}
// Most of it has come from deep inside: the sun stands behind.
TEST(SmoothSlab, ScattersTheSunOnceAsSolvedOnPaper) {
  const double ior = 1.3, albedo = 0.6, g = 0.4, strength = 3, extinction = 1.5;
  SceneBuilder builder;
  place(builder, box_mesh(8, 1, 8),  // wide: the sun shines on its sides too
        builder.add_material(filled_glass(0, ior, extinction, albedo, g)));
  const Vec3d to_sun = normalize(Vec3d{0.4, 1, 0.3});
  Light sun = lamp_at(to_sun, LightKind::kSun, strength);
  sun.angle = 0.02;
  builder.add_light(sun);
  add_view(builder, {0, -4, 0}, {0, 0, 0}, 500);
  const Film film = render_view(builder.build(), settings_of(16, 256, 3, 3));
  ASSERT_TRUE(complete(film));

  const double cosine = to_sun.y, bent = std::sqrt(1 - (1 - square(cosine)) / square(ior));
  const double irradiance = strength * (1 - fresnel(cosine, ior)) * cosine / (bent * square(ior));
  const double thickness = 2 * extinction;
  const double depths =
      (std::exp(-thickness) - std::exp(-thickness / bent)) / (1 / bent - 1);  // of scattering
  const double want =
      (1 - fresnel(1, ior)) * irradiance * albedo * henyey_greenstein(g, bent) * depths;
  const Estimate found = mean_of(film);
  EXPECT_NEAR(found.mean, want, 4 * found.error + 2e-3 * want);
  EXPECT_LT(found.error, 0.015 * want);
}

INSTANTIATE_TEST_SUITE_P(Indices, SmoothHalfSpace, testing::Values(1.05, 1.33, 1.5, 2.4));

struct Body {
  bool round;
  double roughness;
};
void PrintTo(const Body& b, std::ostream* out) {
  *out << (b.round ? "ball" : "box") << " of roughness " << b.roughness;
}
class LampThroughASurface : public testing::TestWithParam<Body> {};

TEST_P(LampThroughASurface, CannotBeToldFromAnEmissiveMesh) {
  // Nobody aims at a mesh: its light is found by chance.
  const auto [round, roughness] = GetParam();
  const double half = 1, power = 1500, height = 4.6;  // small enough to be aimed at
  const Material m = filled_glass(roughness, 1.4, 1.5, 0.9, 0.3);
  Light lamp = lamp_at({0, 0, height}, LightKind::kArea, power);
  lamp.size_x = lamp.size_y = 2 * half;
  const Film aimed = render_view(lit(body(round), m, lamp), settings_of(24, 192));
  SceneBuilder builder;
  place(builder, body(round), builder.add_material(m));
  place(builder, quad_mesh(half),
        builder.add_material(emitter("Panel", power / (kPi<double> * square(2 * half)))),
        translation({0, 0, height}));
  add_view(builder, {0, -5, 0}, {0, 0, 0}, 60);
  const Film met = render_view(builder.build(), settings_of(24, 3072));
  ASSERT_TRUE(complete(aimed) && complete(met));
  for (int c = 0; c < 3; ++c) {
    const Estimate a = mean_of(aimed, c), b = mean_of(met, c);
    EXPECT_LT(std::abs(a.z(b)), 4) << a.mean << " and " << b.mean;
    EXPECT_LT(std::hypot(a.error, b.error), 0.035 * a.mean);
    RecordProperty("error_per_light_" + std::to_string(c),
                   std::to_string(std::hypot(a.error, b.error) / a.mean));
  }
}

TEST_P(LampThroughASurface, IsFoundHoweverSmallItIs) {
  const auto [round, roughness] = GetParam();
  const Material m = filled_glass(roughness, 1.4, 1.5, 0.9, 0.3);
  double mean[3];
  const double radii[] = {0, 1e-3, 0.1};
  const LightKind kind = LightKind::kPoint;
  for (int i = 0; i < 3; ++i) {
    Light lamp = lamp_at({1, -2, 3}, kind, 400);
    lamp.radius = radii[i];
    const Film film = render_view(lit(body(round), m, lamp), settings_of(24, 128));
    ASSERT_TRUE(complete(film));
    const Estimate e = mean_of(film);
    mean[i] = e.mean;
    EXPECT_LE(e.error, 0.05 * e.mean) << radii[i];
  }
  if (roughness > 0)
    EXPECT_NEAR(mean[0], mean[1], 0.06 * mean[0]);
  else
    EXPECT_EQ(mean[0], 0);  // a lamp without size, as in Cycles
  EXPECT_GT(mean[1], 0);
  EXPECT_NEAR(mean[1], mean[2], 0.15 * mean[2]);
}
INSTANTIATE_TEST_SUITE_P(Bodies, LampThroughASurface,
                         testing::Values(Body{true, 0}, Body{true, 0.15}, Body{true, 0.4},
                                         Body{false, 0}, Body{false, 0.25}));

TEST(LampThroughASurface, MayStandBesideTheBody) {
  // Its box reaches into the body's, so light might be seen from inside.
  const Material m = filled_glass(0.2, 1.4, 1.5, 0.9, 0.3);
  Light near = lamp_at({0.95, 0, 0.95}, LightKind::kPoint, 20);
  near.radius = 0.05;
  const Film film = render_view(lit(body(true), m, near), settings_of(24, 256));
  const Estimate e = mean_of(film);
  EXPECT_LT(e.error, 0.08 * e.mean);
  // The same at a tenth of the size, where nothing else changes.
  Material dense = m;
  dense.values.extinction = m.values.extinction * 10.0;
  Light small = lamp_at({0.095, 0, 0.095}, LightKind::kPoint, 0.2);
  small.radius = 0.005;
  SceneBuilder builder;
  place(builder, sphere_mesh(0.1, 16), builder.add_material(dense));
  builder.add_light(small);
  add_view(builder, {0, -0.5, 0}, {0, 0, 0}, 60);
  builder.cameras.back().clip_start = 0.01;
  const Estimate tenth = mean_of(render_view(builder.build(), settings_of(24, 256)));
  EXPECT_LT(std::abs(e.z(tenth)), 4) << e.mean << " and " << tenth.mean;
}

Estimate lit_under(const std::vector<Light>& lamps, double sky, bool blocked = false) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 16), builder.add_material(filled_glass(0.1, 1.4, 1.5, 0.9, 0.3)));
  if (blocked)  // black, on the way from {1, -2, 3}
    place(builder, quad_mesh(0.6), builder.add_material(emitter("Blocker", 0)),
          translation({0.6, -1.2, 1.8}));
  for (const Light& lamp : lamps) builder.add_light(lamp);
  add_view(builder, {0, -5, 0}, {0, 0, 0}, 60);
  set_sky(builder, sky);
  if (sky > 0)  // an image is sampled beside the lamps
    builder.appearance.world.map = std::make_shared<EnvironmentMap>(4, 2, Picture(8, Colorf(1)));
  return mean_of(render_view(builder.build(), settings_of(24, 256)));
}

TEST(LampThroughASurface, AddsUpWithOtherLight) {
  Light left = lamp_at({1, -2, 3}, LightKind::kPoint, 400), right = left;
  right.name = "Right";
  right.to_world = looking_at({-2, -2, 1}, {0, 0, 0});
  right.values.power = 100;
  constexpr double kSky = 0.3;
  const Estimate a = lit_under({left}, 0), b = lit_under({right}, 0), c = lit_under({}, kSky);
  const Estimate all = lit_under({left, right}, kSky);
  const double sum = a.mean + b.mean + c.mean;
  const double error = std::hypot(std::hypot(a.error, b.error), std::hypot(c.error, all.error));
  EXPECT_LT(std::abs(all.mean - sum), 4 * error) << all.mean << " and " << sum;
  EXPECT_LT(error, 0.03 * sum);
}

// Paths find the large one by themselves.
TEST(LampThroughASurface, IsAimedAtBesideOneThatIsNot) {
  Light small = lamp_at({1, -2, 3}, LightKind::kPoint, 400);
  small.radius = 0.1;
  Light large = lamp_at({-2, -2, 1}, LightKind::kArea, 200);
  large.name = "Large";
  large.size_x = large.size_y = 2;
  large.aimed = false;
  const Estimate a = lit_under({small}, 0), b = lit_under({large}, 0);
  const Estimate both = lit_under({small, large}, 0);
  const double error = std::hypot(std::hypot(a.error, b.error), both.error);
  EXPECT_LT(std::abs(both.mean - a.mean - b.mean), 4 * error) << both.mean;
  EXPECT_LT(error, 0.05 * both.mean);

  const auto prepared = [](const std::vector<Light>& lamps) {
    SceneBuilder builder;
    place(builder, sphere_mesh(1, 16), builder.add_material(filled_glass(0.1, 1.4, 1.5, 0.9, 0.3)));
    for (const Light& lamp : lamps) builder.add_light(lamp);
    return std::make_unique<Prepared<0>>(builder.build(), SlotLayout());
  };
  EXPECT_EQ(prepared({large, small})->aims, std::vector<int>{1});
  EXPECT_FALSE(prepared({large, small})->boundaries.empty());
  EXPECT_TRUE(prepared({large})->boundaries.empty());
}

TEST(LampThroughASurface, PassesABlockerWhereTheLampCastsNoShadows) {
  Light lamp = lamp_at({1, -2, 3}, LightKind::kPoint, 400);
  const Estimate shadow = lit_under({lamp}, 0, true);
  lamp.casts_shadows = false;
  const Estimate plain = lit_under({lamp}, 0), blocked = lit_under({lamp}, 0, true);
  EXPECT_LT(std::abs(plain.z(blocked)), 4) << plain.mean << " and " << blocked.mean;
  EXPECT_LT(shadow.mean, 0.5 * plain.mean) << "else nothing is shown";
}

Scene glass_ball(int rings) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, rings), builder.add_material(glass("Glass")));
  add_view(builder, {0, -5, 0}, {0, 0, 0}, 60);
  return builder.build();
}

TEST(RefractedExit, BendsRaysAtASphereAsSnellSays) {
  const Scene scene = glass_ball(64);
  const double eta = 1 / 1.5;
  for (const Vec3f& from : {Vec3f{0, 0, 0}, Vec3f{0.3f, 0.2f, -0.1f}, Vec3f{-0.5f, 0.1f, 0.4f}}) {
    const LampTarget target{{1, -2, 3}, false};
    const RefractedExit exits(*scene.geometry, 0, from, target);
    const auto start = exits.start(0);
    ASSERT_TRUE(start);
    const auto exit = exits.find(*start, eta, {}, 1e-6);
    ASSERT_TRUE(exit);
    const Vec3f n = exit->surface.n, in = exit->direction;
    const Vec3f out = target.direction_from(exit->surface.position);
    const Vec3f across_in = in - n * dot(in, n), across_out = out - n * dot(out, n);
    EXPECT_LT(length(across_in - across_out * static_cast<float>(eta)), 2e-5f);
    const auto there = exits.refraction(*exit, eta);
    ASSERT_TRUE(there);
    EXPECT_NEAR(there->micronormal.x, 0, 2e-6);
    EXPECT_NEAR(there->micronormal.y, 0, 2e-6);
  }
}

// A body may have several places through which a lamp shines on one inside.
TEST(RefractedExit, IsSoughtBesideTheStraightLineToo) {
  const Scene scene = glass_ball(16);
  const RefractedExit exits(*scene.geometry, 0, {0.3f, 0.2f, -0.1f}, {{1, -2, 3}, false});
  for (int i = 0; i < RefractedExit::kStarts; ++i)
    for (int k = 0; k < i; ++k) {
      const auto one = exits.start(i), other = exits.start(k);
      ASSERT_TRUE(one && other);
      EXPECT_LT(dot(one->direction, other->direction), 0.9f) << i << k;
    }
}

TEST(RefractedExit, ChangesAsDifferencesOfItsMicronormals) {
  const Scene scene = glass_ball(8);
  const double eta = 1 / 1.4;
  const Vec3f from{0.3f, 0.2f, -0.1f};
  for (const bool infinite : {false, true}) {
    const RefractedExit exits(*scene.geometry, 0, from,
                              {normalize(Vec3f{1, -2, 3}) * (infinite ? 1.f : 4.f), infinite});
    const auto start = exits.start(0);
    ASSERT_TRUE(start);
    // Neighbours in two directions of the ray, on the same triangle.
    const Frame<float> frame = Frame<float>::from_normal(start->direction);
    const float h = 2e-3f;
    const auto micronormal = [&](float x, float y) {
      const Vec3f d = normalize(start->direction + frame.s * x + frame.t * y);
      const auto hit = scene.geometry->intersect(
          {from, d, 0, std::numeric_limits<float>::infinity()}, kScatterRay);
      EXPECT_EQ(hit->triangle, start->hit.triangle);
      return exits.refraction({*hit, scene.geometry->surface(*hit), d}, eta)->micronormal;
    };
    const auto a = micronormal(h, 0), b = micronormal(-h, 0), c = micronormal(0, h),
               d = micronormal(0, -h);
    const double area = ((a.x - b.x) * (c.y - d.y) - (a.y - b.y) * (c.x - d.x)) / (4 * h * h);
    EXPECT_NEAR(exits.refraction(*start, eta)->change, std::abs(area), 2e-3 * std::abs(area));
  }
}

struct Ticked {
  const char* owner;
  const char* parameter;
  float here, step;
  int spp = 128;
};
void PrintTo(const Ticked& t, std::ostream* out) { *out << t.parameter << " at " << t.here; }
class DerivativeThroughASurface : public testing::TestWithParam<Ticked> {};

TEST_P(DerivativeThroughASurface, AgreesWithDifferences) {
  const auto [owner, parameter, here, step, spp] = GetParam();
  const Material m = filled_glass(0.5, 1.4, 1.5, 0.85, 0.2);
  Light lamp = lamp_at({1, -2, 3}, LightKind::kPoint, 400);
  lamp.radius = 0.05;
  const Scene scene = lit(sphere_mesh(1, 16), m, lamp);
  const ParameterRef ref = scene.find(owner, parameter);
  const auto at = [&](double value) {
    return scene.with({{ref, std::vector<double>(scene.get(ref).size(), value)}});
  };
  DifferencePairs pairs;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const RenderSettings settings = settings_of(12, spp, seed);
    const Scene now = at(here);
    const Film film = render_view(now, settings, ticked(now, {{owner, parameter}}));
    double derivative = 0;
    for (std::size_t s = 0; s < film.slots.size(); ++s)
      for (int c = 0; c < 3; ++c) derivative += slope_of(film, static_cast<int>(s), c).mean;
    const auto sum = [&](double value) {
      const Film there = render_view(at(value), settings);
      return mean_of(there, 0).mean + mean_of(there, 1).mean + mean_of(there, 2).mean;
    };
    pairs.add(derivative, (sum(here + step) - sum(here - step)) / (2 * step));
  }
  pairs.expect_agreement();
}
INSTANTIATE_TEST_SUITE_P(Parameters, DerivativeThroughASurface,
                         testing::Values(Ticked{"Medium", "extinction", 0.7f, 0.1f},
                                         Ticked{"Medium", "albedo", 0.85f, 0.04f, 48},
                                         Ticked{"Medium", "anisotropy", 0.4f, 0.1f},
                                         Ticked{"Medium", "ior", 1.4f, 0.04f},
                                         Ticked{"Medium", "roughness", 0.5f, 0.05f},
                                         Ticked{"Lamp", "power", 400, 40, 16}));

}  // namespace
}  // namespace selenite

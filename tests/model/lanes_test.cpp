// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <random>

#include "math/instruction_set.h"
#include "model/cases.h"
#include "model/lanes_batch.h"

namespace selenite::lanes_test {
namespace {

#if defined(SELENITE_LANES)

class LanesTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_avx2()) GTEST_SKIP() << "this processor has no AVX2 with FMA";
  }
};

constexpr float kLastUniform = 1 - 0x1p-24f;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Lanes contract a b + c and have sines of their own: they may differ by a few units in the last
/// place of the terms that a result is made of, `size`.
void expect_near(float got, float want, float size, const std::string& what) {
  if (std::isnan(want)) {
    EXPECT_TRUE(std::isnan(got)) << what << ": " << got;
  } else if (std::isinf(want)) {
    EXPECT_EQ(got, want) << what;
  } else {
    EXPECT_NEAR(got, want, 2e-6f * (std::abs(want) + size)) << what;
  }
}

class LanesNumbers : public LanesTest {
 protected:
  std::mt19937 engine{5};
  std::uniform_real_distribution<float> u{-2, 2};
};

TEST_F(LanesNumbers, CompareLaneByLane) {
  const float a[kBatch] = {1, 2, 3, kNan, 0, -0.f, -1, 5};
  const float b[kBatch] = {2, 1, 3, 1, -0.f, 0, kNan, 6};
  unsigned bits[8];
  compare_by_lanes(a, b, bits);
  unsigned want[8] = {};
  for (int i = 0; i < kBatch; ++i) {
    const bool results[6] = {a[i]<b[i], a[i]> b[i], a[i] <= b[i], a[i] >= b[i], a[i] == b[i],
                             a[i] != b[i]};
    for (int k = 0; k < 6; ++k) want[k] |= static_cast<unsigned>(results[k]) << i;
  }
  for (int k = 0; k < 6; ++k) EXPECT_EQ(bits[k], want[k]) << k;
  EXPECT_EQ(bits[6], 1u);
  EXPECT_EQ(bits[7], 0u);
  const float less[kBatch] = {0, 0, 0, 0, -1, -1, -2, 0};
  const float more[kBatch] = {1, 1, 1, 1, 1, 1, 1, 1};
  compare_by_lanes(less, more, bits);
  EXPECT_EQ(bits[7], 1u);
  compare_by_lanes(more, less, bits);
  EXPECT_EQ(bits[6], 0u);
}

TEST_F(LanesNumbers, FunctionsAreThoseOfAPlainNumber) {
  for (int round = 0; round < 2000; ++round) {
    float a[kBatch], b[kBatch], got[kFunctions * kBatch];
    for (int i = 0; i < kBatch; ++i) {
      a[i] = round < 2 ? 0 : u(engine);
      b[i] = round % 50 == 0 ? a[i] : u(engine);
    }
    functions_by_lanes(a, b, got);
    for (int i = 0; i < kBatch; ++i) {
      float want[kFunctions];
      evaluate_functions(a[i], b[i], want);
      for (int k = 0; k < kFunctions; ++k)
        expect_near(got[k * kBatch + i], want[k], 1,
                    "function " + std::to_string(k) + " of " + std::to_string(a[i]) + ", " +
                        std::to_string(b[i]));
    }
  }
}

TEST_F(LanesNumbers, DerivativesAreThoseOfADual) {
  const auto number = [&](int slots) {
    Slopes x(u(engine));
    for (int k = 0; k < slots; ++k) x.d[k] = u(engine);
    return x;
  };
  for (int round = 0; round < 2000; ++round) {
    Slopes a[kBatch], b[kBatch], got[kFunctions * kBatch];
    // The last slot is 0, also where a root's slope is infinite.
    for (int i = 0; i < kBatch; ++i) {
      a[i] = number(3), b[i] = number(round % 3 ? 3 : 0);
      if (round % 10 == 0) a[i].v = 0;
    }
    functions_by_lanes(a, b, got);
    for (int i = 0; i < kBatch; ++i) {
      Slopes want[kFunctions];
      evaluate_functions(a[i], b[i], want);
      for (int k = 0; k < kFunctions; ++k) {
        const std::string what = "function " + std::to_string(k) + " of " + std::to_string(a[i].v) +
                                 ", " + std::to_string(b[i].v);
        expect_near(got[k * kBatch + i].v, want[k].v, 1, what);
        float size = 1;
        for (int slot = 0; slot < kSlots; ++slot)
          size = std::max(size, 10 * std::abs(want[k].d[slot]));
        for (int slot = 0; slot < kSlots; ++slot)
          expect_near(got[k * kBatch + i].d[slot], want[k].d[slot], size, what + ", derivative");
        EXPECT_EQ(got[k * kBatch + i].d[kSlots - 1], 0) << what;
      }
    }
  }
}

TEST_F(LanesNumbers, OneNumberForAllLanesMeetsOneOfEach) {
  for (int round = 0; round < 100; ++round) {
    Slopes x(u(engine)), got[kMixed * kBatch];
    float a[kBatch];
    for (int k = 0; k < kSlots; ++k) x.d[k] = k == 2 ? 0 : u(engine);
    for (float& y : a) y = u(engine);
    mixed_by_lanes(x, a, got);
    for (int i = 0; i < kBatch; ++i) {
      const Slopes want[kMixed] = {x + a[i], x - a[i], x * a[i], x / a[i],
                                   a[i] + x, a[i] - x, a[i] * x, a[i] / x};
      for (int k = 0; k < kMixed; ++k) {
        expect_near(got[k * kBatch + i].v, want[k].v, 0, std::to_string(k));
        for (int slot = 0; slot < kSlots; ++slot)
          expect_near(got[k * kBatch + i].d[slot], want[k].d[slot], 0, std::to_string(k));
      }
    }
  }
}

TEST_F(LanesNumbers, RandomNumbersMapToTheSameDirections) {
  std::uniform_real_distribution<float> unit;
  for (int round = 0; round < 2000; ++round) {
    float a[kBatch], b[kBatch], got[kMapped * kBatch];
    for (int i = 0; i < kBatch; ++i) {
      a[i] = unit(engine), b[i] = unit(engine);
      if (round % 20 == i) a[i] = b[i] = 0.5f;  // the centre of the disc
      if (round % 20 == i + 8) b[i] = 1 - a[i];
    }
    const float g = round % 4 ? 0.45f * u(engine) : 0.02f * u(engine);
    maps_by_lanes(a, b, g, got);
    for (int i = 0; i < kBatch; ++i) {
      float want[kMapped];
      evaluate_maps(a[i], b[i], g, want);
      for (int k = 0; k < kMapped; ++k)
        EXPECT_NEAR(got[k * kBatch + i], want[k], 1e-5 * (1 + std::abs(want[k])))
            << k << " of " << a[i] << ", " << b[i];
    }
  }
}

/// A material with derivatives by up to four of its numbers, chosen at random.
struct Scene {
  std::string name;
  Principled<Slopes> material;
  Flavour flavour;
  bool backfacing = false;
};

template <class Engine>
Scene random_scene(Engine& engine, int number) {
  std::uniform_real_distribution<double> u;
  Scene scene;
  Principled<double> m;
  const auto& families = cases::families();
  if (number % 3) {
    const cases::Family& family = families[number / 3 % families.size()];
    m = family.material(u(engine) < 0.2 ? 0 : 0.04 + 0.96 * u(engine));
    scene.name = family.name;
    scene.backfacing = family.backfacing;
    scene.flavour.version = family.version;
  } else {
    m = cases::random_material(engine);
    scene.name = "random";
    scene.backfacing = u(engine) < 0.3;
  }
  m.subsurface_weight = 0;
  static_cast<TopLobeParameters<double>&>(m) = {};
  const auto sometimes = [&](double share) { return u(engine) < share; };
  // In version 1 the reflection of a lane is then below the least weight: a plain number leaves it out,
  // lanes do only if all of them would.
  if (sometimes(0.2) && scene.flavour.version == Flavour::Version::kV2)
    m.ior = sometimes(0.5) ? 1.0001 : 1;
  if (sometimes(0.1)) m.base_color = Color<double>(0);
  if (sometimes(0.1)) m.base_color = Color<double>(1);
  if (sometimes(0.2)) m.specular_tint = {u(engine), 0.5, 1};
  if (sometimes(0.1)) m.coat_tint = {0, u(engine), 1};
  if (sometimes(0.1)) m.specular_level = u(engine);
  if (sometimes(0.2)) scene.flavour.distribution = Flavour::Distribution::kGgx;
  if (sometimes(0.3)) scene.flavour.evaluate_unphysical_refraction = false;
  scene.material = lift<Slopes>(m);
  std::vector<std::array<Slopes*, 3>> parameters;
  Principled<Slopes>::fields(scene.material, [&](const Parameter& p, auto& member) {
    if (p.name.starts_with("subsurface_") || cases::is_of_top_lobe(p.name)) return;
    if constexpr (requires { member.r; }) {
      parameters.push_back({&member.r, &member.g, &member.b});
    } else {
      parameters.push_back({&member, nullptr, nullptr});
    }
  });
  const int count = number % 5;  // of parameters with derivatives
  for (int slot = 0; slot < count; ++slot) {
    const int which = slot < 3 && sometimes(0.5) ? slot : engine() % parameters.size();
    for (Slopes* x : parameters[which])
      if (x) x->d[slot] = 1;
  }
  return scene;
}

template <class Engine>
Batch random_batch(Engine& engine, bool backfacing) {
  std::uniform_real_distribution<double> u;
  Batch batch;
  for (int i = 0; i < kBatch; ++i) {
    const Vec3f ng(normalize(cases::random_direction(engine)));
    const Frame<float> frame = Frame<float>::from_normal(ng);
    const double grazing = u(engine) < 0.2 ? 0.02 : 1;
    const Vec3f wi(cases::direction(grazing * (1e-3 + 0.999 * u(engine)), 6.28 * u(engine)));
    const double tilt = u(engine) < 0.5 ? 0 : 0.4;
    const Vec3f n(normalize(Vec3d(tilt * (u(engine) - 0.5), tilt * (u(engine) - 0.5), 1)));
    Vec3f wo(cases::random_direction(engine));
    if (u(engine) < 0.2) wo = normalize(Vec3f(-wi.x, -wi.y, wi.z) + wo * 0.1f);
    if (u(engine) < 0.1) wo = normalize(Vec3f(wo.x, wo.y, 0.02f * wo.z));
    batch.point[i] = {ng, normalize(frame.to_world(n)), normalize(frame.to_world(wi)), backfacing};
    batch.wo[i] = normalize(frame.to_world(wo));
    // 24 bits, as `Random` gives them
    for (float* x : {&batch.u_lobe[i], &batch.u1[i], &batch.u2[i]})
      *x = std::floor(static_cast<float>(u(engine)) * 0x1p24f) * 0x1p-24f;
    if (u(engine) < 0.02) batch.u_lobe[i] = kLastUniform;
  }
  return batch;
}

template <class T, class S = scalar_t<T>>
Answer<T> ask_scalar(const Principled<T>& material, const Flavour& flavour, const Batch& batch,
                     int i, float u_lobe) {
  const SurfacePoint<float>& at = batch.point[i];
  const SurfacePoint<S> point{Vec3<S>(at.ng), Vec3<S>(at.n), Vec3<S>(at.wi), at.backfacing};
  const Vec3<S> wo(batch.wo[i]);
  const PrincipledBsdf<T> bsdf(material, flavour, point);
  S density;
  Answer<T> answer;
  bsdf.value_and_density(wo, answer.value, density);
  answer.density = static_cast<float>(density);
  answer.density_alone = static_cast<float>(bsdf.density(wo));
  answer.transmits = bsdf.transmits(wo);
  answer.all_singular = bsdf.all_singular();
  if (const auto s = bsdf.sample(u_lobe, batch.u1[i], batch.u2[i]))
    answer.sample = {true,       s->singular,  s->transmits,
                     s->diffuse, Vec3f(s->wo), static_cast<float>(s->density),
                     s->weight};
  return answer;
}

template <class S>
double slope(const Dual<S, kSlots>& x, int k) {
  return x.d[k];
}
double slope(float, int) { return 0; }
double slope(double, int) { return 0; }

/// Compares answers of lanes with those of a plain number, `want`. A direction's rounding, 1e-7, is
/// that over the width in what a narrow lobe gives for it. `exact` is the plain number's answer in
/// 64 bits: where that is far off, a formula cancels, and lanes may be as far off to the other side.
class Comparison {
 public:
  /// narrowest: least GGX width of the material, or 1
  explicit Comparison(double narrowest) : relative_(1e-4 + 1e-6 / narrowest) {}

  void number(double got, double want, double exact, double size, const std::string& what) const {
    const double tolerance =
        relative_ * (std::abs(want) + size) + 8 * std::abs(want - exact) + 1e-30;
    if (!(std::abs(got - want) <= tolerance))
      ADD_FAILURE() << what << ": " << got << ", scalar " << want << ", in 64 bits " << exact;
  }
  template <class T, class E>
  void color(const Color<T>& got, const Color<T>& want, const Color<E>& exact,
             const std::string& what) const {
    for (int c = 0; c < 3; ++c) {
      const double largest = std::abs(value_of(want[c]));
      number(value_of(got[c]), value_of(want[c]), value_of(exact[c]), 0, what);
      for (int k = 0; k < kSlots; ++k)
        number(slope(got[c], k), slope(want[c], k), slope(exact[c], k), largest,
               what + ", derivative " + std::to_string(k));
    }
  }

 private:
  double relative_;
};

template <class A, class B>
bool same_choice(const A& a, const B& b) {
  if (a.exists != b.exists) return false;
  return !a.exists || (a.singular == b.singular && a.transmits == b.transmits &&
                       a.diffuse == b.diffuse && length(a.wo - b.wo) < 1e-4f);
}

class LanesBsdf : public LanesTest {
 protected:
  template <class T, class E>
  void compare(int number) {
    std::mt19937 engine(number + 1);
    const Scene scene = random_scene(engine, number);
    Batch batch = random_batch(engine, scene.backfacing);
    const auto material = convert_fields<T>(scene.material, [](const Slopes& x) {
      if constexpr (std::is_same_v<T, float>) {
        return x.v;
      } else {
        return x;
      }
    });
    const auto wide = convert_fields<E>(scene.material, [](const Slopes& x) {
      E y(x.v);
      if constexpr (!std::is_same_v<E, double>)
        for (int k = 0; k < kSlots; ++k) y.d[k] = x.d[k];
      return y;
    });
    double narrowest = 1;
    for (const auto* roughness : {&material.roughness, &material.coat_roughness})
      if (value_of(*roughness) > 0.004f)
        narrowest = std::min<double>(narrowest, square(value_of(*roughness)));
    const Comparison comparison(narrowest);
    const unsigned active = number % 4 ? 0xff : engine() & 0xff;
    for (int i = 0; i < kBatch; ++i)
      if (!(active >> i & 1)) {  // what is in them does not matter
        batch.point[i].wi = batch.wo[i] = Vec3f(kNan, kNan, kNan);
        batch.u_lobe[i] = batch.u1[i] = engine() % 2 ? kNan : 1e30f;
      }
    Answer<T> got[kBatch];
    ask_by_lanes(material, scene.flavour, batch, active, got);
    for (int i = 0; i < kBatch; ++i) {
      if (!(active >> i & 1)) continue;
      const auto want = ask_scalar<T>(material, scene.flavour, batch, i, batch.u_lobe[i]);
      const auto exact = ask_scalar<E>(wide, scene.flavour, batch, i, batch.u_lobe[i]);
      const std::string at =
          scene.name + " " + std::to_string(number) + " lane " + std::to_string(i);
      comparison.color(got[i].value, want.value, exact.value, at + " value");
      comparison.number(got[i].density, want.density, exact.density, 0, at + " density");
      EXPECT_EQ(got[i].density, got[i].density_alone) << at;
      EXPECT_EQ(got[i].transmits, want.transmits) << at;
      EXPECT_EQ(got[i].all_singular, want.all_singular) << at;
      ++drawn;
      if (!same_choice(got[i].sample, want.sample)) {
        ties += batch.u_lobe[i] != kLastUniform;
        continue;
      }
      if (!want.sample.exists || !same_choice(want.sample, exact.sample)) continue;
      comparison.number(got[i].sample.density, want.sample.density, exact.sample.density, 0,
                        at + " density drawn");
      comparison.color(got[i].sample.weight, want.sample.weight, exact.sample.weight,
                       at + " weight drawn");
    }
  }

  int drawn = 0, ties = 0;
};

TEST_F(LanesBsdf, ValuesAreThoseOfAPlainNumber) {
  for (int number = 0; number < 6000; ++number) compare<float, double>(number);
  EXPECT_LE(ties, drawn / 2000) << "of " << drawn;
}

TEST_F(LanesBsdf, DerivativesAreThoseOfADual) {
  for (int number = 0; number < 6000; ++number) compare<Slopes, Dual<double, kSlots>>(number);
  EXPECT_LE(ties, drawn / 2000) << "of " << drawn;
}

#else
TEST(Lanes, AreThoseOfAPlainNumber) { GTEST_SKIP() << "built without lanes"; }
#endif  // defined(SELENITE_LANES)

}  // namespace
}  // namespace selenite::lanes_test

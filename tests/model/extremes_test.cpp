// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/rng.h"
#include "model/cases.h"

// No legal input may give a NaN or an infinity, in float, with derivatives by everything.
namespace selenite {
namespace {

/// One for every scalar and diagonal colour, three for the others.
constexpr int kSlots = [] {
  int count = 0;
  Principled<float> m;
  Principled<float>::fields(m, [&](const Parameter& p, const auto& member) {
    constexpr bool colour = requires { member.r; };
    count += colour && !p.diagonal ? 3 : 1;
  });
  return count;
}();
using D = Dual<float, kSlots>;

bool finite(const D& x) {
  if (!std::isfinite(x.v)) return false;
  for (const float d : x.d)
    if (!std::isfinite(d)) return false;
  return true;
}
bool finite(const Color<D>& c) { return finite(c.r) && finite(c.g) && finite(c.b); }
bool finite(const Color<float>& c) {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}
template <class T>
bool negative(const Color<T>& c) {
  const auto v = value_of(c);
  return v.r < 0 || v.g < 0 || v.b < 0;
}

Principled<D> seed_all(const Principled<float>& material) {
  auto m = lift<D>(material);
  int slot = 0;
  Principled<D>::fields(m, [&](const Parameter& p, auto& member) {
    if constexpr (requires { member.r; }) {
      for (int c = 0; c < 3; ++c) member[c].d[p.diagonal ? slot : slot + c] = 1;
      slot += p.diagonal ? 1 : 3;
    } else {
      member.d[slot++] = 1;
    }
  });
  return m;
}

class Extremes : public testing::TestWithParam<const char*> {
 protected:
  template <class T>
  void expect_finite(const Principled<T>& m, const SurfacePoint<float>& point, bool unphysical,
                     int seed) {
    const Flavour flavour{.version = seed % 4 ? Flavour::Version::kV2 : Flavour::Version::kV1,
                          .evaluate_unphysical_refraction = unphysical};
    const PrincipledBsdf<T> bsdf(m, flavour, point);
    ASSERT_TRUE(finite(bsdf.emission()));
    ASSERT_TRUE(finite(bsdf.transparency()));
    Random random(5, 0, seed);
    for (int i = 0; i < 40; ++i) {
      random.start_bounce(i);
      const float v = i == 0 ? 0 : random.uniform(2);
      const auto s = bsdf.sample(random.uniform(0), random.uniform(1), i == 1 ? 1 - 0x1p-24f : v);
      if (s) {
        ASSERT_TRUE(finite(s->weight)) << "sampled weight";
        ASSERT_FALSE(negative(s->weight));
        ASSERT_TRUE(std::isfinite(s->density) && (s->density > 0 || s->enters)) << s->density;
        ASSERT_NEAR(length(s->wo), 1, 1e-4);
        ASSERT_EQ(s->transmits, dot(point.ng, s->wo) < 0);
        check(bsdf, s->wo);
      }
      const float c = 2 * random.uniform(3) - 1, r = std::sqrt(1 - c * c);
      const float phi = 6.2831853f * random.uniform(4);
      check(bsdf, {r * std::cos(phi), r * std::sin(phi), c});
    }
    // The mirror direction, the viewer's, straight through, along the surface.
    const Vec3f mirror = point.n * (2 * dot(point.n, point.wi)) - point.wi;
    for (const Vec3f& wo : {mirror, point.wi, -point.wi, point.n, -point.n, Vec3f{1, 0, 0},
                            normalize(Vec3f{-1, 0, 1e-4f})})
      check(bsdf, wo);
  }
  template <class T>
  void check(const PrincipledBsdf<T>& bsdf, const Vec3f& wo) {
    Color<T> f;
    float p = -1;
    bsdf.value_and_density(wo, f, p);
    ASSERT_TRUE(finite(f)) << "value towards " << wo.x << " " << wo.y << " " << wo.z;
    ASSERT_FALSE(negative(f));
    ASSERT_TRUE(std::isfinite(p) && p >= 0) << p;
    ++checked_;
  }
  int checked_ = 0;
};

TEST_P(Extremes, AreFiniteInFloat) {
  const std::string lobe = GetParam();
  int seed = 0;
  for (const float roughness : {0.f, 0.001f, 0.0037f, 0.0038f, 0.01f, 0.1f, 1.f}) {
    for (const float ior :
         {1e-5f, 0.4f, 0.99999f, 1.f, 1.0000001f, 1.0001f, 1.001f, 1.5f, 2.5f, 10.f}) {
      for (const float cosine : {1e-6f, 1e-4f, 0.01f, 0.5f, 1.f}) {
        for (const float base : {0.f, 0.5f, 1.f}) {
          Principled<float> m;
          m.roughness = m.coat_roughness = m.diffuse_roughness = roughness;
          m.ior = ior;
          m.coat_ior = std::max(ior, 1.f);
          m.base_color = {base, 0.3f, 1};
          if (base == 0) m.base_color = m.specular_tint = m.coat_tint = Color<float>(0);
          if (lobe == "metal") m.metallic = 1;
          if (lobe == "glass") m.transmission = 1;
          if (lobe == "coat") m.coat_weight = 1;
          if (lobe == "sheen") m.sheen_weight = 1, m.sheen_roughness = roughness;
          if (lobe == "wax") m.subsurface_weight = 1;
          if (lobe == "mixture")
            m.metallic = m.transmission = m.coat_weight = m.sheen_weight = m.alpha = 0.5f;
          ++seed;
          const bool backfacing = seed % 2;
          const Vec3f z{0, 0, 1};
          const Vec3f wi{std::sqrt((1 - cosine) * (1 + cosine)), 0, cosine};
          const Vec3f n = seed % 3 ? z : normalize(Vec3f{-0.4f, 0.2f, 0.9f});
          const SurfacePoint<float> point{z, n, wi, backfacing};
          SCOPED_TRACE(testing::Message()
                       << "roughness " << roughness << " ior " << ior << " cosine " << cosine
                       << " base " << base << " seed " << seed);
          expect_finite(m, point, seed % 5 > 0, seed);
          expect_finite(seed_all(m), point, seed % 5 > 0, seed);
          if (HasFatalFailure()) return;
        }
      }
    }
  }
  EXPECT_GT(checked_, 10000);
}
INSTANTIATE_TEST_SUITE_P(Lobes, Extremes,
                         testing::Values("plastic", "metal", "glass", "coat", "sheen", "wax",
                                         "mixture"),
                         [](const auto& info) { return std::string(info.param); });

TEST(Float, AgreesWithDoubleWhereTheLobeIsNotNarrowerThanItsDirections) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> u;
  std::vector<double> errors;
  for (int i = 0; i < 4000; ++i) {
    const auto material = cases::random_material(engine);
    const auto point = cases::flat(cases::direction(0.02 + 0.98 * u(engine)), i % 2);
    const auto s =
        PrincipledBsdf<double>(material, Flavour{}, point).sample(u(engine), u(engine), u(engine));
    if (!s || s->singular || s->enters) continue;
    const SurfacePoint<float> narrow{{0, 0, 1}, {0, 0, 1}, Vec3f(point.wi), point.backfacing};
    const PrincipledBsdf<float> bsdf(lift<float>(material), Flavour{}, narrow);
    const double want = max_channel(s->weight) * s->density;
    errors.push_back(std::abs(max_channel(bsdf.value(Vec3f(s->wo))) / want - 1));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 2e-6);
  EXPECT_LT(errors[errors.size() * 99 / 100], 2e-3);
}

}  // namespace
}  // namespace selenite

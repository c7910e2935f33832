// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/tables/gauss_legendre.h"
#include "render/media_scenes.h"
#include "render/picture_statistics.h"

// Media at the ends of every range, where the picture is known: thin and dense, black and white,
// forward and backward, without a jump of the refractive index, tiny and huge. "Depth" is extinction
// times half the body's size. Every comparison allows 4 standard errors (1 false alarm in 16 000) and
// 0.2 %.
namespace selenite {
namespace {

constexpr double kSlack = 2e-3;

/// Every number of a film with derivatives is finite and no path is lost.
void expect_sound(const Film& film) {
  EXPECT_EQ(film.dropped, 0) << film.first_dropped;
  EXPECT_EQ(film.truncated, 0);
  const auto finite = [](const Picture& picture) {
    for (const Colorf& c : picture)
      for (int k = 0; k < 3; ++k) ASSERT_TRUE(std::isfinite(c[k]));
  };
  finite(film.mean);
  finite(film.variance);
  for (const SlotFilm& slot : film.slots) {
    finite(slot.mean);
    finite(slot.variance);
  }
}

// ---------------------------------------------------------------- absorption

struct Black {
  double depth, size;
};
void PrintTo(const Black& p, std::ostream* out) {
  *out << "depth " << p.depth << ", size " << p.size;
}
class BlackMedium : public testing::TestWithParam<Black> {};

TEST_P(BlackMedium, FollowsBeersLawWithItsDerivative) {
  const auto [depth, size] = GetParam();
  const Scene scene = slab(fog(Color<double>(depth / size), 0), size);
  const Film film =
      render_view(scene, settings_of(4, 2000), ticked(scene, {{"Medium", "extinction"}}));
  expect_sound(film);
  const double want = std::exp(-2 * depth), slope = -2 * size * want;
  const Estimate light = mean_of(film), change = slope_of(film, 0);
  EXPECT_LT(std::abs(light.mean - want), 4 * light.error + kSlack * want + 1e-7);
  EXPECT_LT(std::abs(change.mean - slope), 4 * change.error + (kSlack * want + 1e-6) * 2 * size);
}
std::vector<Black> blacks() {
  std::vector<Black> all;
  for (double depth : {0.0, 1e-6, 1e-3, 1.0, 10.0, 1e2, 1e4})
    for (double size : {1e-4, 1.0, 1e5}) all.push_back({depth, size});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Depths, BlackMedium, testing::ValuesIn(blacks()));

// ---------------------------------------------------------------- white furnace

enum class Boundary { kNone, kGlass1, kGlass15 };
Material white(Boundary boundary, double extinction, double g) {
  if (boundary == Boundary::kNone) return fog(Color<double>(extinction), 1, g);
  return filled_glass(0, boundary == Boundary::kGlass1 ? 1 : 1.5, extinction, 1, g);
}

struct White {
  Boundary boundary;
  double depth, g;
};
void PrintTo(const White& p, std::ostream* out) {
  *out << "boundary " << static_cast<int>(p.boundary) << ", depth " << p.depth << ", g " << p.g;
}
class WhiteMedium : public testing::TestWithParam<White> {};

TEST_P(WhiteMedium, LosesNothing) {
  const auto [boundary, depth, g] = GetParam();
  // A long walk meets everything: light caught behind a limit, and rounding that adds up.
  const int spp = depth > 100 ? 12 : 200;
  const Film film = render_view(ball(white(boundary, depth, g)), settings_of(8, spp));
  expect_sound(film);
  const Estimate e = mean_of(film);
  EXPECT_LT(std::abs(e.mean - 1), 4 * e.error + kSlack) << e.mean << " +- " << e.error;
  EXPECT_LT(e.error, 2 * kSlack);
}

TEST_P(WhiteMedium, NothingChangesWithDensityOrAnisotropy) {
  const auto [boundary, depth, g] = GetParam();
  if (depth > 100) return;  // the derivative's noise grows with the number of scatterings
  const Scene scene = ball(white(boundary, depth, g));
  const SlotLayout layout =
      ticked(scene, {{"Medium", "extinction"}, {"Medium", "anisotropy"}, {"Medium", "ior"}});
  const Film film = render_view(scene, settings_of(8, 100), layout);
  expect_sound(film);
  // What a fit would step by: the extinction's octave, the distance of g from its end.
  const double steps[] = {depth, 1 - std::abs(g), 0.1};
  for (int slot = 0; slot < 3; ++slot) {
    const Estimate e = slope_of(film, slot);
    EXPECT_LT(std::abs(e.mean) * steps[slot], 4 * e.error * steps[slot] + kSlack) << slot;
    EXPECT_LT(e.error * steps[slot], 0.3) << slot;
  }
}

std::vector<White> whites() {
  std::vector<White> all;
  for (Boundary boundary : {Boundary::kNone, Boundary::kGlass1, Boundary::kGlass15})
    for (double depth : {0.0, 1e-3, 1.0, 30.0, 1e3})
      for (double g : {0.0, 0.99, -0.99}) all.push_back({boundary, depth, g});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Depths, WhiteMedium, testing::ValuesIn(whites()));

// ---------------------------------------------------------------- half of all space

/// Light of a sky of radiance 1 that isotropic scattering in a half-space returns at right angles:
/// 1 - sqrt(1 - albedo) H(1), with Chandrasekhar's function H (Radiative Transfer, 1950, eq. V.18),
/// which is iterated here.
double returned(double albedo) {
  static const GaussLegendre<48> nodes;
  const double black = std::sqrt(1 - albedo);
  std::array<double, 48> h;
  h.fill(1);
  const auto at = [&](double mu) {
    double sum = 0;
    for (std::size_t j = 0; j < h.size(); ++j)
      sum += nodes.weight[j] * nodes.x[j] * h[j] / (mu + nodes.x[j]);
    return 1 / (black + albedo / 2 * sum);
  };
  for (int round = 0; round < 400; ++round) {
    auto next = h;
    for (std::size_t j = 0; j < h.size(); ++j) next[j] = at(nodes.x[j]);
    h = next;
  }
  return 1 - black * at(1);
}

TEST(HalfSpace, LimitsOfTheClosedForm) {
  EXPECT_EQ(returned(0), 0);
  // Single scattering: albedo / 2 times the integral of mu / (1 + mu).
  EXPECT_NEAR(returned(1e-4) / 1e-4, (1 - std::log(2)) / 2, 1e-4);
  EXPECT_NEAR(returned(1), 1, 1e-12);
}

struct Dense {
  double depth, albedo, size;
};
void PrintTo(const Dense& p, std::ostream* out) {
  *out << "depth " << p.depth << ", albedo " << p.albedo << ", size " << p.size;
}
class DenseMedium : public testing::TestWithParam<Dense> {};

TEST_P(DenseMedium, ReturnsWhatAHalfSpaceDoes) {
  const auto [depth, albedo, size] = GetParam();
  const Scene scene = half_space(fog(Color<double>(depth / size), albedo), size);
  const SlotLayout layout = ticked(scene, {{"Medium", "extinction"}, {"Medium", "albedo"}});
  const Film film = render_view(scene, settings_of(8, 6000), layout);
  expect_sound(film);
  const double want = returned(albedo);
  const Estimate light = mean_of(film);
  // In the densest ones free paths are as short as what floats tell apart of the surface.
  EXPECT_LE(std::abs(light.mean - want), 4 * light.error + kSlack * want)
      << light.mean << " +- " << light.error << ", on paper " << want;
  EXPECT_LE(light.error, 0.005 * want + 1e-9);

  const double h = 1e-4;
  const double by_albedo = albedo > h ? (returned(albedo + h) - returned(albedo - h)) / (2 * h)
                                      : (4 * returned(h) - returned(2 * h)) / (2 * h);
  const Estimate by_extinction = slope_of(film, 0), slope = slope_of(film, 1);
  EXPECT_LE(std::abs(by_extinction.mean) * depth / size,
            4 * by_extinction.error * depth / size + kSlack * want);
  EXPECT_LT(std::abs(slope.mean - by_albedo), 4 * slope.error + 2 * kSlack * by_albedo)
      << slope.mean << " +- " << slope.error << ", on paper " << by_albedo;
  EXPECT_LT(slope.error, 0.02 * by_albedo);
}
std::vector<Dense> dense() {
  std::vector<Dense> all;
  for (double depth : {1e2, 1e3, 1e4})
    for (double albedo : {0.0, 0.5, 0.9}) all.push_back({depth, albedo, 1});
  for (double size : {1e-4, 1e5}) all.push_back({1e4, 0.5, size});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Depths, DenseMedium, testing::ValuesIn(dense()));

class DenserThanFloats : public testing::TestWithParam<double> {};

TEST_P(DenserThanFloats, IsFinite) {
  // Free paths are shorter than what floats tell apart of the surface: too dark, but harmless.
  const Film film = render_view(ball(fog(Color<double>(GetParam()), 0.9)), settings_of(8, 50));
  expect_sound(film);
  EXPECT_LT(mean_of(film).mean, 1);
}
INSTANTIATE_TEST_SUITE_P(Depths, DenserThanFloats, testing::Values(1e6, 1e7, 1e8));

// ---------------------------------------------------------------- colours far apart

class ColouredMedium : public testing::TestWithParam<double> {};

TEST_P(ColouredMedium, ChannelsAreThoseOfGreyMedia) {
  const double g = GetParam();
  const Color<double> depth{0, 1, 1e4};
  const auto film_of = [g](const Color<double>& extinction, std::uint64_t seed) {
    const Scene scene = ball(fog(extinction, 0.9, g));
    return render_view(scene, settings_of(8, 2000, seed),
                       ticked(scene, {{"Medium", "extinction"}, {"Medium", "albedo"}}));
  };
  const Film coloured = film_of(depth, 1);
  expect_sound(coloured);
  for (int c = 0; c < 3; ++c) {
    const Film grey = film_of(Color<double>(depth[c]), 2 + c);
    const auto compare = [](const Estimate& a, const Estimate& b, double scale) {
      EXPECT_LT(std::abs(a.mean - b.mean) * scale,
                4 * std::hypot(a.error, b.error) * scale + kSlack)
          << a.mean << " and " << b.mean;
    };
    compare(mean_of(coloured, c), mean_of(grey, c), 1);
    compare(slope_of(coloured, 0, c), slope_of(grey, 0, c), std::max(depth[c], 1.0));
    compare(slope_of(coloured, 1, c), slope_of(grey, 1, c), 1);
    EXPECT_LT(mean_of(coloured, c).error, 4e-3);  // no channel is starved by the others
  }
}
INSTANTIATE_TEST_SUITE_P(Anisotropies, ColouredMedium, testing::Values(-0.99, 0.0, 0.99));

// ---------------------------------------------------------------- sizes

struct Sized {
  double roughness, ior, depth, g, size;  // roughness below 0: no boundary
};
void PrintTo(const Sized& p, std::ostream* out) {
  *out << "roughness " << p.roughness << ", ior " << p.ior << ", depth " << p.depth << ", g " << p.g
       << ", size " << p.size;
}
class AnySize : public testing::TestWithParam<Sized> {};

TEST_P(AnySize, RendersTheSamePicture) {
  const Sized p = GetParam();
  const auto film_at = [&](double size) {
    const double extinction = p.depth / size;
    const Scene scene =
        ball(p.roughness < 0 ? fog(Color<double>(extinction), 0.9, p.g)
                             : filled_glass(p.roughness, p.ior, extinction, 0.9, p.g),
             size);
    return render_view(scene, settings_of(8, 400),
                       ticked(scene, {{"Medium", "extinction"}, {"Medium", "albedo"}}));
  };
  const Film one = film_at(1), other = film_at(p.size);
  expect_sound(one);
  expect_sound(other);
  const auto compare = [](const Estimate& a, const Estimate& b) {
    // The same random numbers: but for paths that rounding sends elsewhere, the noise is the same.
    EXPECT_LT(std::abs(a.mean - b.mean),
              0.5 * std::hypot(a.error, b.error) + kSlack * std::abs(a.mean))
        << a.mean << " and " << b.mean << " +- " << b.error;
  };
  compare(mean_of(one), mean_of(other));
  const Estimate slope = slope_of(other, 0);
  compare(slope_of(one, 0), {slope.mean / p.size, slope.error / p.size});
  compare(slope_of(one, 1), slope_of(other, 1));
}
std::vector<Sized> sized() {
  std::vector<Sized> all;
  for (double size : {1e-4, 1e-2, 1e3, 1e5})
    for (double depth : {0.1, 3.0, 100.0}) {
      all.push_back({-1, 1, depth, 0.6, size});
      all.push_back({0, 1, depth, 0.99, size});
      all.push_back({0, 1.5, depth, -0.99, size});
      all.push_back({0.3, 1.35, depth, 0, size});
    }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Sizes, AnySize, testing::ValuesIn(sized()));

// ---------------------------------------------------------------- no jump of the refractive index

struct Matched {
  double depth, albedo, g;
};
void PrintTo(const Matched& p, std::ostream* out) {
  *out << "depth " << p.depth << ", albedo " << p.albedo << ", g " << p.g;
}
class MatchedGlass : public testing::TestWithParam<Matched> {};

TEST_P(MatchedGlass, IsNotSeen) {
  const auto [depth, albedo, g] = GetParam();
  const auto film_of = [](const Material& material, std::uint64_t seed) {
    const Scene scene = ball(material);
    const SlotLayout layout =
        ticked(scene, {{"Medium", "extinction"}, {"Medium", "albedo"}, {"Medium", "anisotropy"}});
    return render_view(scene, settings_of(8, 1000, seed), layout);
  };
  const Film bare = film_of(fog(Color<double>(depth), albedo, g), 1);
  const Film matched = film_of(filled_glass(0, 1, depth, albedo, g), 2);
  expect_sound(bare);
  expect_sound(matched);
  const auto compare = [](const Estimate& a, const Estimate& b, double scale) {
    EXPECT_LT(std::abs(a.mean - b.mean), 4 * std::hypot(a.error, b.error) + kSlack * scale)
        << a.mean << " and " << b.mean;
  };
  compare(mean_of(bare), mean_of(matched), 1);
  for (int slot : {0, 1, 2}) compare(slope_of(bare, slot), slope_of(matched, slot), 1);
}
INSTANTIATE_TEST_SUITE_P(Media, MatchedGlass,
                         testing::Values(Matched{0, 0.5, 0}, Matched{0.5, 0, 0}, Matched{3, 0.8, 0},
                                         Matched{3, 0.8, 0.99}, Matched{3, 0.8, -0.99},
                                         Matched{50, 0.5, 0.3}, Matched{3, 1, 0.5}));

}  // namespace
}  // namespace selenite

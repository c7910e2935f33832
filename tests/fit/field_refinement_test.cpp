// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/field_refinement.h"

#include <gtest/gtest.h>

#include <set>

#include "fit/linear_photos.h"

namespace selenite {
namespace {

/// Renders of `LinearPhotos` with evenly spread samples, whose slopes by the colour are `reported` times
/// what they are. Notes the seeds that it is asked for.
class LinearEvaluator final : public Evaluator {
 public:
  explicit LinearEvaluator(const LinearPhotos& world, double reported)
      : world_(world), reported_(reported) {}

  Film evaluate(const Point& point, const Photo& photo, const Evaluation& how) override {
    if (!how.derivatives && !photo.pixels) seeds.push_back(how.seed);
    const bool second = photo.camera != world_.photos[0].camera;
    Film film = world_.at(point.scalars, point.fields[0])[second ? 1 : 0].film;
    film.spp = how.spp;
    film.variance.assign(film.size(), Colorf(static_cast<float>(kNoise * kNoise / how.spp)));
    const int even = (how.spp + 1) / 2;
    for (std::size_t i = 0; i < film.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        Random random(how.seed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(c));
        double all = 0, half = 0;
        for (int s = 0; s < how.spp; ++s) {
          const double sample = kNoise * std::sqrt(12.0) * (random.uniform(s) - 0.5);
          all += sample;
          if (s % 2 == 0) half += sample;
        }
        film.mean[i][c] += static_cast<float>(all / how.spp);
        film.half_a[i][c] += static_cast<float>(half / even);
      }
    if (!how.derivatives) {
      film.slots.clear();
      return film;
    }
    for (Picture* slopes : {&film.slots[0].mean, &film.slots[0].half_a})
      for (Colorf& slope : *slopes) slope = slope * static_cast<float>(reported_);
    return film;
  }

  std::vector<std::uint64_t> seeds;

 private:
  static constexpr double kNoise = 0.5;
  const LinearPhotos& world_;
  double reported_;
};

struct Refined {
  Vector color;
  TrustReport report;
  std::vector<std::uint64_t> seeds;
};

Refined refine(const LinearPhotos& world, const FieldRefinementOptions& options,
               double reported = 1) {
  auto fields = FieldGaussNewton::of(world.fields, world.photos);
  fields->set_values({world.true_voxels});
  for (std::size_t i = 0; i < world.photos.size(); ++i) {
    FieldJacobian derivatives;
    derivatives.fields = {world.by_voxels[i]};
    fields->gather(i, derivatives);
  }
  const Vector start = world.true_color + Vector::Constant(3, 0.03);
  FieldRefinement refinement(world.problem, nullptr, start, *fields, 3, 256, 16, options);
  LinearEvaluator evaluator(world, reported);
  while (refinement.step(evaluator)) {
  }
  return {refinement.point().scalars, refinement.report(), evaluator.seeds};
}

TEST(FieldRefinement, FindsTheColourAndHowSureItIs) {
  const LinearPhotos world;
  const Refined found = refine(world, {});
  for (int c = 0; c < 3; ++c) {
    const Confidence& one = found.report.components[static_cast<std::size_t>(c)];
    EXPECT_TRUE(one.determined) << c;
    EXPECT_LT(one.standard_error, 0.01) << c;
    EXPECT_NEAR(found.color[c], world.true_color[c], 5 * one.standard_error) << c;
  }
}

// Voxels leave errors that the noise of one fit does not show: docs/measurements/fields.md.
TEST(FieldRefinement, ErrorsBesideVoxelsAreWidened) {
  const LinearPhotos world;
  FieldRefinementOptions by_noise;
  by_noise.beyond_noise = 1;
  const Refined plain = refine(world, by_noise), wide = refine(world, {});
  EXPECT_EQ(plain.color, wide.color) << "steps do not depend on it";
  for (std::size_t c = 0; c < 3; ++c) {
    const Confidence &one = plain.report.components[c], &other = wide.report.components[c];
    EXPECT_NEAR(other.standard_error, 1.5 * one.standard_error, 0.02 * one.standard_error) << c;
    EXPECT_NEAR(other.interval[1] - other.interval[0], 1.5 * (one.interval[1] - one.interval[0]),
                0.02 * (one.interval[1] - one.interval[0]))
        << c;
  }
}

TEST(FieldRefinement, PassesShareNoSeed) {
  const LinearPhotos world;
  const Refined found = refine(world, {});
  EXPECT_EQ(found.report.passes, 3);
  ASSERT_EQ(found.seeds.size(), 3 * world.photos.size());
  EXPECT_EQ(std::set(found.seeds.begin(), found.seeds.end()).size(), found.seeds.size());
}

// Slopes a tenth of what they are: every pass leads ten times too far, and the last one ends nowhere.
TEST(FieldRefinement, AnswersThatAreNotSettledAreNotCalledSure) {
  const LinearPhotos world;
  const Refined found = refine(world, {}, 0.1);
  for (int c = 0; c < 3; ++c) {
    const Confidence& one = found.report.components[static_cast<std::size_t>(c)];
    const bool holds =
        one.interval[0] <= world.true_color[c] && world.true_color[c] <= one.interval[1];
    EXPECT_TRUE(holds || !one.determined) << c << ": " << found.color[c] << " in ["
                                          << one.interval[0] << ", " << one.interval[1] << "]";
  }
}

}  // namespace
}  // namespace selenite

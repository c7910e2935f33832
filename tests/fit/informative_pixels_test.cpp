// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/informative_pixels.h"

#include <gtest/gtest.h>

#include <random>

#include "fit/synthetic_renderer.h"
#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kSide = 32;

std::vector<Photo> grey_photos(const Scene& scene) {
  std::vector<Photo> photos{synthetic_capture(scene, "Left", kSide),
                            synthetic_capture(scene, "Right", kSide)};
  for (Photo& photo : photos) photo.reference.assign(photo.size(), Colorf(0.5f));
  check_photos(scene, photos);
  return photos;
}

/// Two photos, of which derivatives by two unknowns are made up: signal where it is put, noise anywhere.
struct Made {
  Scene scene = synthetic_scene();
  std::vector<Photo> photos = grey_photos(scene);
  Unknowns unknowns{scene, {synthetic_unknowns()[1], synthetic_unknowns()[3]}};
  SlotLayout layout{unknowns.layout(scene)};
  Problem problem{unknowns, layout, photos, find_loss("dual-buffer"), 10};
  GaussNewton evidence{problem};
  InformativePixels informative{problem};
  std::mt19937 random{3};

  /// `strong`: pixels of the first photo where the second unknown shows; `paths`: such where one half
  /// alone has seen something, and much.
  Observation derivatives(int photo, const std::vector<std::size_t>& strong,
                          const std::vector<std::size_t>& paths, float noise = 0.1f,
                          float size = 1) {
    Normal<float> normal(0, noise);
    Film film(kSide, kSide, 8, 2);
    for (std::size_t k = 0; k < 2; ++k)
      for (std::size_t p = 0; p < film.size(); ++p) {
        const float a = normal(random), b = normal(random);
        film.slots[k].half_a[p] = Colorf(a);
        film.slots[k].mean[p] = Colorf((a + b) / 2);
        film.variance[p] = Colorf(noise * noise / 8);
      }
    if (photo == 0) {
      for (const std::size_t p : strong) {
        film.slots[1].half_a[p] += Colorf(size);
        film.slots[1].mean[p] += Colorf(size);
      }
      for (const std::size_t p : paths) {
        film.slots[1].half_a[p] += Colorf(50);
        film.slots[1].mean[p] += Colorf(25);
      }
    }
    return {photo, std::move(film), {}};
  }
  Vector slope() const { return Vector::Ones(2); }
  void add_pilot(const std::vector<std::size_t>& strong, const std::vector<std::size_t>& paths) {
    for (int photo = 0; photo < 2; ++photo)
      for (int turn = 0; turn < 4; ++turn)
        informative.add_pilot(
            derivatives(photo, strong, turn == 0 ? paths : std::vector<std::size_t>()), slope(), 1);
  }
  std::vector<std::size_t> chosen(std::size_t photo) const {
    std::vector<std::size_t> all;
    const PixelMask& mask = *informative.photo(photo).pixels;
    for (std::size_t p = 0; p < mask.size(); ++p)
      if (mask[p]) all.push_back(p);
    return all;
  }
};

const std::vector<std::size_t> kStrong{40, 41, 73, 500, 777, 1000};

TEST(InformativePixels, AreThoseWithTheHighestScoresAndNotSingleStrongPaths) {
  Made made;
  made.add_pilot(kStrong, {5, 6, 7, 300, 301, 302, 303, 304, 305, 306});
  made.informative.choose(made.evidence, {true, true});
  ASSERT_FALSE(made.informative.empty());
  const std::vector<std::size_t> first = made.chosen(0), second = made.chosen(1);
  for (const std::size_t p : kStrong) EXPECT_TRUE(std::ranges::find(first, p) != first.end()) << p;
  EXPECT_LT(first.size() + second.size(), std::size_t{2 * kSide * kSide / 40});
  // The product of halves that one strong path is in goes up or down: half of them may be chosen.
  int paths = 0;
  for (const std::size_t p : {5, 6, 7, 300, 301, 302, 303, 304, 305, 306})
    paths += std::ranges::find(first, p) != first.end();
  EXPECT_LE(paths, 9);
}

TEST(InformativePixels, AreForThoseUnknownsOnlyThatCount) {
  Made made;
  made.add_pilot(kStrong, {});
  made.informative.choose(made.evidence, {true, false});
  ASSERT_FALSE(made.informative.empty());
  const std::vector<std::size_t> first = made.chosen(0);
  int strong = 0;
  for (const std::size_t p : kStrong) strong += std::ranges::find(first, p) != first.end();
  EXPECT_LT(strong, 4) << "the other unknown shows nowhere in particular";
  made.informative.choose(made.evidence, {false, false});
  EXPECT_TRUE(made.informative.empty());
}

TEST(InformativePixels, EquationsWeighByWhatIsNoNoiseInTheirInstruments) {
  const auto weighed = [](float noise) {
    Made made;
    made.add_pilot(kStrong, {});
    made.informative.choose(made.evidence, {true, true});
    std::vector<GaussNewton::PhotoEquations> all(2);
    for (int photo = 0; photo < 2; ++photo) {
      for (int turn = 0; turn < 4; ++turn)
        made.informative.gather(made.derivatives(photo, kStrong, {}, noise), made.slope());
      const Film residual = made.derivatives(photo, {}, {}, noise).film;
      all[static_cast<std::size_t>(photo)].informative =
          made.informative.seen(static_cast<std::size_t>(photo), residual, made.evidence);
    }
    const Jacobian before = all[0].informative->z.a.filtered;
    made.informative.weigh(all);
    return all[0].informative->z.a.filtered.col(1).norm() / before.col(1).norm();
  };
  EXPECT_NEAR(weighed(0.01f), 8, 0.1);
  EXPECT_LT(weighed(1), 4);
  EXPECT_LT(weighed(30), 1);
}

}  // namespace
}  // namespace selenite

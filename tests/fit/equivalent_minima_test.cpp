// SPDX-License-Identifier: GPL-3.0-or-later
// Two minima that explain the photos as well: what both determine, but not alike, is reported with both.
#include <gtest/gtest.h>

#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

// A roughness that fits at two values, and a metallic value that goes along: a tenth of the roughness.
constexpr double kOne = 0.2, kOther = 0.7, kShare = 0.1, kSum = 0.5;

/// Every second pixel shows the roughness, the others what is the same for both minima.
Film film_of(const Scene& scene, const Camera&, const SlotLayout& layout,
             const RenderSettings& settings, Progress*) {
  constexpr double kNoise = 0.1;
  const auto& m = scene.appearance.materials[0].values;
  const double r = m.roughness, metallic = m.metallic;
  std::vector<bool> is_roughness;
  for (const Slot& slot : layout.slots)
    is_roughness.push_back(scene.description(slot.parameter).name == "roughness");
  return evenly_noisy_film(layout, settings, kNoise, [&](std::size_t i) {
    const bool first = i % 2 == 0;
    std::array<double, 2> slopes{};
    for (std::size_t s = 0; s < is_roughness.size(); ++s)
      slopes[s] = is_roughness[s] ? (first ? 2 * r - kOne - kOther : kShare) : (first ? 0 : 1);
    const double shown = first ? (r - kOne) * (r - kOther) : metallic + kShare * r - kSum;
    return std::pair(0.5 + shown, slopes);
  });
}

// Of 20 fits some 16 tell the other minimum (ThatExplainThePhotosAsWellAreTold); those have to tell both
// values of what differs a little.
TEST(EquivalentMinima, IntervalsOfWhatBothDetermineHoldTheValuesOfBoth) {
  int reported = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    FitSettings settings = exact_settings(film_of, 20);
    settings.seed = seed;
    Fit fit(
        synthetic_scene(), {grey_capture()},
        {{"Body", "roughness", {0.45}, 0.02, 0.999, 0.03}, {"Body", "metallic", {0.4}, 0, 1, 0.03}},
        settings);
    while (fit.step()) {
    }
    const FitResult& found = fit.result();
    ASSERT_EQ(found.message, "");
    const Confidence& metallic = found.report.components[1];
    ASSERT_TRUE(metallic.determined) << seed;
    EXPECT_LT(metallic.interval[1] - metallic.interval[0], 0.1) << seed;
    if (found.report.alternatives.empty()) continue;
    ++reported;
    EXPECT_FALSE(found.report.components[0].determined) << seed;
    EXPECT_LT(metallic.interval[0], kSum - kShare * kOther + 0.005) << seed;
    EXPECT_GT(metallic.interval[1], kSum - kShare * kOne - 0.005) << seed;
  }
  EXPECT_GE(reported, 6);
}

}  // namespace
}  // namespace selenite

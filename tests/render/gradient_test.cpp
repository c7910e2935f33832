// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <set>

#include "model/cases.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Every parameter's derivative against differences of renders. The tables say which parameters
// there are: a new one is tested, inside its range and at both ends, the day it is added.
namespace selenite {
namespace {

constexpr int kSize = 6;
constexpr int kSeeds = 6;

/// A sphere with some of every lobe over a ground, under a lamp and a grey sky.
Scene layered_scene(Flavour::Version version = Flavour::Version::kV2) {
  SceneBuilder builder;
  Material m = plastic("Layered");
  m.flavour.version = version;
  m.values.base_color = {0.6, 0.4, 0.3};
  m.values.roughness = 0.45;
  m.values.metallic = 0.3;
  m.values.ior = 1.45;
  m.values.alpha = 0.8;
  m.values.transmission = 0.5;
  m.values.specular_level = 0.6;
  m.values.specular_tint = {0.8, 0.65, 0.5};
  m.values.diffuse_roughness = 0.4;
  m.values.coat_weight = 0.5;
  m.values.coat_roughness = 0.35;
  m.values.coat_ior = 1.6;
  m.values.coat_tint = {0.8, 0.6, 0.7};
  TopLobeParameters<double>::fields(m.values, [](const Parameter& p, auto& member) {
    if constexpr (requires { member.r; }) {
      member = {0.7, 0.8, 0.5};
    } else {
      member = p.name.ends_with("_weight") ? 0.2 : 0.45;
    }
  });
  m.values.transmission_roughness = 0.3;
  m.values.emission_color = {0.3, 0.2, 0.4};
  m.values.emission_strength = 0.5;
  place(builder, sphere_mesh(1, 10), builder.add_material(m));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.5)),
        translation({0, 0, -1.2}));
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kArea;
  lamp.size_x = lamp.size_y = 1.5;
  lamp.values.power = 60;
  lamp.values.color = {0.9, 0.8, 0.6};
  lamp.to_world = looking_at({1.5, -1, 3}, {0, 0, 0});
  builder.add_light(lamp);
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 55);
  set_sky(builder, 0.4);
  builder.appearance.world.values.color = {0.5, 0.7, 0.9};
  return builder.build();
}

enum class Side { kBoth, kUp, kDown };

using Changes = std::vector<std::pair<std::string, double>>;

/// One parameter at one place of its range. At an end, the displaced component alone is put there
/// (all three where the colour is diagonal).
struct Probe {
  std::string owner, parameter;
  Side side = Side::kBoth;
  double end = 0;  ///< unless kBoth
  double step = 0;
  Changes changed{};  ///< other parameters of the material
};

void PrintTo(const Probe& p, std::ostream* out) {
  *out << p.owner << ":" << p.parameter;
  if (p.side != Side::kBoth) *out << " at " << p.end;
}

/// Derivative of f at 0 from finite steps: error h^4, on one side h^3.
template <class F>
std::vector<double> difference(Side side, double h, F&& f) {
  std::vector<std::pair<double, double>> weights;  // step, weight
  if (side == Side::kBoth) {
    weights = {{-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}};
  } else {
    weights = {{0, -11.0 / 6}, {1, 3}, {2, -1.5}, {3, 1.0 / 3}};
    if (side == Side::kDown) h = -h;
  }
  std::vector<double> sum;
  for (const auto& [step, weight] : weights) {
    const std::vector<double> values = f(step * h);
    sum.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) sum[i] += weight / h * values[i];
  }
  return sum;
}

/// Mean of the three channels, pixel by pixel.
std::vector<double> grey(const Picture& picture) {
  std::vector<double> numbers;
  for (const Colorf& c : picture) numbers.push_back((double(c.r) + c.g + c.b) / 3);
  return numbers;
}

Scene base_scene(const Probe& probe) {
  const bool old = probe.parameter == "transmission_roughness";  // only version 1 has it
  Scene scene = layered_scene(old ? Flavour::Version::kV1 : Flavour::Version::kV2);
  for (const auto& [name, value] : probe.changed) {
    const ParameterRef ref = scene.find(probe.owner, name);
    scene = scene.with({{ref, std::vector<double>(scene.get(ref).size(), value)}});
  }
  return scene;
}

class Gradient : public testing::TestWithParam<Probe> {};

TEST_P(Gradient, AgreesWithDifferencesOfRenders) {
  const Probe& probe = GetParam();
  const Scene base = base_scene(probe);
  const ParameterRef ref = base.find(probe.owner, probe.parameter);
  const SlotLayout layout(base, {ref});

  for (std::size_t slot = 0; slot < layout.slots.size(); ++slot) {
    const auto displaced = [&](double step) {
      std::vector<double> values = base.get(ref);
      for (std::size_t c = 0; c < values.size(); ++c) {
        if (layout.slots[slot].component >= 0 &&
            static_cast<int>(c) != layout.slots[slot].component)
          continue;
        values[c] = (probe.side == Side::kBoth ? values[c] : probe.end) + step;
      }
      return base.with({{ref, values}});
    };
    // The differences use the Jacobian's own random numbers; every pixel of every seed is one
    // independent number whose mean is 0.
    Tally gap, size;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const RenderSettings settings = settings_of(kSize, 160, 100 + seed, 4);
      const Film film = render_view(displaced(0), settings, layout);
      ASSERT_TRUE(complete(film));
      const std::vector<double> got = grey(film.slots[slot].mean);
      const std::vector<double> want = difference(probe.side, probe.step, [&](double step) {
        return grey(render_view(displaced(step), settings).mean);
      });
      for (std::size_t i = 0; i < got.size(); ++i) {
        gap.add(got[i] - want[i]);
        size.add(std::abs(got[i]));
      }
    }
    const Estimate e = gap.estimate();
    // 216 numbers; 1 false alarm in 16 000 slots. The rest is for the rounding of sums in float.
    EXPECT_LT(std::abs(e.mean), 4 * e.error + 5e-4 * size.mean())
        << "slot " << slot << ": " << e.mean << " +- " << e.error << ", slopes are about "
        << size.mean();
    // A missing derivative would be noticed.
    EXPECT_LT(e.error, 0.25 * size.mean()) << "slot " << slot;
    RecordProperty("error_per_slope_" + std::to_string(slot),
                   std::to_string(e.error / size.mean()));
  }
}

/// Ends of ranges without a finite derivative.
const std::set<std::pair<std::string, double>> kNoSlope = {
    {"roughness", 0},        // a mirror
    {"coat_roughness", 0},   // likewise
    {"sheen_roughness", 0},  // Cycles starts at 0.001
    {"ior", 1e-5},           // everything is reflected
    {"coat_ior", 1},         // the energy tables run over sqrt((n - 1) / (n + 1))
    {"specular_level", 0},   // likewise
    {"base_color", 0},       // glass takes its root; tested below without glass
    {"coat_tint", 0},        // a power between 1 and 1.3: differences do not converge
};

const std::set<std::string> kMedium = {"extinction", "albedo", "anisotropy"};

/// Parameters that the other lobes' noise would drown are tried without those lobes.
Changes without_noise(const std::string& parameter, Side side) {
  const Changes opaque = {{"transmission", 0},
                          {"metallic", 0},
                          {"alpha", 1},
                          {"base_color", 0.2},
                          {"emission_strength", 0}};
  Changes bare = opaque;
  if (parameter == "specular_tint" && side == Side::kDown) bare[3].second = 0;
  bare.emplace_back("coat_weight", 0);
  const bool top = cases::is_of_top_lobe(parameter);
  const std::string weight = parameter.substr(0, parameter.find('_')) + "_weight";
  if (top && parameter != weight) {
    bare.emplace_back(weight, 1);
    bare.emplace_back("specular_level", 0);
    bare[3].second = 0;
  }
  if (parameter.starts_with("specular_") || top) return bare;
  if (side != Side::kDown) return {};
  if (parameter == "ior") return bare;
  if (parameter == "transmission") return {{"alpha", 1}, {"metallic", 0}, {"coat_weight", 0}};
  if (parameter.starts_with("coat_")) return opaque;
  return {};
}

std::vector<Probe> all_probes() {
  std::vector<Probe> probes;
  const Scene scene = layered_scene();
  const std::pair<OwnerKind, const char*> owners[] = {
      {OwnerKind::kMaterial, "Layered"}, {OwnerKind::kLight, "Lamp"}, {OwnerKind::kWorld, "World"}};
  for (const auto& [kind, owner] : owners)
    for (const Parameter& p : parameter_table(kind)) {
      const std::string name(p.name);
      // subsurface_test.cpp, medium_test.cpp, world_rotation_test.cpp
      if (name.starts_with("subsurface_") || kMedium.contains(name) || name == "rotation") continue;
      const double value = scene.get(scene.find(owner, name))[0];
      const bool wide = p.upper > 100;
      probes.push_back({owner, name, Side::kBoth, 0, wide ? 0.2 * value : 0.08});
      const double inward = wide ? 0.2 * value : 0.08;
      if (!kNoSlope.contains({name, p.lower}))
        probes.push_back({owner, name, Side::kUp, p.lower, inward, without_noise(name, Side::kUp)});
      if (!wide)
        probes.push_back(
            {owner, name, Side::kDown, p.upper, inward, without_noise(name, Side::kDown)});
    }
  // Black under metal and diffuse alone, where the derivative is finite. Metal's coloured edge would
  // clamp a Fresnel term at 0 there.
  Changes black = {{"transmission", 0}, {"specular_tint", 1}};
  probes.push_back({"Layered", "base_color", Side::kUp, 0, 0.06, black});
  black.emplace_back("metallic", 1);
  probes.push_back({"Layered", "base_color", Side::kUp, 0, 0.06, black});
  // What a parameter means to one lobe alone.
  const Changes metal = {{"metallic", 1}, {"alpha", 1}, {"coat_weight", 0}};
  const Changes glass = {{"transmission", 1}, {"metallic", 0}, {"alpha", 1}, {"coat_weight", 0}};
  probes.push_back({"Layered", "specular_tint", Side::kBoth, 0, 0.08, metal});
  probes.push_back({"Layered", "roughness", Side::kBoth, 0, 0.05, metal});
  probes.push_back({"Layered", "roughness", Side::kBoth, 0, 0.05, glass});
  probes.push_back({"Layered", "ior", Side::kBoth, 0, 0.08, glass});
  return probes;
}
INSTANTIATE_TEST_SUITE_P(Parameters, Gradient, testing::ValuesIn(all_probes()),
                         [](const auto& info) {
                           const Probe& p = info.param;
                           const std::string place = p.side == Side::kBoth ? "Inside"
                                                     : p.side == Side::kUp ? "Low"
                                                                           : "High";
                           std::string owner = p.owner;
                           return owner + "_" + p.parameter + "_" + place +
                                  std::to_string(info.index);
                         });

}  // namespace
}  // namespace selenite

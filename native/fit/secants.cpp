// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/secants.h"

#include <algorithm>

namespace selenite {
namespace {

/// Distance of the two pictures in log x (extinction), in log(x - 1) (IOR) and in the coordinate of a
/// roughness. Longer than those of facts sheet "estimators", Q2 (0.3, 0.2, 0.3): noise falls with the
/// length (`./dev bench estimators`), and up and down in turns the differences are central. Fits of
/// three media with two seeds each: mean error 0.29 with the short ones, 0.10 with these. Beyond 0.4
/// of a roughness the difference no longer goes with the slope: see `Coordinates`.
constexpr double kStepLog = 0.5, kStepLogExcess = 0.4;
/// For gradients the noise of the residuals multiplies that of the difference, so the step is longer.
/// Source: `./dev bench estimators`, central 3h/2. Differences by extinction, colours and weights are
/// worse than the derivative there; those by roughness are better where it is low, but the other
/// parameters would pay for two more renders.
constexpr double kGradientStepLogExcess = 0.6;
/// The derivative by IOR is the worse estimate from this ratio of transmission and roughness on.
/// Source: the same; it orders the measured materials.
constexpr double kSharp = 2;

/// Facets that refract one direction into another turn with the IOR, and their density changes over a
/// width like the roughness: the derivative's noise is that of the refracted light divided by it.
/// Facets that mirror stay where they are.
bool refracts_sharply(const Scene& scene, const ParameterRef& ref) {
  if (ref.kind != OwnerKind::kMaterial) return false;
  const Material& material = scene.appearance.materials[static_cast<std::size_t>(ref.owner)];
  Principled<double> sharpest = material.values;
  for (const FieldMap& map : material.maps) {
    const std::string_view name =
        parameter_table(OwnerKind::kMaterial)[static_cast<std::size_t>(map.field)].name;
    if (name == "transmission") sharpest.transmission = 1;
    if (name == "roughness") sharpest.roughness = 0;
    if (name == "metallic") sharpest.metallic = 0;
  }
  return sharpest.transmission * (1 - sharpest.metallic) > kSharp * sharpest.roughness;
}

/// 0: the derivative is good as it is.
double step_for_gradient(const Scene& scene, const ParameterRef& ref,
                         const Parameter& description) {
  const bool pays =
      description.coordinate == Coordinate::kLogExcess && refracts_sharply(scene, ref);
  return pays ? kGradientStepLogExcess : 0;
}

double step_for_instrument(const Parameter& description) {
  switch (description.coordinate) {
    case Coordinate::kLog:
      return kStepLog;
    case Coordinate::kBlur:
      return kBlurSecant;
    case Coordinate::kLogExcess:
      return kStepLogExcess;
    default:
      return 0;
  }
}

double secant_step(const Scene& scene, const ParameterRef& ref, Purpose purpose) {
  const Parameter& description = scene.description(ref);
  if (description.effect != Effect::kSurface && description.effect != Effect::kVolume) return 0;
  return purpose == Purpose::kGradient ? step_for_gradient(scene, ref, description)
                                       : step_for_instrument(description);
}

using Members = std::vector<Eigen::Index>;

/// Components of each parameter.
std::vector<Members> members_of(const Unknowns& unknowns) {
  std::vector<Members> members(unknowns.parameters().size());
  for (int k = 0; k < unknowns.size(); ++k)
    members[static_cast<std::size_t>(unknowns.components()[static_cast<std::size_t>(k)].parameter)]
        .push_back(k);
  return members;
}

/// How far the pictures lie above and below.
struct Reach {
  double up, down;
};

Reach reach_of(double step, Side side) {
  switch (side) {
    case Side::kUp:
      return {step, 0};
    case Side::kDown:
      return {0, step};
    default:
      return {step / 2, step / 2};
  }
}

/// Samples of two renders cannot be multiplied one by one, but their halves can: the even samples of
/// one are independent of the odd ones of the other.
Colorf covariance_of_halves(const Film& film, const SlotFilm& slot, std::size_t i) {
  const int even = (film.spp + 1) / 2, odd = film.spp / 2;
  if (odd == 0) return {};
  const float ratio = static_cast<float>(even) / static_cast<float>(odd);
  return (film.half_a[i] - film.mean[i]) * (slot.half_a[i] - slot.mean[i]) * ratio;
}

/// `per_channel`: what a difference of the pictures is multiplied with.
void put_difference(const Film& high, const Film& low, const Colorf& per_channel, const Film& film,
                    SlotFilm& slot) {
  for (std::size_t i = 0; i < film.size(); ++i) {
    slot.mean[i] = (high.mean[i] - low.mean[i]) * per_channel;
    slot.half_a[i] = (high.half_a[i] - low.half_a[i]) * per_channel;
    slot.covariance[i] = covariance_of_halves(film, slot, i);
  }
}

}  // namespace

Side side_of(Purpose purpose, int iteration) {
  if (purpose == Purpose::kGradient) return Side::kBoth;
  // From above and from below in turns: over two iterations the differences are central.
  return iteration % 2 == 0 ? Side::kUp : Side::kDown;
}

void take_secants(const Problem& problem, const Coordinates& coordinates, const Scene& scene,
                  const Vector& x, Purpose purpose, Side side, const PictureAt& render,
                  Film& film) {
  const Unknowns& unknowns = problem.unknowns;
  const Vector u = coordinates.from_values(x), slope = coordinates.slope(x);
  const std::vector<Members> parameters = members_of(unknowns);
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const Parameter& description = unknowns.descriptions()[p];
    const Members& members = parameters[p];
    const double step = secant_step(scene, unknowns.parameters()[p], purpose);
    // Channels that are diagonal move together: each shows in its own channel of the picture.
    if (step == 0 || (members.size() > 1 && !description.diagonal)) continue;
    const auto moved = [&](double by) {
      Vector to = u;
      for (const Eigen::Index k : members) to[k] += by;
      to = coordinates.to_values(to);
      Vector result = x;
      for (const Eigen::Index k : members) result[k] = to[k];
      return result;
    };
    const auto permitted = [&](double by) {
      const Vector to = moved(by);
      return std::all_of(members.begin(), members.end(), [&](Eigen::Index k) {
        return to[k] >= description.lower && to[k] <= description.upper;
      });
    };
    Reach reach = reach_of(step, side);
    if (reach.up > 0 && !permitted(reach.up)) reach = {0, step};
    if (reach.down > 0 && !permitted(-reach.down)) reach = {step, 0};
    const bool one_sided = !(reach.up > 0 && reach.down > 0);
    const Film above = reach.up > 0 ? render(moved(reach.up), one_sided) : Film();
    const Film below = reach.down > 0 ? render(moved(-reach.down), one_sided) : Film();
    Colorf scale;
    for (int c = 0; c < 3; ++c) {
      // Slots are by the parameter; channel c of a colour has a slope of its own.
      const Eigen::Index k = members[members.size() == 1 ? 0 : static_cast<std::size_t>(c)];
      scale[c] = static_cast<float>(1 / ((reach.up + reach.down) * slope[k]));
    }
    const int slot = problem.layout.rows[static_cast<std::size_t>(members.front())].slot;
    put_difference(reach.up > 0 ? above : film, reach.down > 0 ? below : film, scale, film,
                   film.slots[static_cast<std::size_t>(slot)]);
  }
}

}  // namespace selenite

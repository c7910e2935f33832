// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/finite_differences.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "math/overloaded.h"

namespace selenite {
namespace {

double step_for_instrumental(const Parameter& description, const FiniteDifferenceOptions& options) {
  switch (description.scale) {
    case Scale::kLog:
      return options.log;
    case Scale::kRoughness:
      return options.roughness;
    case Scale::kLogExcess:
      return options.log_excess;
    default:
      return 0;
  }
}

/// 0: the derivative is good as it is. Gradients by extinction, colours and weights are worse as
/// differences. Those by a low roughness are better, but the other parameters would pay for two more
/// renders.
double difference_step(const Scene& scene, const ParameterRef& ref, Purpose purpose,
                       const FiniteDifferenceOptions& options) {
  const Parameter& description = scene.description(ref);
  if (description.scale == Scale::kAngle) return options.angle;
  if (description.effect != Effect::kSurface && description.effect != Effect::kVolume) return 0;
  if (purpose == Purpose::kInstrumental) return step_for_instrumental(description, options);
  return is_sharp_refraction(scene, ref, options) ? options.gradient_log_excess : 0;
}

/// The values of a material with the maps at their extremes: those that refract most and sharpest.
Principled<double> sharpest(const Material& material) {
  Principled<double> values = material.values;
  for (const FieldMap& map : material.maps) {
    if (map.field == material_field(&MaterialValues::transmission)) values.transmission = 1;
    if (map.field == material_field(&MaterialValues::roughness)) values.roughness = 0;
    if (map.field == material_field(&MaterialValues::metallic)) values.metallic = 0;
  }
  return values;
}

/// Whether the direct share of a surface is rendered apart: what lies behind is seen through it as well.
bool has_direct_share(const Scene& scene, const ParameterRef& ref, DirectOf which) {
  if (ref.kind != OwnerKind::kMaterial) return false;
  const Material& material = scene.appearance.materials[static_cast<std::size_t>(ref.owner)];
  if (which == DirectOf::kMedia && !(max_channel(material.values.extinction) > 0)) return false;
  const auto values = sharpest(material);
  return values.transmission * (1 - values.metallic) > 0;
}

/// A parameter whose derivative pictures are differences.
struct FiniteDifference {
  std::vector<Eigen::Index> members;  ///< its components
  double step;                        ///< distance of the two pictures, in `Reparametrization`
  const Parameter& description;
  bool refraction;  ///< see `is_sharp_refraction`
  bool has_direct;  ///< the direct share is rendered apart
};

/// Those of the unknowns, and the parameters that are left.
struct Shares {
  std::vector<FiniteDifference> differences;
  std::vector<ParameterRef> carried;
  std::vector<std::size_t> unseen;  ///< slots of what the photo does not show
  bool of_photo = false;            ///< one is of the photo: its derivative is made of the picture
};

Shares shares_of(const Problem& problem, const Scene& scene, const Photo& photo, Purpose purpose,
                 DirectOf direct, bool differences, const FiniteDifferenceOptions& options) {
  const Unknowns& unknowns = problem.unknowns;
  const auto count = unknowns.parameters().size();
  std::vector<std::vector<Eigen::Index>> members(count);
  for (int k = 0; k < unknowns.size(); ++k)
    members[static_cast<std::size_t>(unknowns.components()[static_cast<std::size_t>(k)].parameter)]
        .push_back(k);
  Shares shares;
  for (std::size_t p = 0; p < count; ++p) {
    if (!unknowns.is_seen(p, scene, photo)) {
      for (const Eigen::Index k : members[p])
        shares.unseen.push_back(
            static_cast<std::size_t>(problem.layout.rows[static_cast<std::size_t>(k)].slot));
      continue;
    }
    const auto of_scene = [&](const ParameterRef& ref) {
      const Parameter& description = unknowns.descriptions()[p];
      // Channels that are diagonal move together: each shows in its own channel of the picture.
      const bool together = members[p].size() == 1 || description.diagonal;
      const double step =
          differences && together ? difference_step(scene, ref, purpose, options) : 0;
      if (step > 0)
        shares.differences.push_back(
            {std::move(members[p]), step, description, is_sharp_refraction(scene, ref, options),
             purpose == Purpose::kInstrumental && description.effect == Effect::kSurface &&
                 has_direct_share(scene, ref, direct)});
      else
        shares.carried.push_back(ref);
    };
    std::visit(Overloaded{of_scene, [&](const PhotoParameterRef&) { shares.of_photo = true; }},
               unknowns.parameters()[p]);
  }
  return shares;
}

/// The slots of the parameters, in portions of what a render takes.
std::vector<SlotLayout> passes_of(const Scene& scene, const std::vector<ParameterRef>& parameters) {
  std::vector<SlotLayout> passes;
  std::vector<ParameterRef> portion;
  for (const ParameterRef& parameter : parameters) {
    portion.push_back(parameter);
    if (SlotLayout(scene, portion).slots.size() <= static_cast<std::size_t>(kMaxSlots)) continue;
    portion.pop_back();
    passes.emplace_back(scene, portion);
    portion = {parameter};
  }
  passes.emplace_back(scene, portion);
  return passes;
}

/// The picture of the first pass, with the derivatives of all in the slots of the problem's layout.
Film render_passes(const SlotLayout& layout, const std::vector<SlotLayout>& passes, const Vector& x,
                   const PictureAt& render) {
  Film film;
  std::vector<SlotFilm> slots(film_slots(layout));
  for (const SlotLayout& pass : passes) {
    Film part = render(x, pass, Paths::kOfFilm);
    for (std::size_t i = 0; i < pass.slots.size(); ++i) {
      const auto to = std::ranges::find(layout.slots, pass.slots[i]) - layout.slots.begin();
      slots[static_cast<std::size_t>(to)] = std::move(part.slots[i]);
    }
    if (&pass == &passes.front())
      film = std::move(part);
    else
      film.dropped += part.dropped;
  }
  film.slots = std::move(slots);
  return film;
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

/// The ends of a difference, one of which may be x itself (none).
struct Ends {
  std::optional<Vector> above, below;
  double apart;
};

Ends ends_of(const FiniteDifference& difference, const Reparametrization& reparametrization,
             const Vector& x, Side side) {
  const Vector u = reparametrization.from_values(x);
  const auto moved = [&](double by) -> std::optional<Vector> {
    if (by == 0) return std::nullopt;
    Vector to = u;
    for (const Eigen::Index k : difference.members) to[k] += by;
    to = reparametrization.to_values(to);
    Vector result = x;
    for (const Eigen::Index k : difference.members) result[k] = to[k];
    return result;
  };
  const auto forbidden = [&](const std::optional<Vector>& to) {
    const Parameter& table = difference.description;
    return to && std::ranges::any_of(difference.members, [&](Eigen::Index k) {
             return (*to)[k] < table.lower || (*to)[k] > table.upper;
           });
  };
  Reach reach = reach_of(difference.step, side);
  if (forbidden(moved(reach.up))) reach = {0, difference.step};
  if (forbidden(moved(-reach.down))) reach = {difference.step, 0};
  return {moved(reach.up), moved(-reach.down), reach.up + reach.down};
}

/// `per_channel`: what a difference of the pictures is multiplied with.
SlotFilm divided_difference(const Film& high, const Film& low, const Colorf& per_channel) {
  SlotFilm slot = std::move(Film(high.width, high.height, high.spp, 1).slots.front());
  for (std::size_t i = 0; i < high.size(); ++i) {
    slot.mean[i] = (high.mean[i] - low.mean[i]) * per_channel;
    slot.half_a[i] = (high.half_a[i] - low.half_a[i]) * per_channel;
  }
  return slot;
}

/// Samples of two renders cannot be multiplied one by one, but their halves can: the even samples of
/// one are independent of the odd ones of the other.
void note_covariance(const Film& film, SlotFilm& slot) {
  const int even = (film.spp + 1) / 2, odd = film.spp / 2;
  if (odd == 0) return;
  const float ratio = static_cast<float>(even) / static_cast<float>(odd);
  for (std::size_t i = 0; i < film.size(); ++i)
    slot.covariance[i] = (film.half_a[i] - film.mean[i]) * (slot.half_a[i] - slot.mean[i]) * ratio;
}

}  // namespace

bool is_sharp_refraction(const Scene& scene, const ParameterRef& ref,
                         const FiniteDifferenceOptions& options) {
  if (ref.kind != OwnerKind::kMaterial || scene.description(ref).scale != Scale::kLogExcess)
    return false;
  const auto values = sharpest(scene.appearance.materials[static_cast<std::size_t>(ref.owner)]);
  return values.transmission * (1 - values.metallic) > options.sharp * values.roughness;
}

Differences differences_of(Purpose purpose, int iteration, const FiniteDifferenceOptions& options) {
  if (purpose == Purpose::kGradient) return {};
  if (iteration < options.first_iterations) return {alternating_side(iteration)};
  const int since = iteration - options.first_iterations, round = options.round;
  return {.side = alternating_side(since / round), .first = since % round, .every = round};
}

Film render_derivatives(const Problem& problem, const Reparametrization* reparametrization,
                        const Scene& scene, const Photo& photo, const Vector& x, Purpose purpose,
                        Differences which, const PictureAt& render,
                        const FiniteDifferenceOptions& options) {
  const Shares shares = shares_of(problem, scene, photo, purpose, which.direct,
                                  reparametrization != nullptr, options);
  const std::vector<SlotLayout> passes = passes_of(scene, shares.carried);
  // Where nothing is carried, and differences have two pictures of their own, no other is needed.
  const bool alone =
      !which.picture && which.side == Side::kBoth && shares.carried.empty() && !shares.of_photo;
  Film film;
  if (!alone) film = render_passes(problem.layout, passes, x, render);
  const Vector slope = shares.differences.empty() ? Vector() : reparametrization->slope(x);
  Film direct;  // at x
  for (int index = 0; const FiniteDifference& difference : shares.differences) {
    if (!which.taken(index++)) continue;
    if (!which.roughnesses && difference.description.scale == Scale::kRoughness) continue;
    if (!which.refractions && difference.refraction) continue;
    const auto [above, below, apart] =
        ends_of(difference, *reparametrization, x, which.side_of(difference.description));
    const bool two_more = alone || (above && below);
    const SlotLayout layout = two_more ? SlotLayout() : passes.front();
    const bool independent = two_more && purpose == Purpose::kGradient;
    const Paths paths = independent ? Paths::kOther : Paths::kOfFilm;
    const auto end = [&](const std::optional<Vector>& to) {
      return to || alone ? render(to.value_or(x), layout, paths) : Film();
    };
    const Film high = end(above), low = end(below);
    if (film.size() == 0) {
      film = Film(high.width, high.height, high.spp);
      film.variance = high.variance;
      film.slots.resize(film_slots(problem.layout));
    }
    Colorf scale;
    for (int c = 0; c < 3; ++c) {
      // Slots are by the parameter; channel c of a colour has a slope of its own.
      const bool colour = difference.members.size() > 1;
      const Eigen::Index k = difference.members[colour ? static_cast<std::size_t>(c) : 0];
      scale[c] = static_cast<float>(1 / (apart * slope[k]));
    }
    const auto slot = static_cast<std::size_t>(
        problem.layout.rows[static_cast<std::size_t>(difference.members.front())].slot);
    film.slots[slot] =
        divided_difference(high.size() > 0 ? high : film, low.size() > 0 ? low : film, scale);
    if (!independent && !alone) note_covariance(film, film.slots[slot]);
    if (!difference.has_direct) continue;
    const auto direct_end = [&](const std::optional<Vector>& to) {
      return to || alone ? render(to.value_or(x), layout, Paths::kDirect) : Film();
    };
    const Film above_direct = direct_end(above), below_direct = direct_end(below);
    if (!two_more && direct.size() == 0) direct = render(x, layout, Paths::kDirect);
    SlotFilm apart_from_rest =
        divided_difference(above_direct.size() > 0 ? above_direct : direct,
                           below_direct.size() > 0 ? below_direct : direct, scale);
    film.slots[slot].direct = std::move(apart_from_rest.mean);
    film.slots[slot].direct_half_a = std::move(apart_from_rest.half_a);
  }
  if (film.size() == 0) film = render_passes(problem.layout, passes, x, render);
  for (const std::size_t slot : shares.unseen)
    film.slots[slot] = std::move(Film(film.width, film.height, film.spp, 1).slots.front());
  return film;
}

}  // namespace selenite

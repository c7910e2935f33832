// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/secants.h"

#include <algorithm>

namespace selenite {
namespace {

/// Steps in log x and log(x - 1). Source: facts sheet "estimators", Q2 (recipe iv).
constexpr double kStepLog = 0.3, kStepLogExcess = 0.2;

/// Of one parameter; 0: its derivative is good as it is.
double secant_step(const Parameter& description) {
  if (description.effect != Effect::kSurface && description.effect != Effect::kVolume) return 0;
  switch (description.coordinate) {
    case Coordinate::kLog:
    case Coordinate::kBlur:
      return kStepLog;
    case Coordinate::kLogExcess:
      return kStepLogExcess;
    default:
      return 0;
  }
}

}  // namespace

void take_secants(const Problem& problem, const Coordinates& coordinates, const Vector& x,
                  Side side, const PictureAt& render, Film& film) {
  const Unknowns& unknowns = problem.unknowns;
  const Vector u = coordinates.from_values(x), slope = coordinates.slope(x);
  for (std::size_t p = 0; p < unknowns.parameters().size(); ++p) {
    const Parameter& description = unknowns.descriptions()[p];
    const double step = secant_step(description);
    std::vector<Eigen::Index> members;
    for (int k = 0; k < unknowns.size(); ++k)
      if (unknowns.components()[static_cast<std::size_t>(k)].parameter == static_cast<int>(p))
        members.push_back(k);
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
    double up = side == Side::kDown ? 0 : side == Side::kUp ? step : step / 2;
    double down = side == Side::kUp ? 0 : side == Side::kDown ? step : step / 2;
    if (up > 0 && !permitted(up)) up = 0, down = step;
    if (down > 0 && !permitted(-down)) down = 0, up = step;
    const Film above = up > 0 ? render(moved(up)) : Film();
    const Film below = down > 0 ? render(moved(-down)) : Film();
    const Film& high = up > 0 ? above : film;
    const Film& low = down > 0 ? below : film;
    SlotFilm& slot = film.slots[static_cast<std::size_t>(
        problem.layout.rows[static_cast<std::size_t>(members.front())].slot)];
    for (std::size_t i = 0; i < film.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        // Slots are by the parameter; channel c of a colour has a slope of its own.
        const Eigen::Index k = members[members.size() == 1 ? 0 : static_cast<std::size_t>(c)];
        const float scale = static_cast<float>(1 / ((up + down) * slope[k]));
        slot.mean[i][c] = (high.mean[i][c] - low.mean[i][c]) * scale;
        slot.half_a[i][c] = (high.half_a[i][c] - low.half_a[i][c]) * scale;
      }
  }
}

}  // namespace selenite

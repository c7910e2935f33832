// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/optimiser.h"

#include <array>
#include <optional>
#include <string>

#include "fit/solver/adam.h"
#include "fit/solver/gauss_newton.h"
#include "math/fault.h"

namespace selenite {
namespace {

template <class Kind>
std::unique_ptr<Optimiser> make(const Problem& problem) {
  return std::make_unique<Kind>(problem);
}

constexpr std::array kOptimisers{
    OptimiserKind{
        "adam",
        "Gradient steps with momentum, one learning rate per parameter: any loss, any number "
        "of unknowns",
        1, false, false, false, false, Purpose::kGradient, make<Adam>},
    OptimiserKind{
        "gauss-newton",
        "Least squares over all iterations with accumulated derivative images: few unknowns, "
        "tens of times fewer samples. Learning rates are not used",
        2, true, true, true, true, Purpose::kInstrumental, make<GaussNewton>},
};

/// Why a kind does not go with the settings; nothing if it does.
std::optional<Fault> obstacle(const OptimiserKind& kind, const Loss& loss, int spp,
                              bool accumulate) {
  const std::string who = "optimiser = '" + std::string(kind.name) + "' ";
  if (kind.least_squares_only && !loss.least_squares)
    return Fault{"",
                 who + "minimises squares and cannot take loss = '" + std::string(loss.name) + "'",
                 "choose dual-buffer, or optimiser = 'adam'"};
  if (spp < kind.least_spp)
    return Fault{"",
                 who + "needs spp of at least " + std::to_string(kind.least_spp) + ", not " +
                     std::to_string(spp),
                 ""};
  if (kind.needs_all_photos && !accumulate)
    return Fault{"", who + "steps once for all cameras",
                 "set accumulate, or choose optimiser = 'adam'"};
  return std::nullopt;
}

}  // namespace

std::span<const OptimiserKind> optimisers() { return kOptimisers; }

const OptimiserKind& choose_optimiser(std::string_view name, int unknowns, const Loss& loss,
                                      int spp, bool accumulate) {
  if (name == "auto") {
    for (const OptimiserKind& kind : kOptimisers)
      if (kind.few_unknowns && unknowns <= kFewUnknowns && !obstacle(kind, loss, spp, accumulate))
        return kind;
    name = "adam";
  }
  std::string names = "auto";
  for (const OptimiserKind& kind : kOptimisers) {
    names += ", " + std::string(kind.name);
    if (kind.name != name) continue;
    if (auto fault = obstacle(kind, loss, spp, accumulate))
      throw Refused(std::vector{*std::move(fault)});
    return kind;
  }
  throw Refused("", "optimiser = '" + std::string(name) + "' is unknown", "choose one of " + names);
}

}  // namespace selenite

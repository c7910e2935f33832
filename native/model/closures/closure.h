// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "math/vec.h"
#include "model/closures/conductor.h"
#include "model/closures/diffuse.h"
#include "model/closures/emission.h"
#include "model/closures/full_principled.h"
#include "model/closures/glass.h"
#include "model/closures/glossy.h"
#include "model/closures/metallic.h"
#include "model/closures/refraction.h"
#include "model/closures/sheen.h"
#include "model/closures/subsurface.h"
#include "model/closures/translucent.h"
#include "model/closures/transparent.h"

namespace selenite {

/// What a surface is made of, with the values of its sockets.
template <class T>
using Closure =
    std::variant<closures::FullPrincipled<T>, closures::Diffuse<T>, closures::Glossy<T>,
                 closures::Glass<T>, closures::Refraction<T>, closures::Translucent<T>,
                 closures::Transparent<T>, closures::Emission<T>, closures::Subsurface<T>,
                 closures::Sheen<T>, closures::Metallic<T>, closures::Conductor<T>>;

/// Which of them, in their order.
enum class ClosureKind {
  kPrincipled,
  kDiffuse,
  kGlossy,
  kGlass,
  kRefraction,
  kTranslucent,
  kTransparent,
  kEmission,
  kSubsurface,
  kSheen,
  kMetallic,
  kConductor
};
/// Their names, by kind.
inline constexpr std::array<std::string_view, 12> kClosureNames{
    "principled",  "diffuse",  "glossy",     "glass", "refraction", "translucent",
    "transparent", "emission", "subsurface", "sheen", "metallic",   "conductor"};
static_assert(kClosureNames.size() == std::variant_size_v<Closure<double>>);

/// More closures at one point are refused by who reads a material. Cycles has room for 64.
inline constexpr int kMostClosures = 16;

/// A closure of this kind at its defaults.
template <class T, std::size_t Index = 0>
Closure<T> default_closure(ClosureKind kind) {
  if constexpr (Index + 1 < std::variant_size_v<Closure<T>>)
    if (static_cast<std::size_t>(kind) != Index) return default_closure<T, Index + 1>(kind);
  return Closure<T>(std::in_place_index<Index>);
}

/// Calls `visit(Parameter, member)` for each parameter of whatever closure it is.
template <class AnyClosure, class Visit>
void closure_fields(AnyClosure& closure, Visit&& visit) {
  std::visit([&](auto& c) { std::decay_t<decltype(c)>::fields(c, visit); }, closure);
}

/// The same closure over another scalar, without its derivatives.
template <class To, class T>
Closure<To> values_as(const Closure<T>& closure) {
  constexpr std::size_t kMostFields = 32;
  std::array<Color<scalar_t<T>>, kMostFields> values;
  std::size_t count = 0;
  closure_fields(closure, [&](const Parameter&, const auto& x) {
    if constexpr (requires { x.r; })
      values[count++] = value_of(x);
    else
      values[count++] = Color<scalar_t<T>>(value_of(x));
  });
  auto result = default_closure<To>(static_cast<ClosureKind>(closure.index()));
  count = 0;
  closure_fields(result, [&](const Parameter&, auto& x) {
    if constexpr (requires { x.r; })
      x = Color<To>(values[count++]);
    else
      x = To(values[count++].r);
  });
  return result;
}

/// One closure of a mixture.
template <class T>
struct PlacedClosure {
  Closure<T> closure;
  Flavour flavour;
  T weight{1};                  ///< of its mixture, at least 0
  Vec3<scalar_t<T>> n;          ///< its shading normal, unit, world frame, on the viewer's side
  Vec3<scalar_t<T>> tangent{};  ///< of two widths, world frame, see SurfacePoint
  /// The tangent with its derivatives, if it has any.
  std::optional<Vec3<T>> rotating{};
  /// The normal with its derivatives, if it has any.
  std::optional<Vec3<T>> turning{};
};

}  // namespace selenite

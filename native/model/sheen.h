// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "math/sampling.h"
#include "model/parameter.h"
#include "model/shading_normal.h"
#include "model/tables/sheen_table.h"
#include "model/tables/table_axis.h"

namespace selenite {

template <class T>
struct SheenParameters {
  T sheen_weight{0};
  T sheen_roughness{0.5};
  Color<T> sheen_tint{T(1)};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(Parameter{.name = "sheen_weight",
                    .sockets = "Sheen Weight",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .versions = Versions::k2,
                    .optional = true,
                    .help = "Strength of the reflection by fibres on the surface, as on velvet"},
          m.sheen_weight);
    visit(Parameter{.name = "sheen_roughness",
                    .sockets = "Sheen Roughness",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0.1,
                    .fit_upper = 1,
                    .initial = 0.5,
                    .versions = Versions::k2,
                    .help = "How far the fibres' reflection reaches from the rim inwards"},
          m.sheen_roughness);
    visit(Parameter{.name = "sheen_tint",
                    .sockets = "Sheen Tint",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .diagonal = false,
                    .versions = Versions::k2,
                    .help = "Colour of the fibres' reflection"},
          m.sheen_tint);
  }
};

/// Reflection by fibres that stand on the surface, like those of velvet or dust: a cosine lobe under
/// a linear transformation M that depends on roughness and the viewer's direction. In the frame whose
/// z axis is the shading normal and whose x axis lies in the viewer's plane,
///
///     M^-1 o = (a x + b z, a y, z),   f cos = R z / pi (a / |M^-1 o|^2)^2.
///
/// The part without the albedo R is a density over the hemisphere. Source: Zeltner, Burley and Chiang
/// 2022; a, b and R are a fit without a formula, measured in Cycles by devtools/measure_sheen.py.
template <class T>
class Sheen {
  using S = scalar_t<T>;

 public:
  using Parameters = SheenParameters<T>;
  /// What is said of a material that has it.
  static constexpr const char* kSeenAs = "has sheen";
  static const T& share(const Parameters& m) { return m.sheen_weight; }
  static const Color<T>& tint(const Parameters& m) { return m.sheen_tint; }
  /// Whether value and directions have derivatives.
  static bool shape_moves(const Parameters& m) { return has_slope(m.sheen_roughness); }

  Sheen(const Parameters& m, const SurfacePoint<S>& point)
      : Sheen(clamp01(m.sheen_roughness), point.n, point.wi) {}
  Sheen() = default;
  /// n: shading normal, world frame, like wi, the viewer's direction.
  Sheen(const T& roughness, const Vec3<S>& n, const Vec3<S>& wi) : z_(n) {
    const Vec3<S> across = cross(n, wi);
    using std::sqrt;
    const S length2 = dot(across, across);
    // Seen exactly along the normal the lobe has a direction all the same: that of Cycles' frame.
    y_ = length2 > 0 ? across / sqrt(length2) : cross(n, axis_of_normal(n));
    x_ = cross(y_, n);
    const Cell<S> c(dot(n, wi), kNodes);
    const auto entries =
        narrow_all(clamp(roughness, kLeastRoughness, S(1)), T(0), [&](const auto& r, const auto&) {
          using X = std::decay_t<decltype(r)>;
          const Cell<X> k(r, kNodes);
          std::array<X, 3> entry;
          for (int i = 0; i < 3; ++i) {
            const auto row = [&](int at) {
              return c.mix(kSheenTable[i][at][c.index], kSheenTable[i][at][c.index + 1]);
            };
            entry[i] = k.mix(row(k.index), row(k.index + 1));
          }
          return entry;
        });
    a_ = entries[0];
    b_ = entries[1];
    albedo_ = entries[2];
  }

  /// Whether there is a lobe: Cycles leaves it out where the table says next to nothing.
  bool exists() const { return value_of(a_) >= kLeast && value_of(albedo_) >= kLeast; }
  const T& albedo() const { return albedo_; }

  /// f cos / albedo towards wo, world frame, in the hemisphere of the normal.
  T value(const Vec3<S>& wo) const {
    const S x = dot(x_, wo), y = dot(y_, wo), z = dot(z_, wo);
    return narrow(a_, b_, [&](const auto& a, const auto& b) {
      const auto along = a * x + b * z, beside = a * y;
      return square(a / (square(along) + square(beside) + z * z)) * (z * kInvPi<S>);
    });
  }
  /// The same without derivatives: the density of `sample`.
  S density(const Vec3<S>& wo) const {
    const S a = value_of(a_), b = value_of(b_), z = dot(z_, wo);
    const S along = a * dot(x_, wo) + b * z, beside = a * dot(y_, wo);
    return square(a / (square(along) + square(beside) + z * z)) * (z * kInvPi<S>);
  }
  Vec3<S> sample(S u1, S u2) const {
    const Vec3<S> d = square_to_cosine_hemisphere(u1, u2);
    const S inverse = 1 / value_of(a_);
    return normalize(x_ * ((d.x - value_of(b_) * d.z) * inverse) + y_ * (d.y * inverse) + z_ * d.z);
  }

 private:
  static constexpr int kNodes = 32;
  static constexpr S kLeastRoughness = S(1e-3), kLeast = S(1e-5);

  static Vec3<S> axis_of_normal(const Vec3<S>& n) {
    const bool diagonal = n.x == n.y && n.x == n.z;
    return normalize(diagonal ? Vec3<S>{n.z - n.y, n.x + n.z, -n.y - n.x}
                              : Vec3<S>{n.z - n.y, n.x - n.z, n.y - n.x});
  }

  Vec3<S> x_{}, y_{}, z_{};
  T a_{}, b_{}, albedo_{};
};

}  // namespace selenite

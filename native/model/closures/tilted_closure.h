// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/tilted.h"
#include "model/closures/closure_bsdf.h"

namespace selenite {

/// A closure as a function of its shading normal, for the derivatives by what turns that. Directions
/// are constants: the value at a drawn one is differentiated, as by all parameters, and its density is
/// not. A mirror's direction turns with the normal, which no derivative of the value says.
template <class S>
class TiltedClosure {
 public:
  using X = Tilted<S>;

  /// `at`: of the surface. `n`: the closure's own normal; it tilts towards the axes s and t of
  /// `Frame::from_normal`.
  TiltedClosure(const Closure<X>& closure, const Flavour& flavour, S weight,
                const SurfacePoint<S>& at, const Vec3<S>& n);

  /// Value towards wo without what is singular, the bump terminator included.
  Color<X> value(const Vec3<S>& wo) const;
  /// The same where it has drawn wo; `diffuse`: from a diffuse lobe.
  Color<X> value_of_drawn(const Vec3<S>& wo, bool diffuse) const;
  /// Relative derivatives of the density with which light enters along wo; see `entry_change`.
  X entry_change(const Vec3<S>& wo) const;
  void keep(RayKinds kinds);

 private:
  /// What the tilted normal takes away at the terminator.
  Color<X> lost(const Vec3<X>& wo) const;

  SurfacePoint<X> point_;
  ClosureBsdf<X> bsdf_;
  Vec3<X> smooth_;
  bool skin_;
};

extern template class TiltedClosure<float>;
extern template class TiltedClosure<double>;

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "math/color.h"
#include "model/narrow.h"
#include "model/thin_film.h"

namespace selenite {

/// Reflectance of metal of index n and extinction k at each channel: the form for large n^2 + k^2 of
/// Fresnel's equations, which Blender 4 takes, or these themselves. A film may lie on it.
template <class T>
struct ConductorFresnel {
  using S = scalar_t<T>;

  Color<T> n, k;
  bool exact = false;
  std::optional<FilmedMetal<T>> film{};

  /// c: cosine to the micronormal, > 0.
  Color<T> at(S c) const {
    if (film) return film->at(c);
    Color<T> f;
    for (int i = 0; i < 3; ++i)
      f[i] = narrow(n[i], k[i], [&](const auto& x, const auto& y) { return channel(x, y, c); });
    return f;
  }
  /// Mean over the hemisphere of the Schlick curve through the values at cosine 1 and 1/7.
  Color<T> mean() const {
    const S edge_cosine = S(1) / 7;
    Color<T> f;
    for (int i = 0; i < 3; ++i)
      f[i] = narrow(n[i], k[i], [&](const auto& x, const auto& y) {
        using X = std::decay_t<decltype(x)>;
        const X f0 = channel(x, y, S(1)), edge = channel(x, y, edge_cosine);
        const X bump = MetalFresnel<X>::bump_of(f0, edge);
        return clamp01(X(f0 + (X(1) - f0) * (S(1) / 21) - bump * (S(1) / 126)));
      });
    return f;
  }

 private:
  template <class X>
  X channel(const X& n, const X& k, S c) const {
    if (exact) {
      const MetalAmplitudes<X> found(MetalBelow<X>{n, k}, X(1), X(c));
      return (found.across2 + found.along2) * S(0.5);
    }
    const X q = n * n + k * k, cross = n * (2 * c), c2(c * c);
    const X along = (q * (c * c) + X(1) - cross) / (q * (c * c) + X(1) + cross);
    const X across = (q + c2 - cross) / (q + c2 + cross);
    return (along + across) * S(0.5);
  }
};

}  // namespace selenite

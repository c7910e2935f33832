// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/narrow.h"

namespace selenite {

/// Reflectance of metal of index n and extinction k at each channel: the form for large n^2 + k^2 of
/// Fresnel's equations, which Cycles takes.
template <class T>
struct ConductorFresnel {
  using S = scalar_t<T>;

  Color<T> n, k;

  /// c: cosine to the micronormal, > 0.
  Color<T> at(S c) const {
    Color<T> f;
    for (int i = 0; i < 3; ++i)
      f[i] = narrow(n[i], k[i], [c](const auto& x, const auto& y) { return channel(x, y, c); });
    return f;
  }
  /// Mean over the hemisphere of the Schlick curve through the values at cosine 1 and 1/7.
  Color<T> mean() const {
    const S edge_cosine = S(1) / 7, q = S(6) / 7, q5 = q * q * q * q * q;
    Color<T> f;
    for (int i = 0; i < 3; ++i)
      f[i] = narrow(n[i], k[i], [&](const auto& x, const auto& y) {
        using X = std::decay_t<decltype(x)>;
        const X f0 = channel(x, y, S(1)), edge = channel(x, y, edge_cosine);
        const X bump = (f0 + (X(1) - f0) * q5 - edge) * (S(7) / (q5 * q));
        return clamp01(X(f0 + (X(1) - f0) * (S(1) / 21) - bump * (S(1) / 126)));
      });
    return f;
  }

 private:
  template <class X>
  static X channel(const X& n, const X& k, S c) {
    const X q = n * n + k * k, cross = n * (2 * c), c2(c * c);
    const X along = (q * (c * c) + X(1) - cross) / (q * (c * c) + X(1) + cross);
    const X across = (q + c2 - cross) / (q + c2 + cross);
    return (along + across) * S(0.5);
  }
};

}  // namespace selenite

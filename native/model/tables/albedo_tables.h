// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "model/tables/table_axis.h"

namespace selenite {

/// Directional albedos of single-scattering GGX lobes, which Cycles reads for energy compensation and
/// for layering. They are integrals without closed form; Cycles interpolates tables of them, and
/// rendering what Cycles renders means interpolating at the same nodes. The values are worked out by
/// our own quadrature (quadrature/) when Selenite is built.
///
/// Axes, all uniform on [0, 1]: roughness, cosine c of the viewer's direction, and
/// z = sqrt(|n - 1| / (n + 1)) for the index of refraction n. Only c differs from lane to lane.
class AlbedoTables {
 public:
  static constexpr int kFine = 32, kCoarse = 16;

  static const AlbedoTables& get();

  /// Reflection lobe with reflectance 1.
  template <class T, class C>
  auto mirror(const T& roughness, const C& c) const {
    return narrow(roughness, [&](const auto& x) {
      const Cell<std::decay_t<decltype(x)>> i(x, kFine);
      const Cell<C> j(c, kFine);
      const auto row = [&](int k) {
        const float* entries = mirror_[k].data();
        return j.mix(entry<C>(entries, j.index), entry<C>(entries + 1, j.index));
      };
      return i.mix(row(i.index), row(i.index + 1));
    });
  }
  /// Its cosine-weighted mean over c.
  template <class T>
  T mirror_mean(const T& roughness) const {
    return narrow(roughness, [&](const auto& x) {
      const Cell<std::decay_t<decltype(x)>> i(x, kFine);
      using S = scalar_t<T>;
      return i.mix(S(mirror_mean_[i.index]), S(mirror_mean_[i.index + 1]));
    });
  }
  /// Mean over visible micronormals of the rise of the dielectric reflectance (see fresnel.h);
  /// reflections that end below the horizon count 0.
  template <class T, class C>
  auto rise(const T& roughness, const C& c, const T& z) const {
    return look_up(rise_, roughness, c, z);
  }
  /// White glass lobe, reflection and refraction; `optically_thinner`: the far side has the lower
  /// index of refraction.
  template <class T, class C>
  auto glass(const T& roughness, const C& c, const T& z, bool optically_thinner) const {
    return look_up(glass_[optically_thinner], roughness, c, z);
  }
  template <class T>
  T glass_mean(const T& roughness, const T& z, bool optically_thinner) const {
    const auto& table = glass_mean_[optically_thinner];
    return narrow(roughness, z, [&](const auto& x, const auto& y) {
      using X = std::decay_t<decltype(x)>;
      const Cell<X> i(x, kCoarse), k(y, kCoarse);
      using S = scalar_t<T>;
      const auto row = [&](int a) { return k.mix(S(table[a][k.index]), S(table[a][k.index + 1])); };
      return i.mix(row(i.index), row(i.index + 1));
    });
  }

 private:
  AlbedoTables();
  void fill_fine(int i);
  void fill_coarse(int i);
  void fill_glass(int i, int j);

  template <int N>
  using Row = std::array<float, N>;
  using Cube = std::array<std::array<Row<kCoarse>, kCoarse>, kCoarse>;  // roughness, c, z

  template <class T, class C>
  auto look_up(const Cube& table, const T& roughness, const C& c, const T& z) const {
    const Cell<C> j(c, kCoarse);
    const auto start = j.index * kCoarse;  // of the row of z
    return narrow(roughness, z, [&](const auto& x, const auto& y) {
      using X = std::decay_t<decltype(x)>;
      const Cell<X> i(x, kCoarse), k(y, kCoarse);
      const auto at = [&](int a, int b) {
        const float* entries = table[a].data()->data() + b;
        return j.mix(entry<C>(entries, start), entry<C>(entries + kCoarse, start));
      };
      const auto row = [&](int a) { return k.mix(at(a, k.index), at(a, k.index + 1)); };
      return i.mix(row(i.index), row(i.index + 1));
    });
  }

  std::array<Row<kFine>, kFine> mirror_;
  Row<kFine> mirror_mean_;
  Cube rise_;
  std::array<Cube, 2> glass_;
  std::array<std::array<Row<kCoarse>, kCoarse>, 2> glass_mean_;
};

}  // namespace selenite

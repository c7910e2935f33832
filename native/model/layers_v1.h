// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/layers.h"

namespace selenite {

/// The Principled BSDF of Blender 3.x, distribution GGX: diffuse, one reflection for the dielectric and
/// the metal, and glass, side by side. Nothing is layered.
template <class T>
void Layers<T>::stack_version1(const Principled<U>& m, const U& alpha, bool backfacing) {
  bare_refraction = true;
  const U metallic = clamp01(m.metallic), dielectric = U(1) - metallic;
  const U transmission = clamp01(m.transmission) * dielectric;
  const U roughness = clamp01(m.roughness), tinted = clamp01(m.specular_tint.r);
  const Color<U> base = map(m.base_color, nonnegative);
  const auto mix = [&](const Color<U>& target) {  // white to target, by the specular tint
    return map(target, [&](const U& c) { return U(1) + tinted * (c - U(1)); });
  };
  emission = Color<T>(m.emission_color * (m.emission_strength * alpha));

  diffuse = Color<T>(base * (alpha * dielectric * (U(1) - clamp01(m.transmission))));
  if (matters(diffuse)) {
    retro_roughness = roughness;
    present[kDiffuse] = true;
    estimate_[kDiffuse] = value_of(mean_channel(diffuse));
    carries_slope_[kDiffuse] = active_.move(diffuse) || has_slope(roughness);
  }

  const U opaque = alpha * (U(1) - transmission);
  const U level = nonnegative(m.specular_level);
  if (matters(opaque) && (matters(level) || matters(metallic))) {
    const U reflectance = level * R(0.08);
    const U least = value_of(reflectance) < square(kLeastAmplitude) && has_slope(reflectance)
                        ? with_value(reflectance, square(kLeastAmplitude))
                        : reflectance;
    // Hue and saturation of the base colour without its luminance; the weights are Disney's, found
    // again in measurements of Blender 3.4.
    const U luminance = base.r * R(0.3) + base.g * R(0.6) + base.b * R(0.1);
    const Color<U> hue = value_of(luminance) > 0 ? base / luminance : Color<U>(U(1));
    const Color<U> f0 = mix(hue) * (reflectance * dielectric) + base * metallic;
    specular.rise = DielectricRise<U>(
        Dielectric<U>::from_amplitude(capped_root(least, kLeastAmplitude)).excess);
    specular.flat = Color<T>(f0 * opaque);
    specular.risen = Color<T>((Color<U>(U(1)) - f0) * opaque);
    present[kSpecular] = true;
    estimate_[kSpecular] = value_of(mean_channel(specular.at(cos_i_)));
    carries_slope_[kSpecular] = moves(specular) || has_slope(width2);
  }

  const U glass_weight = alpha * transmission;
  if (matters(glass_weight)) {
    const U ior = max(m.ior, U(R(1e-5)));
    eta = backfacing ? U(1) / ior : ior;
    const auto d = Dielectric<U>::from_ior(eta);
    const T reflected = fresnel_dielectric(cos_i_, d.excess);
    const U smoothness = (U(1) - roughness) * (U(1) - clamp01(m.transmission_roughness));
    through_width2 = square(square(U(1) - smoothness));
    const Color<U> f0 = mix(base);
    const T mirrors = glass_weight * reflected;
    if (matters(mirrors))
      glass = {f0 * mirrors, (Color<U>(U(1)) - f0) * mirrors, DielectricRise<U>(d.excess)};
    const Color<T> through = base * (glass_weight * max(T(1) - reflected, T(S(1e-4))));
    if (matters(through)) glass_through = through;
    present[kGlass] = true;
    const S mirrored = value_of(mean_channel(glass.flat + glass.risen));
    const S refracted = value_of(mean_channel(glass_through));
    estimate_[kGlass] = mirrored + refracted;
    carries_slope_[kGlass] = moves(glass) || active_.move(glass_through) || has_slope(eta) ||
                             has_slope(width2) || has_slope(through_width2);
    macro_reflected = select(estimate_[kGlass] > S(0), S(mirrored / estimate_[kGlass]), S(0.5));
    if (carries_slope_[kGlass]) macro_reflected = clamp(macro_reflected, S(0.05), S(0.95));
  }
}

}  // namespace selenite

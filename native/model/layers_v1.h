// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/layers.h"

namespace selenite {

/// The Principled BSDF of Blender 3.x, distribution GGX: diffuse, one reflection for the dielectric and
/// the metal, and glass, side by side. Nothing is layered.
template <class T>
void Layers<T>::stack_version1(const Principled<T>& m, const T& alpha, bool backfacing) {
  const T metallic = clamp01(m.metallic), dielectric = T(1) - metallic;
  const T transmission = clamp01(m.transmission) * dielectric;
  const T roughness = clamp01(m.roughness), tinted = clamp01(m.specular_tint.r);
  const Color<T> base = map(m.base_color, nonnegative);
  const auto mix = [&](const Color<T>& target) {  // white to target, by the specular tint
    return map(target, [&](const T& c) { return T(1) + tinted * (c - T(1)); });
  };
  emission = m.emission_color * (m.emission_strength * alpha);

  diffuse = base * (alpha * dielectric * (T(1) - clamp01(m.transmission)));
  if (matters(diffuse)) {
    retro_roughness = roughness;
    present[kDiffuse] = true;
    estimate_[kDiffuse] = value_of(mean_channel(diffuse));
    carries_slope_[kDiffuse] = has_slope(diffuse) || has_slope(roughness);
  }

  const T opaque = alpha * (T(1) - transmission);
  const T level = nonnegative(m.specular_level);
  if (matters(opaque) && (matters(level) || matters(metallic))) {
    const T reflectance = level * S(0.08);
    const T least = value_of(reflectance) < square(kLeastAmplitude) && has_slope(reflectance)
                        ? with_value(reflectance, square(kLeastAmplitude))
                        : reflectance;
    // Hue and saturation of the base colour without its luminance; the weights are Disney's, found
    // again in measurements of Blender 3.4.
    const T luminance = base.r * S(0.3) + base.g * S(0.6) + base.b * S(0.1);
    const Color<T> hue = value_of(luminance) > 0 ? base / luminance : Color<T>(T(1));
    const Color<T> f0 = mix(hue) * (reflectance * dielectric) + base * metallic;
    specular.rise = DielectricRise<T>(
        Dielectric<T>::from_amplitude(capped_root(least, kLeastAmplitude)).excess);
    specular.flat = f0 * opaque;
    specular.risen = (Color<T>(T(1)) - f0) * opaque;
    present[kSpecular] = true;
    estimate_[kSpecular] = value_of(mean_channel(specular.at(cos_i_)));
    carries_slope_[kSpecular] = specular.has_slope() || has_slope(width2);
  }

  const T glass_weight = alpha * transmission;
  if (matters(glass_weight)) {
    const T ior = max(m.ior, T(S(1e-5)));
    eta = backfacing ? T(1) / ior : ior;
    const auto d = Dielectric<T>::from_ior(eta);
    const T reflected = fresnel_dielectric(T(cos_i_), d.excess);
    const T smoothness = (T(1) - roughness) * (T(1) - clamp01(m.transmission_roughness));
    through_width2 = square(square(T(1) - smoothness));
    const Color<T> f0 = mix(base);
    const T mirrors = glass_weight * reflected;
    if (matters(mirrors))
      glass = {f0 * mirrors, (Color<T>(T(1)) - f0) * mirrors, DielectricRise<T>(d.excess)};
    const Color<T> through = base * (glass_weight * max(T(1) - reflected, T(S(1e-4))));
    if (matters(through)) glass_through = through;
    present[kGlass] = true;
    const S mirrored = value_of(mean_channel(glass.flat + glass.risen));
    const S refracted = value_of(mean_channel(glass_through));
    estimate_[kGlass] = mirrored + refracted;
    carries_slope_[kGlass] = has_slope(glass.flat) || has_slope(glass.risen) ||
                             has_slope(glass_through) || has_slope(eta) || has_slope(width2) ||
                             has_slope(through_width2);
    macro_reflected = estimate_[kGlass] > 0 ? mirrored / estimate_[kGlass] : S(0.5);
    if (carries_slope_[kGlass]) macro_reflected = clamp(macro_reflected, S(0.05), S(0.95));
  }
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "scene/scene.h"

namespace selenite {

/// What some rays see and others do not, or some lights shine on and others do not. A scene without
/// any of it is rendered by shorter ways. Source: docs/method/rendering.md, "Visibility".
struct Visibility {
  /// `transparent`: one each of the materials, whether it lets rays pass straight through.
  Visibility(const Scene& scene, const std::vector<bool>& transparent);

  /// Not all rays meet the same things, or lights: what is rendered depends on how much of the light
  /// comes by a light sample, which is weighted by the densities of Cycles.
  bool uneven = false;
  bool shadow_links = false;  ///< of lamps
  bool hidden_media = false;  ///< an object is hidden from shadow rays, and with it its medium
  bool holdouts = false;
  bool seen_lamps = false;  ///< by the camera
  bool film_through_glass = false;

  /// What the lanes do not know of; empty if there is nothing.
  std::string lanes_obstacle() const;
};

}  // namespace selenite

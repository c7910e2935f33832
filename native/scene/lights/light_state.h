// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/scene.h"

namespace selenite {

/// Which lights of a scene are on, and where its lamps stand. Geometry stays shared: lamps are no part
/// of it.
///
/// Lamps are called by the object that places them; a name that is no object's is that of a lamp, at all
/// of its places.
struct LightState {
  /// A lamp that stands elsewhere than in the scene.
  struct Place {
    std::string lamp;
    Transform to_world;
    /// Where it is not that of the scene: of a lamp whose radiance is fixed it goes with the area.
    std::optional<double> radiance_scale{};
  };

  std::optional<std::vector<std::string>> lamps{};  ///< that are on; none: all
  bool world = true;
  std::vector<Place> places{};

  /// UnknownName: lamps that the scene does not have, with those it has. InvalidArgument: a lamp that is
  /// moved has several places or is moved twice, or a matrix that no lamp can have. `who` begins the
  /// message.
  void check(const Scene& scene, const std::string& who) const;
  /// The scene under these lights. Names that it does not know change nothing: see `check`.
  Scene applied_to(Scene scene) const;
  /// Whether a parameter of the scene can show under them; else its derivative is 0.
  bool shows(const Scene& scene, const ParameterRef& ref) const;
  std::uint64_t fingerprint() const;
};

}  // namespace selenite

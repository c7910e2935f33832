// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "math/vec.h"
#include "model/principled.h"

namespace selenite {

/// One line of a table of BSDF values, evaluated in double precision.
struct Probe {
  Principled<double> material;
  Flavour flavour;
  Vec3d wi{0, 0, 1};  ///< unit, to the viewer; z is the outside normal of the surface
  Vec3d wo{0, 0, 1};  ///< unit, to the light, same frame

  /// Sets what a column of the table stands for: a parameter by its name (a channel of a colour by
  /// `name_r`, `name_g`, `name_b`; `base_r` is short for `base_color_r`), or wi_x ... wo_z, or
  /// distribution (GGX, MULTI_GGX). The columns of Blender 3.x, `specular` and a `specular_tint`
  /// without channel, choose version 1. Numbers are rounded to 32 bits first, as Blender's sockets hold
  /// them. Returns false for a column that means nothing here (results, remarks).
  /// Throws std::invalid_argument for a value that is not a number, and for one of a feature that the
  /// model leaves out (sheen, transmission roughness).
  bool set(std::string_view column, const std::string& value);
};

/// Derivative of the value by one scalar parameter, or by one channel of a colour.
struct ProbeSlope {
  std::string name;  ///< as in `Parameter`; for colours that mix channels with _r, _g or _b
  Color<double> slope;
};

/// f(wi, wo) |cos wo|, 1/sr. Singular lobes count 0, unphysical refraction as the flavour says.
Color<double> probe(const Probe& row);
/// Its derivatives, in the order of `Principled::fields`. For a colour whose channels do not mix,
/// channel c of the slope is by channel c of the colour.
std::vector<ProbeSlope> probe_slopes(const Probe& row);

}  // namespace selenite

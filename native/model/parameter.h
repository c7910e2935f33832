// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace selenite {

/// What a change of the parameter does to a picture; decides which model a fit needs.
enum class Effect { kSurface, kEmission, kVolume, kVisibility };

/// Which Principled BSDF has the parameter: that of Blender 3.x (1), that of 4.x and 5.x (2).
enum class Versions { kBoth, k1, k2 };

/// Scale on which an optimiser steps: the picture is closest to linear in it.
enum class Scale {
  kLinear,
  kLog,
  kLogExcess,    ///< log(x - 1), for an index of refraction
  kRoughness,    ///< log(x^3 + 0.15^3) / 3, for a roughness: low ones hardly show
  kReflectance,  ///< what a half-space of that single-scattering albedo reflects
  kAngle,        ///< a rotation: pictures are close to linear over few degrees only
};

/// The one description of a parameter. It stands beside the member that a lobe computes with
/// (`fields` of the model) and everything else follows from it: the Python table, panel rows, box
/// constraints, the command line, the manual, derivative seeding, gradient and round-trip tests.
struct Parameter {
  std::string_view name;     ///< as in `selenite fit --fit Body:NAME`
  std::string_view sockets;  ///< names of the Blender socket, newest first, separated by '|'
  std::string_view unit;     ///< "1" if dimensionless
  double lower;              ///< smallest permitted value
  double upper;              ///< largest permitted value
  double fit_lower;          ///< default box constraint of a fit, inside [lower, upper]
  double fit_upper;
  double initial;  ///< default of the Blender node; of every channel of a colour
  Scale scale = Scale::kLinear;
  Effect effect = Effect::kSurface;
  /// Colours only: channel c of the picture depends on channel c of the parameter alone, so one dual
  /// slot serves the three channels.
  bool diagonal = true;
  /// Colours only: the channels are about alike where photos say nothing else.
  bool alike = false;
  /// Another parameter of the same owner that acts alike: what a fit finds for the one may be the
  /// other's value, so that it is compared with the two exchanged.
  std::string_view twin = {};
  /// Where other parameters make up for what goes with the value itself, a picture goes with its
  /// square: light that enters and leaves a body crosses its surface twice.
  bool squared = false;
  Versions versions = Versions::kBoth;
  /// A weight of what many materials do not have: 0 is preferred where photos do not tell it from 0.
  bool optional = false;
  std::string_view help;  ///< one sentence for tooltips and the manual
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "math/vec.h"
#include "model/principled.h"

namespace selenite {

/// One line of a table of BSDF values, evaluated in double precision.
struct Probe {
  Principled<double> material;
  Flavour flavour;
  Vec3d wi{0, 0, 1};  ///< to the viewer; z is the outside normal of the surface; any length
  Vec3d wo{0, 0, 1};  ///< to the light, same frame; any length
};

/// f(wi, wo) |cos wo|, 1/sr. Singular lobes count 0, unphysical refraction as the flavour says.
Color<double> probe(const Probe& row);

/// A column of numbers that a table of probes may have.
struct ProbeColumn {
  std::string name;     ///< a parameter; `base_r` for a channel of `base_color`; `wi_x` ... `wo_z`
  double lower, upper;  ///< permitted values
  bool required;        ///< else the default of the node stands in for it
  bool parameter;       ///< a number to differentiate by, not part of a direction
  int field;            ///< place in `Principled::fields`; of a direction 0 (wi) or 1 (wo)
  int channel;          ///< of the colour or direction; -1: all channels of it, or no colour
};

/// The columns of a version, directions last. Version 1 has the sockets of Blender 3.x: `specular` for
/// specular_level, a `specular_tint` without channels, transmission_roughness. Emission and subsurface
/// scattering are left out: the values, of two directions, do not hold them.
std::vector<ProbeColumn> probe_columns(Flavour::Version version);

/// Scalars that the model is evaluated with: 32 bits as in the path tracer, or 64.
enum class Precision { kSingle, kDouble };

/// Many lines with the same columns.
class ProbeTable {
 public:
  /// `columns`: what the numbers of a line stand for, in order. Throws UnknownName for one that the
  /// version does not have.
  ProbeTable(Flavour::Version version, const std::vector<std::string>& columns);

  /// Number of columns that are parameters.
  std::size_t parameters() const { return parameters_; }

  /// f_cos of each line: `numbers` is (lines, columns), `f_cos` is (lines, 3). `multi_ggx` (lines) is
  /// the distribution, not 0 for Multiscatter GGX. Parameters are rounded to 32 bits first, as
  /// Blender's sockets hold them. Throws InvalidArgument for a number that is out of range.
  void evaluate(const double* numbers, const std::uint8_t* multi_ggx, std::size_t lines,
                double* f_cos, Precision precision = Precision::kDouble) const;
  /// Their derivatives by each parameter column, (lines, 3, parameters).
  void differentiate(const double* numbers, const std::uint8_t* multi_ggx, std::size_t lines,
                     double* slopes, Precision precision = Precision::kDouble) const;

 private:
  template <class S>
  void evaluate_in(const double* numbers, const std::uint8_t* multi_ggx, std::size_t lines,
                   double* f_cos) const;
  template <class S>
  void differentiate_in(const double* numbers, const std::uint8_t* multi_ggx, std::size_t lines,
                        double* slopes) const;
  Flavour flavour(std::uint8_t multi_ggx) const;
  void check(const double* numbers, std::size_t line) const;

  Flavour::Version version_;
  std::vector<ProbeColumn> columns_;
  std::size_t parameters_ = 0;
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/reparametrization.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

constexpr double kCapLog = 0.25, kCapLogExcess = 0.2, kCapLinear = 0.3;
/// Of log(x^3 + shift^3) / 3 of a roughness. Next to 0 pictures change with about its fourth power
/// (3.6 from 0.01 to 0.23 on the thesis' bunny), far above with its logarithm. Of (power, shift) from
/// (2, 0.1) to (4, 0.3) this keeps what `render_derivatives` measures closest to the true slope: on
/// five bodies and roughness 0.01 to 0.5 between 0.6 and 1.7 of it, where log x, or (2, 0.1) with a longer
/// difference, lose the sign. Where it measures too much, steps fall short and intervals are too sure.
constexpr double kRoughnessShift = 0.15;
/// At roughness 0 the slope dx/du is infinite; derivatives by u vanish there.
constexpr double kLeastRoughness = 0.01;
/// Smallest argument of log(x - 1 + shift): closer to 1 an index of refraction shows in nothing.
constexpr double kLeastExcess = 0.05;
/// Shift of log(x + shift), as a share of the upper bound, where the lower bound is 0.
constexpr double kShiftAtZero = 1e-3;

/// At albedo 1 the slope dx/du is 0, and a step from there could never be seen to help.
constexpr double kLeastRoot = 0.01;
// (1 - s) (1 - a s) / (1 + b s) with s = sqrt(1 - albedo)
constexpr double kHulstA = 0.139, kHulstB = 1.17;

constexpr double square(double x) { return x * x; }
constexpr double cube(double x) { return x * x * x; }

}  // namespace

double Reparametrization::reflectance(double albedo) {
  const double s = std::sqrt(1 - albedo);
  return (1 - s) * (1 - kHulstA * s) / (1 + kHulstB * s);
}

double Reparametrization::albedo_of(double reflectance) {
  // The smaller root of a s^2 - b s + c = 0, without cancellation.
  const double b = 1 + kHulstA + kHulstB * reflectance, c = 1 - reflectance;
  const double s = 2 * c / (b + std::sqrt(b * b - 4 * kHulstA * c));
  return 1 - s * s;
}

double Reparametrization::Axis::from_value(double x) const {
  switch (kind) {
    case Kind::kLogarithm:
      return std::log(x + shift);
    case Kind::kRoughness:
      return std::log(cube(x) + cube(shift)) / 3;
    case Kind::kReflectance:
      return reflectance(x);
    default:
      return x;
  }
}

double Reparametrization::Axis::to_value(double u) const {
  switch (kind) {
    case Kind::kLogarithm:
      return std::exp(u) - shift;
    case Kind::kRoughness:
      return std::cbrt(std::max(std::exp(3 * u) - cube(shift), 0.0));
    case Kind::kReflectance:
      return albedo_of(u);
    default:
      return u;
  }
}

double Reparametrization::Axis::slope(double x) const {
  switch (kind) {
    case Kind::kLogarithm:
      return x + shift;
    case Kind::kRoughness:
      return (cube(x) + cube(shift)) / square(std::max(x, kLeastRoughness));
    case Kind::kReflectance: {
      const double s = std::max(std::sqrt(1 - x), kLeastRoot), below = 1 + kHulstB * s;
      const double above = (1 - s) * (1 - kHulstA * s);
      const double above_by_s = -(1 + kHulstA) + 2 * kHulstA * s;
      // du/ds, and dx/ds = -2 s
      return -2 * s / ((above_by_s - above * kHulstB / below) / below);
    }
    default:
      return 1;
  }
}

Reparametrization::Reparametrization(const Unknowns& unknowns) : cap_(unknowns.size()) {
  for (int k = 0; k < unknowns.size(); ++k) {
    const double minimum = unknowns.minimum()[k], maximum = unknowns.maximum()[k];
    switch (unknowns.description_of(k).scale) {
      case Scale::kLog:
        axes_.push_back(
            {Axis::Kind::kLogarithm, minimum > 0 ? 0 : kShiftAtZero * maximum - minimum});
        cap_[k] = kCapLog;
        break;
      case Scale::kLogExcess:
        axes_.push_back({Axis::Kind::kLogarithm, std::max(kLeastExcess - minimum, -1.0)});
        cap_[k] = kCapLogExcess;
        break;
      case Scale::kReflectance:
        axes_.push_back({Axis::Kind::kReflectance});
        cap_[k] = kCapLinear * (reflectance(maximum) - reflectance(minimum));
        break;
      case Scale::kRoughness:
        axes_.push_back({Axis::Kind::kRoughness, kRoughnessShift});
        cap_[k] = kCapLog;
        break;
      default:
        axes_.push_back({Axis::Kind::kLinear});
        cap_[k] = kCapLinear * (maximum - minimum);
    }
  }
  minimum_ = from_values(unknowns.minimum());
  maximum_ = from_values(unknowns.maximum());
}

template <class F>
Vector Reparametrization::each(const Vector& in, F&& f) const {
  Vector out(in.size());
  for (Eigen::Index k = 0; k < in.size(); ++k)
    out[k] = f(axes_[static_cast<std::size_t>(k)], in[k]);
  return out;
}

Vector Reparametrization::from_values(const Vector& x) const {
  return each(x, [](const Axis& axis, double value) { return axis.from_value(value); });
}

Vector Reparametrization::to_values(const Vector& u) const {
  return each(u, [](const Axis& axis, double value) { return axis.to_value(value); });
}

Vector Reparametrization::slope(const Vector& x) const {
  return each(x, [](const Axis& axis, double value) { return axis.slope(value); });
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/reparametrization.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

// Reflectance (1 - s) (1 - a s) / (1 + b s) of a half-space, s = sqrt(1 - albedo): van de Hulst 1980.
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
      return (cube(x) + cube(shift)) / square(std::max(x, least));
    case Kind::kReflectance: {
      const double s = std::max(std::sqrt(1 - x), least), below = 1 + kHulstB * s;
      const double above = (1 - s) * (1 - kHulstA * s);
      const double above_by_s = -(1 + kHulstA) + 2 * kHulstA * s;
      // du/ds, and dx/ds = -2 s
      return -2 * s / ((above_by_s - above * kHulstB / below) / below);
    }
    default:
      return 1;
  }
}

Reparametrization::Reparametrization(const Unknowns& unknowns,
                                     const ReparametrizationOptions& options)
    : cap_(unknowns.size()) {
  for (int k = 0; k < unknowns.size(); ++k) {
    const double minimum = unknowns.minimum()[k], maximum = unknowns.maximum()[k];
    switch (unknowns.description_of(k).scale) {
      case Scale::kLog:
        axes_.push_back(
            {Axis::Kind::kLogarithm, minimum > 0 ? 0 : options.shift_at_zero * maximum - minimum});
        cap_[k] = options.cap_log;
        break;
      case Scale::kLogExcess:
        axes_.push_back({Axis::Kind::kLogarithm, std::max(options.least_excess - minimum, -1.0)});
        cap_[k] = options.cap_log_excess;
        break;
      case Scale::kReflectance:
        axes_.push_back({Axis::Kind::kReflectance, 0, options.least_root});
        cap_[k] = options.cap_linear * (reflectance(maximum) - reflectance(minimum));
        break;
      case Scale::kRoughness:
        axes_.push_back({Axis::Kind::kRoughness, options.roughness_shift, options.least_roughness});
        cap_[k] = options.cap_log;
        break;
      case Scale::kAngle:
        axes_.push_back({Axis::Kind::kLinear});
        cap_[k] = options.cap_angle;
        break;
      case Scale::kLinear:
        axes_.push_back({Axis::Kind::kLinear});
        cap_[k] = options.cap_linear * (maximum - minimum);
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

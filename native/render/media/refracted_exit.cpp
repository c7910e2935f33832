// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/media/refracted_exit.h"

#include "math/dual.h"
#include "math/sampling.h"

namespace selenite {
namespace {

constexpr int kSteps = 20;
constexpr double kLeastDamping = 1.0 / 64;
/// Between the lines on which a search begins; not measured.
constexpr float kCosBeside = 0.7f;

/// A place in the plane of a triangle that moves along two unit vectors in it.
using Moving = Dual<double, 2>;

/// Corner normals of a triangle in world space, which a point's normal is interpolated from.
std::array<Vec3f, 3> corner_normals(const Geometry& geometry, const Hit& hit) {
  if (const auto* face = geometry.face(hit.instance, hit.triangle)) return face->normals;
  std::array<Vec3f, 3> normals;
  for (int i = 0; i < 3; ++i)
    normals[i] =
        geometry
            .surface({hit.instance, hit.triangle, i == 1 ? 1.0f : 0.0f, i == 2 ? 1.0f : 0.0f, 0})
            .n;
  return normals;
}

Vec3<Moving> moving(const Vec3d& at, const Vec3d& du, const Vec3d& dv) {
  return {Moving(at.x, {du.x, dv.x}), Moving(at.y, {du.y, dv.y}), Moving(at.z, {du.z, dv.z})};
}

}  // namespace

struct RefractedExit::Tangent {
  Vec3d position, u, v;
  Micronormal micronormal;
  double xu, xv, yu, yv;  ///< its derivatives along u and v
  double cos_in, distance2;
  double cos_m_in, cos_m_out, half2;  ///< of the micronormal to both directions, |wi + eta wo|^2

  double determinant() const { return xu * yv - xv * yu; }
};

std::optional<RefractedExit::Place> RefractedExit::meet(const Vec3f& direction) const {
  ++visited_;
  const auto hit = geometry_.intersect(
      {from_, direction, 0, std::numeric_limits<float>::infinity()}, kScatterRay);
  if (!hit || hit->instance != instance_) return std::nullopt;
  const Surface surface = geometry_.surface(*hit);
  if (!(dot(direction, surface.ng) > 0)) return std::nullopt;
  return Place{*hit, surface, direction};
}

RefractedExit::Tangent RefractedExit::tangent(const Place& at, double eta) const {
  const auto corners = geometry_.corners(at.hit.instance, at.hit.triangle);
  const auto normals = corner_normals(geometry_, at.hit);
  const Vec3d a(corners[0]), e1 = Vec3d(corners[1]) - a, e2 = Vec3d(corners[2]) - a;
  const Frame<double> frame = Frame<double>::from_normal(normalize(Vec3d(at.surface.ng)));
  Tangent t;
  t.position = Vec3d(at.surface.position);
  t.u = frame.s;
  t.v = frame.t;

  // The normal changes as the barycentric coordinates do.
  const Vec3d across = cross(e1, e2), by1 = cross(e2, across), by2 = cross(across, e1);
  const Vec3d g1 = by1 / dot(e1, by1), g2 = by2 / dot(e2, by2);
  const Vec3d n0(normals[0]), n1 = Vec3d(normals[1]) - n0, n2 = Vec3d(normals[2]) - n0;
  const Vec3d n = n0 + n1 * double(at.hit.b1) + n2 * double(at.hit.b2);
  const auto turned = [&](const Vec3d& along) { return n1 * dot(g1, along) + n2 * dot(g2, along); };
  // Seen from within.
  const Vec3<Moving> normal = normalize(moving(-n, -turned(t.u), -turned(t.v)));

  const Vec3<Moving> p = moving(t.position, t.u, t.v);
  const auto towards = [&](const Vec3f& place) {
    return normalize(moving(Vec3d(place), {}, {}) - p);
  };
  const Vec3<Moving> wi = towards(from_);
  const Vec3<Moving> wo =
      target_.infinite ? moving(Vec3d(target_.place), {}, {}) : towards(target_.place);
  const Vec3<Moving> sum = wi + wo * eta;
  Vec3<Moving> m = normalize(sum);
  if (dot(m, normal).v < 0) m = -m;
  // Any frame does that depends on nothing but the normal.
  const Vec3d axis = std::abs(normal.x.v) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3<Moving> s = normalize(cross(moving(axis, {}, {}), normal));
  const Moving x = dot(m, s), y = dot(m, cross(normal, s));
  t.micronormal = {x.v, y.v};
  t.xu = x.d[0], t.xv = x.d[1], t.yu = y.d[0], t.yv = y.d[1];

  const Vec3d way = Vec3d(from_) - t.position;
  t.distance2 = dot(way, way);
  t.cos_in = std::abs(dot(way, frame.n)) / std::sqrt(t.distance2);
  t.cos_m_in = dot(m, wi).v;
  t.cos_m_out = dot(m, wo).v;
  t.half2 = dot(sum, sum).v;
  return t;
}

std::optional<RefractedExit::Refraction> RefractedExit::refraction(const Place& at,
                                                                   double eta) const {
  const Tangent t = tangent(at, eta);
  if (!(t.cos_m_in > 0 && t.cos_m_out < 0)) return std::nullopt;
  const double z2 = t.micronormal.z2();
  if (!(z2 > 0 && t.cos_in > 0)) return std::nullopt;
  return Refraction{t.micronormal, std::abs(t.determinant()) * t.distance2 / t.cos_in,
                    std::sqrt(z2) * eta * eta * -t.cos_m_out / t.half2};
}

std::optional<RefractedExit::Place> RefractedExit::start(int which) const {
  const Vec3f straight = target_.direction_from(from_);
  if (which == 0) return meet(straight);
  return meet(deflect(straight, kCosBeside, static_cast<float>(which - 1) / (kStarts - 1)));
}

std::optional<RefractedExit::Place> RefractedExit::find(Place at, double eta,
                                                        const Micronormal& wanted,
                                                        double tolerance) const {
  Tangent t = tangent(at, eta);
  const auto error = [&](const Tangent& here) {
    const double x = here.micronormal.x - wanted.x, y = here.micronormal.y - wanted.y;
    return std::sqrt(x * x + y * y);
  };
  double off = error(t), damping = 1;
  for (int i = 0; i < kSteps; ++i) {
    // Close to the surface its rounding alone turns the ray by that much.
    if (off <= std::max(tolerance, at.surface.offset / std::sqrt(t.distance2))) {
      if (!(t.cos_m_in > 0 && t.cos_m_out < 0)) return std::nullopt;
      return at;
    }
    const double x = wanted.x - t.micronormal.x, y = wanted.y - t.micronormal.y;
    const double inverse = damping / t.determinant();
    const double du = (t.yv * x - t.xv * y) * inverse, dv = (t.xu * y - t.yu * x) * inverse;
    if (!std::isfinite(du) || !std::isfinite(dv)) return std::nullopt;
    const Vec3d way = t.position + t.u * du + t.v * dv - Vec3d(from_);
    const auto next = meet(Vec3f(normalize(way)));
    if (next) {
      const Tangent there = tangent(*next, eta);
      if (const double left = error(there); left < off) {
        at = *next;
        t = there;
        off = left;
        damping = std::min(1.0, 2 * damping);
        continue;
      }
    }
    damping /= 2;
    if (damping < kLeastDamping) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace selenite

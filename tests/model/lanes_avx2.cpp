// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/lanes.h"
#include "model/lanes_batch.h"

namespace selenite::lanes_test {
namespace {

Lanes load(const float* x) {
  Lanes lanes;
  for (int i = 0; i < kBatch; ++i) lanes.set(i, x[i]);
  return lanes;
}
template <class Get>
Vec3<Lanes> load_vectors(const Get& get) {
  Vec3<Lanes> v;
  for (int i = 0; i < kBatch; ++i) {
    const Vec3f& one = get(i);
    v.x.set(i, one.x), v.y.set(i, one.y), v.z.set(i, one.z);
  }
  return v;
}
Dual<Lanes, kSlots> load(const Slopes* x) {
  Dual<Lanes, kSlots> lanes;
  for (int i = 0; i < kBatch; ++i) {
    lanes.v.set(i, x[i].v);
    for (int k = 0; k < kSlots; ++k) lanes.d[k].set(i, x[i].d[k]);
  }
  return lanes;
}
float of_lane(const Lanes& x, int lane) { return x[lane]; }
Slopes of_lane(const Dual<Lanes, kSlots>& x, int lane) {
  Slopes one(x.v[lane]);
  for (int k = 0; k < kSlots; ++k) one.d[k] = x.d[k][lane];
  return one;
}
template <class T>
auto of_lane(const Color<T>& c, int lane) {
  return Color(of_lane(c.r, lane), of_lane(c.g, lane), of_lane(c.b, lane));
}

template <class T, class U = uniform_t<T>>
void ask(const Principled<U>& material, const Flavour& flavour, const Batch& batch, unsigned active,
         Answer<U>* answers) {
  const auto points = [&batch](Vec3f SurfacePoint<float>::*member) {
    return load_vectors([&batch, member](int i) { return batch.point[i].*member; });
  };
  LaneMask counts;
  for (int i = 0; i < kBatch; ++i) counts.set(i, active >> i & 1);
  const SurfacePoint<Lanes> point{points(&SurfacePoint<float>::ng), points(&SurfacePoint<float>::n),
                                  points(&SurfacePoint<float>::wi), batch.point[0].backfacing};
  const PrincipledBsdf<T> bsdf(material, flavour, point, counts);
  const Vec3<Lanes> wo = load_vectors([&batch](int i) { return batch.wo[i]; });
  Color<T> value;
  Lanes density;
  bsdf.value_and_density(wo, value, density);
  const Lanes density_alone = bsdf.density(wo);
  const BsdfSample<T> s = bsdf.draw(load(batch.u_lobe), load(batch.u1), load(batch.u2));
  for (int i = 0; i < kBatch; ++i) {
    answers[i] = {.value = of_lane(value, i),
                  .density = density[i],
                  .density_alone = density_alone[i],
                  .transmits = bsdf.transmits(wo)[i],
                  .all_singular = bsdf.all_singular(),
                  .sample = {.exists = s.exists[i],
                             .singular = s.singular[i],
                             .transmits = s.transmits[i],
                             .diffuse = s.diffuse[i],
                             .wo = {s.wo.x[i], s.wo.y[i], s.wo.z[i]},
                             .density = s.density[i],
                             .weight = of_lane(s.weight, i)}};
  }
}

template <class T, class U>
void evaluate(const U* a, const U* b, U* out) {
  T results[kFunctions];
  evaluate_functions<T>(load(a), load(b), results);
  for (int k = 0; k < kFunctions; ++k)
    for (int i = 0; i < kBatch; ++i) out[k * kBatch + i] = of_lane(results[k], i);
}

}  // namespace

void ask_by_lanes(const Principled<Slopes>& material, const Flavour& flavour, const Batch& batch,
                  unsigned active, Answer<Slopes>* answers) {
  ask<Dual<Lanes, kSlots>>(material, flavour, batch, active, answers);
}
void ask_by_lanes(const Principled<float>& material, const Flavour& flavour, const Batch& batch,
                  unsigned active, Answer<float>* answers) {
  ask<Lanes>(material, flavour, batch, active, answers);
}

void functions_by_lanes(const float* a, const float* b, float* out) { evaluate<Lanes>(a, b, out); }
void functions_by_lanes(const Slopes* a, const Slopes* b, Slopes* out) {
  evaluate<Dual<Lanes, kSlots>>(a, b, out);
}

void mixed_by_lanes(const Slopes& uniform, const float* a, Slopes* out) {
  const Lanes x = load(a);
  const Dual<Lanes, kSlots> results[kMixed] = {uniform + x, uniform - x, uniform * x, uniform / x,
                                               x + uniform, x - uniform, x * uniform, x / uniform};
  for (int k = 0; k < kMixed; ++k)
    for (int i = 0; i < kBatch; ++i) out[k * kBatch + i] = of_lane(results[k], i);
}

void compare_by_lanes(const float* a, const float* b, unsigned (&bits)[8]) {
  const Lanes x = load(a), y = load(b);
  const LaneMask masks[6] = {x<y, x> y, x <= y, x >= y, x == y, x != y};
  for (int i = 0; i < 6; ++i) bits[i] = masks[i].bits();
  bits[6] = any(masks[0]);
  bits[7] = all(masks[0]);
}

void maps_by_lanes(const float* u, const float* v, float g, float* out) {
  Lanes results[kMapped];
  evaluate_maps(load(u), load(v), g, results);
  for (int k = 0; k < kMapped; ++k)
    for (int i = 0; i < kBatch; ++i) out[k * kBatch + i] = results[k][i];
}

}  // namespace selenite::lanes_test

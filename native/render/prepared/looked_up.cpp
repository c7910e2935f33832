// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/prepared.h"

namespace selenite {
namespace {

/// Puts a looked-up colour into one field, clamped to what the model permits; a number takes the
/// luminance, as Blender's sockets do. An unknown colour is seeded in the first slot where it is inside.
template <class T>
struct Put {
  int field;
  const Colorf& color;
  bool unknown = false;
  int index = 0;
  static float inside(const Parameter& p, float x) {
    return clamp(x, static_cast<float>(p.lower), static_cast<float>(p.upper));
  }
  void operator()(const Parameter& p, T& x) {
    if (index++ != field) return;
    x = T(inside(p, 0.2126729f * color.r + 0.7151522f * color.g + 0.0721750f * color.b));
  }
  void operator()(const Parameter& p, Color<T>& c) {
    if (index++ != field) return;
    for (int i = 0; i < 3; ++i) c[i] = number(p, color[i]);
  }
  T number(const Parameter& p, float x) const {
    const float value = inside(p, x);
    if constexpr (!std::is_same_v<T, float>)
      if (unknown && value == x) return T::variable(value, 0);
    return T(value);
  }
};

}  // namespace

template <int L>
void PreparedMaterial<L>::apply(const FieldMap& map, const Geometry& geometry, const Hit& hit,
                                Principled<PathScalar<L>>& room) const {
  const Colorf color = map.texture ? map.texture->at(map.place(geometry.uv(hit, map.attribute)))
                                   : geometry.color(hit, map.attribute);
  Put<PathScalar<L>> put{map.field, color, &map == base_color_map};
  Principled<PathScalar<L>>::fields(room, put);
}

template void PreparedMaterial<0>::apply(const FieldMap&, const Geometry&, const Hit&,
                                         Principled<PathScalar<0>>&) const;
template void PreparedMaterial<kTaped>::apply(const FieldMap&, const Geometry&, const Hit&,
                                              Principled<PathScalar<kTaped>>&) const;
template void PreparedMaterial<2>::apply(const FieldMap&, const Geometry&, const Hit&,
                                         Principled<PathScalar<2>>&) const;
template void PreparedMaterial<4>::apply(const FieldMap&, const Geometry&, const Hit&,
                                         Principled<PathScalar<4>>&) const;
template void PreparedMaterial<8>::apply(const FieldMap&, const Geometry&, const Hit&,
                                         Principled<PathScalar<8>>&) const;
template void PreparedMaterial<16>::apply(const FieldMap&, const Geometry&, const Hit&,
                                          Principled<PathScalar<16>>&) const;

}  // namespace selenite

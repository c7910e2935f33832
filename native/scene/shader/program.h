// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/arithmetic.h"
#include "scene/shader/colors.h"
#include "scene/shader/evaluate.h"
#include "scene/shader/images.h"
#include "scene/shader/inputs.h"
#include "scene/shader/normals.h"
#include "scene/shader/patterns.h"
#include "scene/shader/spectra.h"
#include "scene/shader/vectors.h"
#include "scene/shader/voronoi.h"

// The instructions, each with its inputs. Included by the sources that make `prepare` and `run` for
// their types.
namespace selenite::shading {

/// Weights by which Cycles makes a number of a colour, for linear Rec. 709.
inline constexpr double kLuminance[] = {0.2126729, 0.7151522, 0.0721750};

/// What an unknown image gives is a variable.
template <class T>
void seed(const ImageSlots& slots, Color<T>& color) {
  if (slots.count == 0) return;
  for (int c = 0; c < 3; ++c)
    color[c].d[static_cast<std::size_t>(slots.first + (slots.count == 1 ? 0 : c))] += 1;
}

/// One instruction with its inputs.
template <class T>
struct Step {
  const Shader& shader;
  const Instruction& code;
  const int* operands;  ///< of this instruction
  const Registers<T>& registers;
  const ShadingPoint* point;  ///< null: an instruction that asks for none

  int index(int k) const { return operands[k]; }
  const Color<T>& color(int k) const { return registers[index(k)]; }
  const T& number(int k) const { return color(k).r; }
  Vec3<T> vector(int k) const { return vector_of(color(k)); }
  int whole(int k) const { return static_cast<int>(value_of(number(k))); }
  bool has(InstructionFlag flag) const { return (code.flags & flag) != 0; }
  template <class Mode>
  Mode mode() const {
    return static_cast<Mode>(code.mode);
  }
  /// A normal, or the interpolated one where nothing gives it.
  Vec3<T> normal(int k) const {
    if (index(k) < 0) return lifted_vector<T>(point->normal());
    const Vec3<T> n = safe_normalize(vector(k));
    return value_of(dot(n, n)) > 0 ? n : lifted_vector<T>(point->normal());
  }
  bool has_slopes() const {
    for (int k = 0; k < code.count; ++k)
      if (index(k) >= 0 && has_slope(color(k))) return true;
    return false;
  }
};

/// The texture coordinate of `N` dimensions, scaled: a vector and, in one and four, a number.
template <std::size_t N, class T>
Point<T, N> place(const Step<T>& step, const T& scale) {
  const T w = step.number(1) * scale;
  if constexpr (N == 1) {
    return {w};
  } else {
    const Vec3<T> p = step.vector(0) * scale;
    if constexpr (N == 2)
      return {p.x, p.y};
    else if constexpr (N == 3)
      return {p.x, p.y, p.z};
    else
      return {p.x, p.y, p.z, w};
  }
}

/// Calls `action` with the number of dimensions as a constant.
template <class Action>
auto in_dimensions(int dimensions, Action&& action) {
  switch (dimensions) {
    case 1:
      return action(std::integral_constant<std::size_t, 1>{});
    case 2:
      return action(std::integral_constant<std::size_t, 2>{});
    case 4:
      return action(std::integral_constant<std::size_t, 4>{});
    default:
      return action(std::integral_constant<std::size_t, 3>{});
  }
}

template <class T>
Color<T> noise_step(const Step<T>& s) {
  const NoiseNumbers<T> n{s.number(3),
                          s.number(4),
                          s.number(5),
                          s.number(6),
                          s.number(7),
                          s.number(8),
                          (s.code.flags & kNormalized) != 0};
  const auto mode = static_cast<NoiseMode>(texture_type(s.code.mode));
  return in_dimensions(texture_dimensions(s.code.mode), [&](auto dimensions) {
    return noise_texture<T, dimensions.value>(mode, place<dimensions.value>(s, s.number(2)), n,
                                              s.has(kColored));
  });
}

template <class T>
Color<T> white_noise_step(const Step<T>& s) {
  return in_dimensions(texture_dimensions(s.code.mode), [&](auto dimensions) {
    const auto p = place<dimensions.value>(s, T(1));
    std::array<float, dimensions.value> key;
    for (std::size_t i = 0; i < dimensions.value; ++i) key[i] = static_cast<float>(value_of(p[i]));
    if (!s.has(kColored)) return lifted<T>(Colorf(random_of(key)));
    const auto c = random_color(key);
    return lifted<T>(Colorf{c[0], c[1], c[2]});
  });
}

template <class T>
Color<T> voronoi_step(const Step<T>& s) {
  const VoronoiNumbers<T> n{s.number(3),
                            s.number(4),
                            s.number(5),
                            s.number(6),
                            s.number(7),
                            s.number(8),
                            static_cast<VoronoiMetric>(texture_metric(s.code.mode)),
                            (s.code.flags & kNormalized) != 0,
                            texture_of_5(s.code.mode)};
  const auto mode = static_cast<VoronoiMode>(texture_type(s.code.mode));
  const auto output = static_cast<VoronoiOutput>(s.code.item);
  return in_dimensions(texture_dimensions(s.code.mode), [&](auto dimensions) {
    return voronoi_texture<T, dimensions.value>(
        mode, output, place<dimensions.value>(s, s.number(2)), n, s.number(2));
  });
}

/// Textures cost much, and more with derivatives, which they seldom carry.
template <class T>
Color<T> costly_step(const Step<T>& s) {
  switch (s.code.op) {
    case Op::kNoise:
      return noise_step(s);
    case Op::kVoronoi:
      return voronoi_step(s);
    case Op::kWave:
      return Color<T>(wave_texture(
          s.code.mode, s.vector(0) * s.number(1),
          WaveNumbers<T>{s.number(2), s.number(3), s.number(4), s.number(5), s.number(6)}));
    default:
      return magic_texture(s.code.mode, s.vector(0), s.number(1), s.number(2));
  }
}

template <class T>
Color<T> texture_step(const Step<T>& s) {
  if constexpr (!std::is_floating_point_v<T>) {
    if (!s.has_slopes()) {
      using S = scalar_t<T>;
      constexpr int kMost = 9;  // inputs of a texture
      static constexpr std::array<int, kMost> kInOrder{0, 1, 2, 3, 4, 5, 6, 7, 8};
      std::array<Color<S>, kMost> values;
      for (int k = 0; k < s.code.count; ++k)
        values[static_cast<std::size_t>(k)] = value_of(s.color(k));
      const Registers<S> plain{values, {}};
      return lifted<T>(costly_step(Step<S>{s.shader, s.code, kInOrder.data(), plain, s.point}));
    }
  }
  return costly_step(s);
}

/// Between spaces; the map is linear or affine, so that derivatives go through three directions.
template <class T>
Color<T> transform_step(const Step<T>& s) {
  using S = scalar_t<T>;
  const auto mode = s.template mode<TransformMode>();
  if (s.code.item / 3 == s.code.item % 3) return s.color(0);
  const Color<S> at = value_of(s.color(0));
  const Vec3d v(at.r, at.g, at.b);
  const Vec3d y = transformed(*s.point, mode, s.code.item, v);
  Vec3<T> result{T(S(y.x)), T(S(y.y)), T(S(y.z))};
  if constexpr (!std::is_floating_point_v<T>) {
    if (has_slope(s.color(0))) {
      const TransformMode linear = mode == TransformMode::kPoint ? TransformMode::kVector : mode;
      const Vec3d x1 = transformed(*s.point, linear, s.code.item, {1, 0, 0});
      const Vec3d x2 = transformed(*s.point, linear, s.code.item, {0, 1, 0});
      const Vec3d x3 = transformed(*s.point, linear, s.code.item, {0, 0, 1});
      const Vec3<T> slopes = lifted_vector<T>(Vec3f(x1)) * (s.color(0).r - at.r) +
                             lifted_vector<T>(Vec3f(x2)) * (s.color(0).g - at.g) +
                             lifted_vector<T>(Vec3f(x3)) * (s.color(0).b - at.b);
      result = result + slopes;
    }
  }
  return color_of(mode == TransformMode::kNormal ? safe_normalize(result) : result);
}

template <class T>
Color<T> execute(const Step<T>& s) {
  using S = scalar_t<T>;
  const Instruction& code = s.code;
  const auto input = [&] { return InputPoint(*s.point, code.shift, code.width); };
  switch (code.op) {
    case Op::kMath: {
      const T y = math(s.template mode<MathMode>(), s.number(0), s.number(1), s.number(2));
      return Color<T>(s.has(kClampResult) ? saturate(y) : y);
    }
    case Op::kVectorMath:
      return vector_math(s.template mode<VectorMode>(), s.color(0), s.color(1), s.color(2),
                         s.number(3));
    case Op::kMix: {
      const Color<T> t = s.has(kClampFactor) ? map(s.color(0), saturate<T>) : s.color(0);
      const Color<T> c = blend(s.template mode<BlendMode>(), t, s.color(1), s.color(2));
      return s.has(kClampResult) ? map(c, saturate<T>) : c;
    }
    case Op::kMapRange: {
      Color<T> y;
      for (int c = 0; c < 3; ++c)
        y[c] = map_range(s.template mode<RangeMode>(), code.flags, s.color(0)[c], s.color(1)[c],
                         s.color(2)[c], s.color(3)[c], s.color(4)[c], s.color(5)[c]);
      return y;
    }
    case Op::kClamp: {
      const T &x = s.number(0), &a = s.number(1), &b = s.number(2);
      if (s.has(kSorted) && value_of(a) > value_of(b)) return Color<T>(min(max(x, b), a));
      return Color<T>(min(max(x, a), b));
    }
    case Op::kTable:
    case Op::kTableChannels: {
      const ShaderTable& table = s.shader.tables[static_cast<std::size_t>(code.item)];
      Color<T> y;
      for (int c = 0; c < 3; ++c)
        y[c] = looked_up(table, code.flags, s.color(0)[code.op == Op::kTable ? 0 : c], c);
      return y;
    }
    case Op::kLuminance: {
      const Color<T>& c = s.color(0);
      return Color<T>(c.r * S(kLuminance[0]) + c.g * S(kLuminance[1]) + c.b * S(kLuminance[2]));
    }
    case Op::kMean:
      return Color<T>(mean_channel(s.color(0)));
    case Op::kTruncate:
      return Color<T>(T(std::trunc(value_of(s.number(0)))));
    case Op::kChannel:
      return Color<T>(s.color(0)[code.mode]);
    case Op::kCombine:
      return {s.number(0), s.number(1), s.number(2)};
    case Op::kConvert:
      return convert(s.template mode<ConvertMode>(), s.color(0));
    case Op::kHueSaturation:
      return hue_saturation(s.number(0), s.number(1), s.number(2), s.number(3), s.color(4));
    case Op::kBrightContrast: {
      const T gain = s.number(2) + S(1), more = s.number(1) - s.number(2) * S(0.5);
      return map(s.color(0), [&](const T& x) { return max(gain * x + more, T(0)); });
    }
    case Op::kGamma:
      return gamma(s.color(0), s.number(1));
    case Op::kInvert:
      return map(s.color(1), [&](const T& x) { return lerp(x, S(1) - x, s.number(0)); });
    case Op::kBlackbody:
      return blackbody(s.number(0));
    case Op::kMapping:
      return color_of(mapping(s.template mode<MappingMode>(), s.vector(0), s.vector(1), s.vector(2),
                              s.vector(3)));
    case Op::kRotate:
      return color_of(vector_rotate(s.template mode<RotateMode>(), s.has(kInverted), s.vector(0),
                                    s.vector(1), s.vector(2), s.number(3), s.vector(4)));
    case Op::kTransform:
      return transform_step(s);
    case Op::kGeometry:
      return lifted<T>(input().geometry(s.template mode<GeometryMode>()));
    case Op::kAttribute: {
      const auto mode = s.template mode<AttributeMode>();
      const auto item = static_cast<std::size_t>(code.item);
      auto found = lifted<T>(input().attribute(mode, s.shader.names[item]));
      if constexpr (!std::is_same_v<T, scalar_t<T>>)
        if (mode == AttributeMode::kColor && !s.registers.images.empty())
          seed(s.registers.images[s.shader.textures.size() + item], found);
      return found;
    }
    case Op::kObject:
      return lifted<T>(object_fact(*s.point, s.template mode<ObjectMode>()));
    case Op::kPath:
      return lifted<T>(Colorf(path_fact(s.point->path, s.template mode<PathMode>())));
    case Op::kCamera:
      return lifted<T>(input().camera(s.template mode<CameraMode>()));
    case Op::kFresnel:
      return Color<T>(fresnel(*s.point, s.number(0), s.normal(1)));
    case Op::kLayerWeight:
      return Color<T>(
          layer_weight(*s.point, s.template mode<LayerMode>(), s.number(0), s.normal(1)));
    case Op::kImage: {
      const auto mode = s.template mode<ImageMode>();
      const float blend =
          mode == ImageMode::kBox ? static_cast<float>(value_of(s.number(1))) : 0.0f;
      const auto item = static_cast<std::size_t>(code.item);
      Color<T> found = image_texture(*s.shader.textures[item], s.point, mode, s.vector(0), blend);
      if constexpr (!std::is_same_v<T, scalar_t<T>>)
        if (!s.registers.images.empty()) seed(s.registers.images[item], found);
      return found;
    }
    case Op::kWhiteNoise:
      return white_noise_step(s);
    case Op::kNoise:
    case Op::kVoronoi:
    case Op::kWave:
    case Op::kMagic:
      return texture_step(s);
    case Op::kGradient:
      return Color<T>(gradient_texture(s.template mode<GradientMode>(), s.vector(0)));
    case Op::kChecker:
      return Color<T>(checker_texture(s.vector(0) * s.number(1)));
    case Op::kBrick: {
      const BrickNumbers<T> n{s.number(2), s.number(3), s.number(4), s.number(5), s.number(6),
                              s.number(7), s.number(9), s.whole(8),  s.whole(10)};
      return Color<T>(brick_texture(s.template mode<BrickMode>(), s.vector(0) * s.number(1), n));
    }
    case Op::kNormalMap: {
      const auto mode = s.template mode<NormalMapMode>();
      const std::string* names =
          mode == NormalMapMode::kTangent ? &s.shader.names[code.item] : nullptr;
      return color_of(normal_map(*s.point, mode, names, s.number(0), s.color(1)));
    }
    case Op::kBump:
      return color_of(bump(*s.point, s.normal(3),
                           BumpNumbers<T>{s.number(0), s.number(1), s.number(2), s.number(4),
                                          s.number(5), code.width, s.has(kInverted)}));
  }
  return {};
}

}  // namespace selenite::shading

namespace selenite {

template <class T>
void prepare(const Shader& shader, std::span<const Color<T>> constants, std::span<Color<T>> fixed) {
  std::size_t at = 0;
  for (const Color<T>& c : constants) fixed[at++] = c;
  for (const Colorf& c : shader.literals) fixed[at++] = shading::lifted<T>(c);
  for (const Instruction* code = shader.instructions.data(); at < fixed.size(); ++code, ++at) {
    const Registers<T> before{fixed.first(at), {}};
    fixed[at] = shading::execute(
        shading::Step<T>{shader, *code, &shader.operands[code->first], before, nullptr});
  }
}

template <class T>
void run(const Shader& shader, const ShadingPoint& point, Registers<T> registers) {
  const std::size_t count = registers.own.size();
  const Instruction* code = shader.instructions.data() + (shader.instructions.size() - count);
  for (std::size_t at = 0; at < count; ++at, ++code)
    registers.own[at] = shading::execute(
        shading::Step<T>{shader, *code, shader.operands.data() + code->first, registers, &point});
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/shader/shader.h"

#include <gtest/gtest.h>

#include "math/error.h"
#include "scene/scene_builder.h"
#include "scene/shader/evaluate.h"
#include "scene/shader/hash.h"
#include "scene/shader/modes.h"
#include "scene/shader/voronoi.h"

namespace selenite {
namespace {

/// A program written down line by line; registers are numbered as in Shader.
class Program {
 public:
  int constant(const std::string& name, Color<double> value, int width = 1) {
    ShaderConstant c;
    c.texts = std::make_shared<const std::array<std::string, 3>>(std::array<std::string, 3>{name});
    c.parameter.name = (*c.texts)[0];
    c.parameter.lower = -10, c.parameter.upper = 10;
    c.width = width;
    shader.constants.push_back(c);
    values.push_back(value);
    return static_cast<int>(shader.constants.size()) - 1;
  }
  int literal(Colorf c) {
    shader.literals.push_back(c);
    return static_cast<int>(shader.constants.size() + shader.literals.size()) - 1;
  }
  template <class Mode>
  int emit(Op op, Mode mode, std::vector<int> inputs, int flags = 0, int item = -1) {
    Instruction code;
    code.op = op;
    code.mode = static_cast<std::uint8_t>(mode);
    code.flags = static_cast<std::uint8_t>(flags);
    code.item = item;
    code.first = static_cast<std::uint16_t>(shader.operands.size());
    code.count = static_cast<std::uint16_t>(inputs.size());
    shader.operands.insert(shader.operands.end(), inputs.begin(), inputs.end());
    shader.instructions.push_back(code);
    return shader.registers() - 1;
  }
  /// A material that emits a register.
  Material material(int color) {
    ShaderClosure closure;
    closure.kind = ClosureKind::kEmission;
    closure.inputs = {color, color};
    shader.closures = {closure};
    Material m;
    m.name = "Shown";
    m.shader = finished(shader, m.name);
    m.constants = values;
    return m;
  }

  Shader shader;
  std::vector<Color<double>> values;
};

/// What a material emits where no hit is asked for.
template <class T>
Color<T> emitted(const Material& m, int ticked = -1) {
  std::vector<Color<T>> constants, registers(static_cast<std::size_t>(m.shader->registers()));
  for (std::size_t i = 0; i < m.constants.size(); ++i) {
    constants.emplace_back(m.constants[i]);
    if constexpr (!std::is_floating_point_v<T>)
      if (static_cast<int>(i) == ticked)
        constants.back() = map(m.constants[i], [](double x) { return T::variable(x, 0); });
  }
  evaluate<T>(*m.shader, ShadingPoint{}, constants, registers);
  return registers[static_cast<std::size_t>(m.shader->closures[0].inputs[0])];
}

TEST(Shader, WorksOutWhatDoesNotDependOnTheHitOnce) {
  Program p;
  const int a = p.constant("Math.Value", Color<double>(3));
  const int backfacing = p.emit(Op::kGeometry, GeometryMode::kBackfacing, {});
  const int sum = p.emit(Op::kMath, MathMode::kAdd, {a, a, a});
  const int product = p.emit(Op::kMath, MathMode::kMultiply, {sum, backfacing, a});
  const Material m = p.material(product);
  EXPECT_EQ(m.shader->fixed, 2);  // the constant and the sum
  EXPECT_EQ(m.shader->varying(), 2);
  EXPECT_EQ(m.shader->instructions[0].op, Op::kMath);
  EXPECT_TRUE(m.shader->varies(m.shader->closures[0].inputs[0]));
}

TEST(Shader, MixesAndMultipliesAsOnPaper) {
  Program p;
  const int t = p.literal(Colorf(0.25f));
  const int a = p.literal({0.2f, 0.4f, 0.8f}), b = p.literal({1, 0.5f, 0});
  const int mixed = p.emit(Op::kMix, BlendMode::kMultiply, {t, a, b});
  const Color<double> c = emitted<double>(p.material(mixed));
  EXPECT_NEAR(c.r, 0.2, 1e-7);
  EXPECT_NEAR(c.g, 0.35, 1e-7);  // 0.4 + 0.25 (0.4 * 0.5 - 0.4)
  EXPECT_NEAR(c.b, 0.6, 1e-7);   // 0.8 (1 - 0.25)
}

TEST(Shader, TablesAreInterpolatedAndGoOnAlongTheirEnds) {
  Program p;
  ShaderTable table;
  for (int i = 0; i < ShaderTable::kSize; ++i) {
    const auto x = static_cast<float>(i) / 256;
    table.values.push_back({x * x, 2 * x, 0});
  }
  p.shader.tables.push_back(table);
  const int x = p.constant("Ramp.Fac", Color<double>(0.5));
  const int looked_up = p.emit(Op::kTable, 0, {x}, kExtrapolate, 0);
  Material m = p.material(looked_up);
  EXPECT_NEAR(emitted<double>(m).r, 0.25, 1e-7);
  EXPECT_NEAR(emitted<double>(m).g, 1, 1e-7);
  m.constants[0] = Color<double>(1.5);
  EXPECT_NEAR(emitted<double>(m).g, 3, 1e-5);
  EXPECT_NEAR((emitted<Dual<double, 1>>(m, 0).g.d[0]), 2, 1e-5);
}

TEST(Shader, DerivativesPassThroughAChain) {
  // f(x) = (x^2 + sin x)^1.5 at x = 0.7
  Program p;
  const int x = p.constant("Value.Value", Color<double>(0.7));
  const int exponent = p.literal(Colorf(1.5f));
  const int squared = p.emit(Op::kMath, MathMode::kMultiply, {x, x, x});
  const int sine = p.emit(Op::kMath, MathMode::kSine, {x, x, x});
  const int sum = p.emit(Op::kMath, MathMode::kAdd, {squared, sine, x});
  const Material m = p.material(p.emit(Op::kMath, MathMode::kPower, {sum, exponent, x}));
  const double inner = 0.49 + std::sin(0.7), slope = 1.4 + std::cos(0.7);
  const Color<Dual<double, 1>> f = emitted<Dual<double, 1>>(m, 0);
  EXPECT_NEAR(f.r.v, std::pow(inner, 1.5), 1e-12);
  EXPECT_NEAR(f.r.d[0], 1.5 * std::sqrt(inner) * slope, 1e-12);
}

TEST(Shader, KnowsWhichColoursActChannelByChannel) {
  Program p;
  const int alone = p.constant("RGB.Color", {0.1, 0.2, 0.3}, 3);
  const int mixed = p.constant("RGB.001.Color", {0.1, 0.2, 0.3}, 3);
  const int t = p.literal(Colorf(0.5f));
  const int grey = p.emit(Op::kLuminance, 0, {mixed});
  const Material m = p.material(p.emit(Op::kMix, BlendMode::kScreen, {t, alone, grey}));
  EXPECT_TRUE(m.shader->constants[0].parameter.diagonal);
  EXPECT_FALSE(m.shader->constants[1].parameter.diagonal);
}

TEST(Shader, HashesAsLookup3) {
  // Bob Jenkins' final and mix of words 0 from 0xdeadbeef + 4 n + 13: no more than that they are
  // spread, and the same for each number of words.
  std::array<int, 8> counts{};
  for (std::uint32_t i = 0; i < 8000; ++i) ++counts[shading::hash_of(std::array{i, 7u, 3u}) >> 29];
  for (const int count : counts) EXPECT_NEAR(count, 1000, 140);  // 4.7 standard deviations
  EXPECT_NE(shading::hash_of(std::array{1u}), shading::hash_of(std::array{1u, 0u}));
}

TEST(Shader, RefusesARegisterThatIsComputedLater) {
  Program p;
  const int a = p.literal(Colorf(1));
  p.emit(Op::kMath, MathMode::kAdd, {a, a + 2, a});
  try {
    p.material(a);
    FAIL() << "nothing was thrown";
  } catch (const InvalidArgument& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "Material 'Shown': shader: register 2 lies outside [-1, 1); name one that is computed "
        "before");
  }
}

TEST(Shader, ConstantsAreParametersOfTheMaterial) {
  Program p;
  const int strength = p.constant("Emission.Strength", Color<double>(2));
  SceneBuilder builder;
  builder.add_material(p.material(strength));
  const Scene scene = builder.build();
  const ParameterRef ref = scene.find("Shown", "Emission.Strength");
  EXPECT_EQ(scene.get(ref), std::vector<double>{2});
  EXPECT_EQ(scene.width(ref), 1);
  const Scene other = scene.with({{ref, {3.5}}});
  EXPECT_EQ(other.get(ref), std::vector<double>{3.5});
  EXPECT_EQ(other.appearance.materials[0].constants[0].b, 3.5);
  EXPECT_EQ(scene.get(ref), std::vector<double>{2});
  EXPECT_THROW(scene.with({{ref, {11}}}), InvalidArgument);
  // What a shader takes the place of is no parameter; the medium behind it stays one.
  EXPECT_THROW(scene.find("Shown", "roughness"), UnknownName);
  EXPECT_NO_THROW(scene.find("Shown", "extinction"));
}

template <std::size_t N>
void expect_cells_of_blender_5(const std::array<double, N>& at, double distance,
                               const Color<double>& color) {
  using namespace shading;
  VoronoiNumbers<double> n{0, 0.5, 2, 1, 0.5, 1};
  n.whole_keys = true;
  Point<double, N> place;
  for (std::size_t i = 0; i < N; ++i) place[i] = at[i];
  const auto got = [&](VoronoiOutput output) {
    return voronoi_texture<double, N>(VoronoiMode::kF1, output, place, n, 1.);
  };
  EXPECT_NEAR(got(VoronoiOutput::kDistance).r, distance, 2e-6);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(got(VoronoiOutput::kColor)[k], color[k], 2e-7);
}

// Rendered by Cycles 5.0.1.
TEST(Voronoi, OfBlender5IsThatOfCycles) {
  expect_cells_of_blender_5<2>({.3, .7}, .3696289, {.03905771, .3370832, .09400275});
  expect_cells_of_blender_5<2>({-2.4, 5.1}, .658131, {.683025, .9154031, .8920385});
  expect_cells_of_blender_5<3>({.3, .7, .2}, .4593854, {.03905771, .3370832, .09400275});
  expect_cells_of_blender_5<3>({-2.4, 5.1, 3.3}, .2002093, {.4212181, .03081105, .2422615});
  expect_cells_of_blender_5<4>({.3, .7, .2, .9}, .430215, {.444458, .5099778, .1476347});
  expect_cells_of_blender_5<4>({-2.4, 5.1, 3.3, -1.6}, .6924533, {.5984502, .9372339, .6333474});
}

}  // namespace
}  // namespace selenite

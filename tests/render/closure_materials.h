// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "model/closures/closure.h"
#include "scene/scene.h"
#include "scene/shader/modes.h"

namespace selenite {

/// Puts a material together from closures whose sockets are constants, named NODE.parameter.
class ClosureMaterial {
 public:
  /// Its share is the constant NODE.share.
  ClosureMaterial& add(const std::string& node, const Closure<double>& closure, double share = 1,
                       const Flavour& flavour = {}) {
    ShaderClosure to{static_cast<ClosureKind>(closure.index()), flavour, {}, -1, -1};
    Closure<double> copy = closure;
    closure_fields(copy, [&](const Parameter& p, auto& member) {
      if constexpr (requires { member.r; })
        to.inputs.push_back(constant(node + "." + std::string(p.name), p, member, 3));
      else
        to.inputs.push_back(
            constant(node + "." + std::string(p.name), p, Color<double>(member), 1));
    });
    Parameter share_of = closures::color_parameter("", 1, "");
    to.weight = constant(node + ".share", share_of, Color<double>(share), 1);
    shader_.closures.push_back(to);
    return *this;
  }
  /// Multiplies the share of the last closure by a number that differs from hit to hit.
  ClosureMaterial& vary(Op op, int mode) {
    varying_.push_back({static_cast<int>(shader_.closures.size()) - 1, op, mode});
    return *this;
  }
  /// Turns the normal of the last closure towards that of a colour, in the world, by NODE.strength.
  ClosureMaterial& turn(const std::string& node, double strength, const Color<double>& color) {
    const Parameter p = closures::color_parameter("", 1, "");
    const int first = constant(node + ".strength", p, Color<double>(strength), 1);
    constant(node + ".color", p, color, 3);
    turning_.push_back({static_cast<int>(shader_.closures.size()) - 1, first});
    return *this;
  }
  Material build(const std::string& name) const {
    Shader shader = shader_;
    int next = static_cast<int>(shader.constants.size());
    const auto emit = [&](Op op, int mode, const std::vector<int>& inputs) {
      Instruction code;
      code.op = op;
      code.mode = static_cast<std::uint8_t>(mode);
      code.first = static_cast<std::uint16_t>(shader.operands.size());
      code.count = static_cast<std::uint16_t>(inputs.size());
      shader.operands.insert(shader.operands.end(), inputs.begin(), inputs.end());
      shader.instructions.push_back(code);
      return next++;
    };
    for (const Varying& v : varying_) {
      const int number = emit(v.op, v.mode, {});
      int& weight = shader.closures[v.closure].weight;
      weight = emit(Op::kMath, static_cast<int>(MathMode::kMultiply), {weight, number, -1});
    }
    for (const Turning& t : turning_)
      shader.closures[t.closure].normal =
          emit(Op::kNormalMap, static_cast<int>(NormalMapMode::kWorld), {t.first, t.first + 1});
    Material m;
    m.name = name;
    m.constants = values_;
    m.shader = finished(shader, name);
    return m;
  }

 private:
  struct Varying {
    int closure;
    Op op;
    int mode;
  };
  struct Turning {
    int closure, first;  ///< constant: the strength, the colour
  };
  int constant(const std::string& name, const Parameter& p, const Color<double>& value, int width) {
    ShaderConstant to;
    auto texts = std::make_shared<std::array<std::string, 3>>();
    (*texts)[0] = name;
    to.parameter = p;
    to.parameter.name = (*texts)[0];
    to.texts = texts;
    to.width = width;
    shader_.constants.push_back(to);
    values_.push_back(value);
    return static_cast<int>(values_.size()) - 1;
  }

  Shader shader_;
  std::vector<Color<double>> values_;
  std::vector<Varying> varying_;
  std::vector<Turning> turning_;
};

}  // namespace selenite

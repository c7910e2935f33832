// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/shader/shader.h"

#include <algorithm>
#include <limits>

#include "math/fault.h"
#include "scene/shader/modes.h"

namespace selenite {
namespace {

/// Whether the result depends on the hit itself, not only on the inputs.
bool asks_for_hit(const Instruction& code) {
  switch (code.op) {
    case Op::kGeometry:
    case Op::kAttribute:
    case Op::kObject:
    case Op::kPath:
    case Op::kCamera:
    case Op::kFresnel:
    case Op::kLayerWeight:
    case Op::kTransform:
    case Op::kNormalMap:
    case Op::kBump:
      return true;
    case Op::kImage:
      return static_cast<ImageMode>(code.mode) == ImageMode::kBox;
    default:
      return false;
  }
}

/// Whether channel c of the result depends on channel c of the input number `k` alone.
bool keeps_channels(const Instruction& code, int k) {
  switch (code.op) {
    case Op::kMix:
      return static_cast<BlendMode>(code.mode) < BlendMode::kHue;
    case Op::kBrightContrast:
    case Op::kGamma:
      return k == 0;
    case Op::kInvert:
      return k == 1;
    case Op::kMapRange:
      return (code.flags & kPerChannel) != 0;
    case Op::kTableChannels:
      return true;
    case Op::kVectorMath: {
      const auto mode = static_cast<VectorMode>(code.mode);
      const bool mixes = (mode >= VectorMode::kCross && mode <= VectorMode::kLength) ||
                         mode == VectorMode::kNormalize;
      return !mixes && k < 3;
    }
    default:
      return false;
  }
}

class Finisher {
 public:
  Finisher(Shader shader, const std::string& material)
      : shader_(std::move(shader)), who_("Material '" + material + "'") {}

  std::shared_ptr<const Shader> finish() {
    check();
    order();
    judge_channels();
    return std::make_shared<const Shader>(std::move(shader_));
  }

 private:
  int first_result() const {
    return static_cast<int>(shader_.constants.size() + shader_.literals.size());
  }

  void require(bool fine, const std::string& cause, const std::string& cure = {}) const {
    if (!fine) throw Refused(who_, "shader: " + cause, cure);
  }
  template <class List>
  void require_item(const Instruction& code, const List& list, const char* kind) const {
    require(code.item >= 0 && code.item < static_cast<int>(list.size()),
            std::string(kind) + " " + std::to_string(code.item) + " lies outside [0, " +
                std::to_string(list.size()) + ")",
            "add it first");
  }
  void require_register(int index, int end) const {
    require(index >= -1 && index < end,
            "register " + std::to_string(index) + " lies outside [-1, " + std::to_string(end) + ")",
            "name one that is computed before");
  }

  void check() const {
    int end = first_result();
    for (const Instruction& code : shader_.instructions) {
      require(code.first + code.count <= static_cast<int>(shader_.operands.size()),
              "an instruction has more inputs than there are");
      for (int k = 0; k < code.count; ++k) require_register(shader_.operands[code.first + k], end);
      if (code.op == Op::kImage) require_item(code, shader_.textures, "texture");
      if (code.op == Op::kTable || code.op == Op::kTableChannels)
        require_item(code, shader_.tables, "table");
      const bool named = code.op == Op::kAttribute ||
                         (code.op == Op::kNormalMap &&
                          static_cast<NormalMapMode>(code.mode) == NormalMapMode::kTangent);
      if (named) require_item(code, shader_.names, "name");
      ++end;
    }
    for (const ShaderTable& table : shader_.tables)
      require(table.values.size() == ShaderTable::kSize && table.high > table.low,
              "a table has " + std::to_string(table.values.size()) + " rows over [" +
                  std::to_string(table.low) + ", " + std::to_string(table.high) + "]",
              "give 257 over a range");
    for (const ShaderClosure& closure : shader_.closures) {
      const std::size_t wanted = closure_parameters(closure.kind).size();
      require(closure.inputs.size() == wanted,
              "a closure has " + std::to_string(closure.inputs.size()) + " inputs",
              "give " + std::to_string(wanted));
      for (const int index : closure.inputs) {
        require(index >= 0, "a closure has an input without register", "give every one a register");
        require_register(index, end);
      }
      require_register(closure.weight, end);
      require_register(closure.normal, end);
      require_register(closure.tangent, end);
    }
  }

  /// What depends on the hit comes last, in the order that it had.
  void order() {
    const int before = first_result(), count = static_cast<int>(shader_.instructions.size());
    std::vector<char> varies(static_cast<std::size_t>(before + count), 0);
    for (int i = 0; i < count; ++i) {
      const Instruction& code = shader_.instructions[i];
      bool found = asks_for_hit(code);
      for (int k = 0; k < code.count; ++k)
        if (const int from = shader_.operands[code.first + k]; from >= 0)
          found = found || varies[from] != 0;
      varies[before + i] = found;
    }
    std::vector<int> number(varies.size());
    for (int i = 0; i < before; ++i) number[i] = i;
    std::vector<Instruction> sorted;
    for (const char later : {0, 1})
      for (int i = 0; i < count; ++i)
        if (varies[before + i] == later) {
          number[before + i] = before + static_cast<int>(sorted.size());
          sorted.push_back(shader_.instructions[i]);
        }
    shader_.instructions = std::move(sorted);
    const auto renumber = [&](int& index) {
      if (index >= 0) index = number[index];
    };
    for (int& index : shader_.operands) renumber(index);
    for (ShaderClosure& closure : shader_.closures) {
      for (int& index : closure.inputs) renumber(index);
      renumber(closure.weight);
      renumber(closure.normal);
      renumber(closure.tangent);
    }
    shader_.fixed = static_cast<int>(std::count(varies.begin(), varies.end(), 0));
  }

  /// A colour whose channels meet on the way takes a derivative for each of them.
  void judge_channels() {
    std::vector<char> meet(static_cast<std::size_t>(shader_.registers()), 0);
    const auto mark = [&](int index, bool how) {
      if (index >= 0 && how) meet[index] = 1;
    };
    for (const ShaderClosure& closure : shader_.closures) {
      const auto parameters = closure_parameters(closure.kind);
      for (std::size_t i = 0; i < parameters.size(); ++i)
        mark(closure.inputs[i], !parameters[i].diagonal);
      mark(closure.weight, true);
      mark(closure.normal, true);
      mark(closure.tangent, true);
    }
    for (int i = static_cast<int>(shader_.instructions.size()); i-- > 0;) {
      const Instruction& code = shader_.instructions[i];
      const bool met = meet[first_result() + i] != 0;
      for (int k = 0; k < code.count; ++k)
        mark(shader_.operands[code.first + k], met || !keeps_channels(code, k));
    }
    for (std::size_t i = 0; i < shader_.constants.size(); ++i)
      shader_.constants[i].parameter.diagonal = meet[i] == 0;
  }

  Shader shader_;
  std::string who_;
};

}  // namespace

std::vector<Parameter> closure_parameters(ClosureKind kind) {
  std::vector<Parameter> found;
  auto closure = default_closure<double>(kind);
  closure_fields(closure, [&](const Parameter& p, auto&) { found.push_back(p); });
  return found;
}

bool Shader::uses(Op op, int mode) const {
  return std::any_of(instructions.begin(), instructions.end(), [&](const Instruction& code) {
    return code.op == op && (mode < 0 || code.mode == mode);
  });
}

std::shared_ptr<const Shader> finished(Shader shader, const std::string& material) {
  return Finisher(std::move(shader), material).finish();
}

}  // namespace selenite

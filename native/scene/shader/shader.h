// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "math/color.h"
#include "model/closures/closure.h"
#include "model/parameter.h"
#include "scene/shader/operations.h"
#include "scene/texture.h"

namespace selenite {

/// A number or colour of a shader that a fit can change. Its name is NODE.socket.
struct ShaderConstant {
  /// Keeps what `parameter` refers to.
  std::shared_ptr<const std::array<std::string, 3>> texts;
  Parameter parameter;  ///< without `sockets`
  int width = 1;        ///< numbers: 1 or 3
};

/// 257 colours from `low` to `high`, interpolated: a Color Ramp or curves.
struct ShaderTable {
  static constexpr int kSize = 257;
  std::vector<Colorf> values;
  float low = 0, high = 1;
};

struct Instruction {
  Op op = Op::kMath;
  std::uint8_t mode = 0;   ///< see modes.h
  std::uint8_t flags = 0;  ///< of InstructionFlag
  /// Of an input below a Bump: 1 and 2, it is asked for at the point moved along x and y.
  std::uint8_t shift = 0;
  std::uint16_t first = 0, count = 0;  ///< its inputs in Shader::operands
  int item = -1;                       ///< table, texture, name, or what the operation says
  float width = 0;                     ///< of the shift, in footprints of a pixel
};

/// The parameters of a kind of closure, in the order of its `fields`.
std::vector<Parameter> closure_parameters(ClosureKind kind);

/// A closure with its sockets. All numbers are registers.
struct ShaderClosure {
  ClosureKind kind = ClosureKind::kPrincipled;
  Flavour flavour;
  std::vector<int> inputs;  ///< one for each of the closure's `fields`, in their order
  int weight = -1;          ///< its share of the mixture, a number; -1: 1
  int normal = -1;          ///< -1: the interpolated normal
  int tangent = -1;         ///< of two widths; -1: none
};

/// A node tree as a program: what a surface is made of at a hit. Immutable and shared.
///
/// Registers are numbered through: the constants, the literals, then a result for each instruction.
/// Those below `fixed` are the same at all hits; `prepare` computes them once, `run` the rest.
struct Shader {
  std::vector<ShaderConstant> constants;  ///< their values are in Material::constants
  std::vector<Colorf> literals;           ///< what no fit can change
  std::vector<Instruction> instructions;
  std::vector<int> operands;
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<ShaderTable> tables;
  std::vector<std::string> names;  ///< of attributes
  std::vector<ShaderClosure> closures;
  int fixed = 0;  ///< registers that do not depend on the hit

  int registers() const {
    return static_cast<int>(constants.size() + literals.size() + instructions.size());
  }
  int varying() const { return registers() - fixed; }
  bool varies(int index) const { return index >= fixed; }
  /// Whether any instruction asks for it.
  bool uses(Op op, int mode = -1) const;
};

/// Puts what does not depend on the hit first, renumbers, and finds out which colours act channel by
/// channel. InvalidArgument: an operand, table, texture or closure that does not fit.
std::shared_ptr<const Shader> finished(Shader shader, const std::string& material);

}  // namespace selenite

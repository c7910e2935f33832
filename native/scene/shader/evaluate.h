// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "math/color.h"
#include "math/dual.h"
#include "scene/shader/shader.h"
#include "scene/shader/shading_point.h"

namespace selenite {

/// Slots of the derivatives by what an image of a shader gives; `count`: 1 of a number, which is the same
/// in all channels, 3 of a colour, 0 where it is known.
struct ImageSlots {
  int first = 0, count = 0;
};

/// The registers of a shader, by number: those that are the same at all hits, which paths share, and
/// those of one hit.
template <class T>
struct Registers {
  std::span<const Color<T>> fixed;
  std::span<Color<T>> own;
  std::span<const ImageSlots> images{};  ///< of textures, then of colours by name; empty: known

  const Color<T>& operator[](int index) const {
    const auto at = static_cast<std::size_t>(index);
    return at < fixed.size() ? fixed[at] : own[at - fixed.size()];
  }
};

/// Fills the `shader.fixed` registers that do not depend on the hit. T: float, double, or a dual of
/// them with 1, 2, 4, 8 or 16 slots.
template <class T>
void prepare(const Shader& shader, std::span<const Color<T>> constants, std::span<Color<T>> fixed);

/// Runs the rest at one hit: fills `own`, of size `shader.varying()`. Allocates nothing.
template <class T>
void run(const Shader& shader, const ShadingPoint& point, Registers<T> registers);

/// Both at once; `registers` has `shader.registers()` places.
template <class T>
void evaluate(const Shader& shader, const ShadingPoint& point, std::span<const Color<T>> constants,
              std::span<Color<T>> registers) {
  const auto fixed = static_cast<std::size_t>(shader.fixed);
  prepare<T>(shader, constants, registers.first(fixed));
  run<T>(shader, point, Registers<T>{registers.first(fixed), registers.subspan(fixed)});
}

}  // namespace selenite

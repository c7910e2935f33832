// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "scene/scene.h"

namespace selenite {

/// One derivative that a path carries: three channels of d(radiance)/d(parameter).
/// A diagonal colour takes one slot for its three components (channel c holds the derivative with
/// respect to component c); any other parameter takes one slot a component.
struct Slot {
  ParameterRef parameter;
  int component;  ///< -1: all three, diagonally; 0 for a scalar
  bool operator==(const Slot&) const = default;
};

/// Row of a Jacobian: one scalar unknown.
struct UnknownRow {
  int slot;
  int channel;  ///< -1: all channels of the slot; else the only one that is not zero
  int component;
};

/// The slots of a list of parameters, and the rows (one per component) that they answer for.
struct SlotLayout {
  std::vector<ParameterRef> parameters;
  std::vector<Slot> slots;       ///< those of one owner follow each other
  std::vector<UnknownRow> rows;  ///< component by component, in the order of `parameters`

  SlotLayout() = default;
  SlotLayout(const Scene& scene, std::vector<ParameterRef> ticked);

  /// The first slot of the owner that `slot` belongs to.
  int first_of_owner(int slot) const;

 private:
  void add_slots(const Scene& scene, const ParameterRef& ref);
};

/// More slots than this in one pass are refused: render in several.
inline constexpr int kMaxSlots = 32;
/// The same for the slots of one material, the most that a kernel is compiled for.
inline constexpr int kMaxLocalSlots = 16;

}  // namespace selenite

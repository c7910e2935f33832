// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

namespace selenite {

/// What a setting may be. The tables are all there is: the checks here and in Python read
/// them, and so do Python's messages.
struct SettingRange {
  const char* name;
  const char* what;  ///< in words
  double lowest, highest;
  bool has(double value) const { return value >= lowest && value <= highest; }  // false for NaN
};

/// Of a render; `pixels`: width times height.
std::span<const SettingRange> render_ranges();
/// By its name in a table, which has it.
const SettingRange& range_of(std::span<const SettingRange> table, const char* name);

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

#include "math/color.h"
#include "model/parameter.h"

namespace selenite {

/// The parameters of one kind of owner, in the order of its `fields`.
struct ParameterTable {
  std::vector<Parameter> rows;
  std::vector<int> widths;  ///< 1 or 3 components each

  template <class Owner>
  static ParameterTable of() {
    ParameterTable table;
    Owner owner;
    struct Collect {
      ParameterTable& table;
      void operator()(const Parameter& p, double&) const {
        table.rows.push_back(p);
        table.widths.push_back(1);
      }
      void operator()(const Parameter& p, Color<double>&) const {
        table.rows.push_back(p);
        table.widths.push_back(3);
      }
    };
    Owner::fields(owner, Collect{table});
    return table;
  }
  /// The number of a parameter; -1: there is none of that name.
  int find(std::string_view name) const {
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (rows[i].name == name) return static_cast<int>(i);
    return -1;
  }
};

/// Calls `action(parameter, first, count)` for each field of an owner, with its storage.
template <class Owner, class Action>
void visit_fields(Owner& owner, Action&& action) {
  struct Visit {
    Action& at;
    void operator()(const Parameter& p, double& x) const { at(p, &x, 1); }
    void operator()(const Parameter& p, Color<double>& c) const { at(p, &c.r, 3); }
  };
  Owner::fields(owner, Visit{action});
}

/// Calls `action(first, count)` with the storage of one field of its owner.
template <class Owner, class Action>
void visit_field(Owner& owner, int field, Action&& action) {
  int index = 0;
  visit_fields(owner, [&](const Parameter&, double* first, int count) {
    if (index++ == field) action(first, count);
  });
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/response.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "math/fault.h"

namespace selenite {
namespace {

TransferCurve curve_of(const std::vector<std::array<double, 4>>& rows, std::size_t column) {
  std::vector<std::pair<double, double>> points;
  points.reserve(rows.size());
  for (const auto& row : rows) points.emplace_back(row[0], row[column]);
  return {[points = std::move(points)](double code) {
    const auto above =
        std::upper_bound(points.begin() + 1, points.end() - 1, code,
                         [](double value, const auto& point) { return value < point.first; });
    const auto& [c0, v0] = *(above - 1);
    const auto& [c1, v1] = *above;
    return v0 + std::clamp((code - c0) / (c1 - c0), 0.0, 1.0) * (v1 - v0);
  }};
}

}  // namespace

Response table_response(const std::vector<std::array<double, 4>>& rows) {
  const auto refuse = [](std::size_t row, const char* why) {
    throw Refused("response", "row " + std::to_string(row + 1) + " " + why);
  };
  if (rows.size() < 2)
    throw Refused("response", "a table has at least two rows, not " + std::to_string(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const double value : rows[i])
      if (!std::isfinite(value)) refuse(i, "holds a value that is not finite");
    if (i == 0) continue;
    if (!(rows[i][0] > rows[i - 1][0]))
      refuse(i, "has a code value that is not above the one before");
    for (std::size_t c = 1; c < 4; ++c)
      if (rows[i][c] < rows[i - 1][c]) refuse(i, "has less light than the one before");
  }
  Response response;
  response.curves = {curve_of(rows, 1), curve_of(rows, 2), curve_of(rows, 3)};
  response.counted.fill({rows.front()[0], rows.back()[0]});
  return response;
}

}  // namespace selenite

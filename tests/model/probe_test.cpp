// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/probe.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "math/dual.h"

#ifndef SELENITE_SOURCE_DIR
#define SELENITE_SOURCE_DIR "."
#endif

namespace selenite {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) out.push_back(cell);
  if (!out.empty() && !out.back().empty() && out.back().back() == '\r') out.back().pop_back();
  return out;
}

std::vector<Row> read(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<std::string> head;
  std::vector<Row> rows;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    const auto values = cells(line);
    if (head.empty()) {
      head = values;
      continue;
    }
    Row row;
    for (std::size_t i = 0; i < head.size(); ++i) row[head[i]] = values.at(i);
    rows.push_back(row);
  }
  return rows;
}

/// Tables measured in Cycles; they are no part of the repository.
std::filesystem::path probes(const char* name) {
  const char* shared = std::getenv("SELENITE_SHARED_DIR");
  const std::filesystem::path root =
      shared ? shared : std::filesystem::path(SELENITE_SOURCE_DIR) / ".." / "shared";
  return root / "check" / "probes" / name;
}

struct Family {
  int rows = 0, close = 0;
  std::vector<double> errors;  // relative to the largest channel
};

/// Compares a table row by row; `left_out` counts rows of what is not modelled.
std::map<std::string, Family> compare(const std::filesystem::path& file, double tolerance,
                                      int& left_out) {
  std::map<std::string, Family> families;
  for (const Row& row : read(file)) {
    Probe p;
    try {
      for (const auto& [column, value] : row) p.set(column, value);
    } catch (const std::invalid_argument&) {
      ++left_out;
      continue;
    }
    const Color<double> got = probe(p);
    Family& family = families[row.at("family")];
    double error = 0, largest = 0;
    for (int c = 0; c < 3; ++c) {
      const double want = std::stod(row.at(std::string("f_cos_") + "rgb"[c]));
      error = std::max(error, std::abs(got[c] - want));
      largest = std::max(largest, want);
    }
    const double allowed = tolerance + 5 * std::stod(row.at("rel_float_noise"));
    ++family.rows;
    family.close += largest > 0 ? error <= allowed * largest : error == 0;
    if (largest > 0) family.errors.push_back(error / largest);
  }
  return families;
}

TEST(Probes, EqualWhatCyclesRenders) {
  const auto file = probes("principled_v2.csv");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "no table of measurements at " << file << " (set SELENITE_SHARED_DIR)";
  int with_sheen = 0;
  // 3e-4: Cycles' albedo tables and ours are quadratures of the same integrals.
  auto families = compare(file, 3e-4, with_sheen);
  EXPECT_GE(families.size(), 17u);
  EXPECT_LT(with_sheen, 600);
  for (auto& [name, family] : families) {
    std::sort(family.errors.begin(), family.errors.end());
    EXPECT_LT(family.errors[family.errors.size() / 2], 1e-5) << name;
    EXPECT_GE(family.close, 0.998 * family.rows) << name;
  }
}

TEST(Probes, EqualWhatBlender3Renders) {
  const auto file = probes("principled_v1_ggx.csv");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "no table of measurements at " << file << " (set SELENITE_SHARED_DIR)";
  int with_transmission_roughness = 0;
  auto families = compare(file, 2e-5, with_transmission_roughness);
  EXPECT_EQ(families.size(), 7u);
  for (auto& [name, family] : families) {
    std::sort(family.errors.begin(), family.errors.end());
    EXPECT_LT(family.errors[family.errors.size() / 2], 1e-6) << name;
    EXPECT_EQ(family.close, family.rows) << name;
  }
}

TEST(Probe, SetsWhatAColumnNames) {
  Probe p;
  EXPECT_TRUE(p.set("base_g", "0.1"));
  EXPECT_EQ(p.material.base_color.g, static_cast<double>(0.1f));  // as a socket holds it
  EXPECT_TRUE(p.set("coat_tint_b", "0.25"));
  EXPECT_EQ(p.material.coat_tint.b, 0.25);
  EXPECT_TRUE(p.set("ior", "1.25"));
  EXPECT_EQ(p.material.ior, 1.25);
  EXPECT_TRUE(p.set("wo_z", "-0.5"));
  EXPECT_EQ(p.wo.z, -0.5);
  EXPECT_TRUE(p.set("distribution", "GGX"));
  EXPECT_EQ(p.flavour.distribution, Flavour::Distribution::kGgx);
  for (const char* other :
       {"family", "f_cos_r", "rel_float_noise", "roughness_r", "base", "coat_tint"})
    EXPECT_FALSE(p.set(other, "0.5")) << other;
}

TEST(Probe, RefusesWhatItCannotEvaluate) {
  Probe p;
  EXPECT_TRUE(p.set("sheen_weight", "0"));
  EXPECT_THROW(p.set("sheen_weight", "0.5"), std::invalid_argument);
  EXPECT_THROW(p.set("transmission_roughness", "0.5"), std::invalid_argument);
  EXPECT_THROW(p.set("roughness", "rough"), std::invalid_argument);
  EXPECT_THROW(p.set("roughness", "0.5x"), std::invalid_argument);
  EXPECT_THROW(p.set("distribution", "BECKMANN"), std::invalid_argument);
}

TEST(Probe, SlopesAreDifferencesOfTheValue) {
  Probe p;
  p.material.transmission = 0.4;
  p.material.coat_weight = 0.5;
  p.material.roughness = 0.43;                 // between the nodes of the tables
  p.material.specular_tint = {0.9, 0.8, 0.7};  // no two channels equal: the largest one darkens
  p.wi = {0.3, 0, 0.8};                        // any length
  p.wo = {-0.2, 0.4, 0.7};
  const auto slopes = probe_slopes(p);
  EXPECT_EQ(slopes.size(), 17u);
  const auto slope = [&](std::string_view name) {
    for (const ProbeSlope& s : slopes)
      if (s.name == name) return s.slope;
    ADD_FAILURE() << name;
    return Color<double>{};
  };
  const double h = 1e-6;
  const auto difference = [&](double& x, int c) {
    const double old = x;
    x = old + h;
    const double hi = probe(p)[c];
    x = old - h;
    const double lo = probe(p)[c];
    x = old;
    return (hi - lo) / (2 * h);
  };
  Principled<double>& m = p.material;
  EXPECT_NEAR(slope("roughness").g, difference(m.roughness, 1), 1e-7);
  EXPECT_NEAR(slope("ior").b, difference(m.ior, 2), 1e-7);
  EXPECT_NEAR(slope("base_color").r, difference(m.base_color.r, 0), 1e-7);
  EXPECT_NEAR(slope("base_color").b, difference(m.base_color.b, 2), 1e-7);
  EXPECT_NEAR(slope("specular_tint_g").g, difference(m.specular_tint.g, 1), 1e-7);
}

TEST(Fields, DescribeTheDefaultsOfTheNode) {
  int count = 0;
  const Principled<double> m;
  Principled<double>::fields(m, [&](const Parameter& p, const auto& member) {
    ++count;
    EXPECT_LE(p.lower, p.fit_lower) << p.name;
    EXPECT_LT(p.fit_lower, p.fit_upper) << p.name;
    EXPECT_LE(p.fit_upper, p.upper) << p.name;
    EXPECT_FALSE(p.sockets.empty() || p.unit.empty() || p.help.empty()) << p.name;
    if constexpr (requires { member.r; }) {
      EXPECT_EQ(member.r, p.initial) << p.name;
      EXPECT_TRUE(member.g == member.r && member.b == member.r) << p.name;
    } else {
      EXPECT_EQ(member, p.initial) << p.name;
    }
  });
  EXPECT_EQ(count, 15);
}

TEST(Fields, SurviveAChangeOfScalar) {
  Principled<double> m;
  m.base_color = {0.1, 0.2, 0.3};
  m.coat_ior = 1.7;
  const auto lifted = lift<Dual<float, 3>>(m);
  EXPECT_EQ(lifted.base_color.b.v, 0.3f);
  EXPECT_EQ(lifted.coat_ior.v, 1.7f);
  EXPECT_FALSE(has_slope(lifted.base_color));
  EXPECT_EQ(lift<double>(lifted).base_color.g, static_cast<double>(0.2f));
}

}  // namespace
}  // namespace selenite

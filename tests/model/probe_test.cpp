// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/probe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "math/dual.h"
#include "math/error.h"

#ifndef SELENITE_SOURCE_DIR
#define SELENITE_SOURCE_DIR "."
#endif

namespace selenite {
namespace {

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) out.push_back(cell);
  if (!out.empty() && !out.back().empty() && out.back().back() == '\r') out.back().pop_back();
  return out;
}

/// A table measured in Cycles.
struct Measured {
  std::vector<std::string> family;
  std::vector<std::string> columns;  // of numbers
  std::vector<double> numbers, f_cos, noise;
  std::vector<std::uint8_t> multi_ggx;

  Measured(const std::filesystem::path& file, Flavour::Version version) {
    std::ifstream in(file);
    std::vector<std::string> head;
    const auto known = probe_columns(version);
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || line[0] == '#') continue;
      const auto values = cells(line);
      const bool first = head.empty();
      if (first) head = values;
      for (std::size_t i = 0; i < head.size(); ++i) {
        const std::string& name = head[i];
        const bool number =
            std::any_of(known.begin(), known.end(), [&](const auto& c) { return c.name == name; });
        if (first) {
          if (number) columns.push_back(name);
          continue;
        }
        const std::string& cell = values.at(i);
        if (number) numbers.push_back(std::stod(cell));
        if (name.starts_with("f_cos")) f_cos.push_back(std::stod(cell));
        if (name == "rel_float_noise") noise.push_back(std::stod(cell));
        if (name == "family") family.push_back(cell);
        if (name == "distribution") multi_ggx.push_back(cell == "MULTI_GGX");
      }
    }
    for (const ProbeColumn& c : known)
      EXPECT_TRUE(!c.required || std::find(columns.begin(), columns.end(), c.name) != columns.end())
          << c.name;
  }
};

/// A table measured in Cycles: a few rows of each lobe are beside this file, all of them in a folder
/// that SELENITE_SHARED_DIR may name.
std::filesystem::path few_probes(const char* name) {
  return std::filesystem::path(SELENITE_SOURCE_DIR) / "tests" / "model" / "probes" / name;
}
std::filesystem::path all_probes(const char* name) {
  const char* shared = std::getenv("SELENITE_SHARED_DIR");
  const std::filesystem::path root =
      shared ? shared : std::filesystem::path(SELENITE_SOURCE_DIR) / ".." / "shared";
  return root / "check" / "probes" / name;
}

struct Family {
  int rows = 0;
  std::map<double, int> close;  // rows within a tolerance
  std::vector<double> errors;   // relative to the largest channel
  double median() {
    std::sort(errors.begin(), errors.end());
    return errors[errors.size() / 2];
  }
};

/// Compares a table row by row.
std::map<std::string, Family> compare(const Measured& table, Flavour::Version version) {
  std::map<std::string, Family> families;
  const std::size_t rows = table.family.size();
  std::vector<double> got(3 * rows);
  ProbeTable(version, table.columns)
      .evaluate(table.numbers.data(), table.multi_ggx.data(), rows, got.data());
  for (std::size_t i = 0; i < rows; ++i) {
    Family& family = families[table.family[i]];
    double error = 0, largest = 0;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      error = std::max(error, std::abs(got[c] - table.f_cos[c]));
      largest = std::max(largest, table.f_cos[c]);
    }
    ++family.rows;
    for (const double tolerance : {2e-5, 3e-4}) {
      const double allowed = tolerance + 5 * table.noise[i];
      family.close[tolerance] += largest > 0 ? error <= allowed * largest : error == 0;
    }
    if (largest > 0) family.errors.push_back(error / largest);
  }
  return families;
}

void expect_as_cycles(const std::filesystem::path& file) {
  auto families = compare({file, Flavour::Version::kV2}, Flavour::Version::kV2);
  EXPECT_EQ(families.size(), 20u);
  for (auto& [name, family] : families) {
    EXPECT_LE(family.median(), 1e-5) << name;
    EXPECT_GE(family.close[3e-4], 0.998 * family.rows) << name;
    if (name.starts_with("ggx_")) {
      EXPECT_EQ(family.close[2e-5], family.rows) << name;
    }
  }
}

void expect_as_blender3(const std::filesystem::path& file) {
  auto families = compare({file, Flavour::Version::kV1}, Flavour::Version::kV1);
  EXPECT_EQ(families.size(), 8u);
  for (auto& [name, family] : families) {
    EXPECT_LE(family.median(), 1e-6) << name;
    EXPECT_EQ(family.close[2e-5], family.rows) << name;
  }
}

TEST(Probes, OfEveryLobeEqualWhatCyclesRenders) {
  expect_as_cycles(few_probes("principled_v2.csv"));
  expect_as_blender3(few_probes("principled_v1_ggx.csv"));
}

TEST(Probes, EqualWhatCyclesRenders) {
  const auto file = all_probes("principled_v2.csv");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "no table of measurements at " << file << " (set SELENITE_SHARED_DIR)";
  expect_as_cycles(file);
}

TEST(Probes, EqualWhatBlender3Renders) {
  const auto file = all_probes("principled_v1_ggx.csv");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "no table of measurements at " << file << " (set SELENITE_SHARED_DIR)";
  expect_as_blender3(file);
}

/// A line of defaults that can be changed by the name of a column.
struct Line {
  Flavour::Version version;
  std::vector<std::string> names;
  std::vector<double> numbers;

  explicit Line(Flavour::Version v) : version(v) {
    const Principled<double> material;
    std::vector<double> initial;
    Principled<double>::fields(
        material, [&](const Parameter& p, const auto&) { initial.push_back(p.initial); });
    for (const ProbeColumn& c : probe_columns(version)) {
      names.push_back(c.name);
      const double straight = c.channel == 2 ? 1 : 0;
      numbers.push_back(c.parameter ? initial[c.field] : straight);
    }
  }
  double& operator[](const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    EXPECT_TRUE(found != names.end()) << name;
    return numbers[found - names.begin()];
  }
  std::array<double, 3> value(std::uint8_t multi_ggx = 1) const {
    std::array<double, 3> f{};
    ProbeTable(version, names).evaluate(numbers.data(), &multi_ggx, 1, f.data());
    return f;
  }
};

TEST(Probe, ReadsColumnsByName) {
  Line line(Flavour::Version::kV2);
  line["base_g"] = 0.1;
  line["roughness"] = 0.3;
  line["coat_tint_b"] = 0.25;
  line["coat_weight"] = 0.5;
  line["wo_x"] = 0.6;
  line["wo_z"] = 0.8;
  Probe p;
  p.material.base_color.g = static_cast<double>(0.1f);  // as a socket holds it
  p.material.base_color.r = p.material.base_color.b = static_cast<double>(0.8f);
  p.material.roughness = static_cast<double>(0.3f);
  p.material.coat_roughness = static_cast<double>(0.03f);
  p.material.coat_tint.b = 0.25;
  p.material.coat_weight = 0.5;
  p.wo = {0.6, 0, 0.8};
  for (const bool multi_ggx : {false, true}) {
    p.flavour.distribution =
        multi_ggx ? Flavour::Distribution::kMultiGgx : Flavour::Distribution::kGgx;
    for (int c = 0; c < 3; ++c) EXPECT_EQ(line.value(multi_ggx)[c], probe(p)[c]);
  }
}

TEST(Probe, RefusesWhatItCannotEvaluate) {
  for (const char* other : {"family", "f_cos_r", "roughness_r", "base", "specular", "clearcoat"})
    EXPECT_THROW(ProbeTable(Flavour::Version::kV2, {other}), UnknownName) << other;
  for (const char* other : {"specular_level", "sheen_weight", "coat_weight", "specular_tint_r"})
    EXPECT_THROW(ProbeTable(Flavour::Version::kV1, {other}), UnknownName) << other;
  const auto refuses = [](const std::string& name, double number) {
    Line line(Flavour::Version::kV2);
    line[name] = number;
    EXPECT_THROW(line.value(), InvalidArgument) << name;
  };
  refuses("roughness", 1.5);
  refuses("roughness", -0.1);
  refuses("ior", std::nan(""));
  refuses("wo_z", 0.5);
  refuses("wi_z", 0);
  refuses("wi_x", 0.5);
}

TEST(Probe, BlackChannelsOfTheCoatDarkenNothing) {
  // Measured in Cycles: where the coat lets no red through, the red of the specular tint has no part
  // in what is taken from the layers below.
  Line line(Flavour::Version::kV2);
  line["coat_weight"] = 1, line["coat_tint_r"] = 0;
  line["wo_x"] = 0.6, line["wo_z"] = 0.8;
  line["specular_tint_r"] = 1, line["specular_tint_g"] = line["specular_tint_b"] = 0.25;
  const auto blocked = line.value();
  line["specular_tint_r"] = 0.25;
  EXPECT_EQ(line.value()[1], blocked[1]);
  EXPECT_EQ(line.value()[2], blocked[2]);
  line["specular_tint_r"] = 1, line["coat_tint_r"] = 0x1p-30;
  EXPECT_LT(line.value()[1], blocked[1] * 0.999);
}

TEST(Probe, LobesThatTheCoatAllButBlocksAreLeftOut) {
  // Measured in Cycles: what is left of a lobe counts after the tint, as the mean of the channels.
  Line line(Flavour::Version::kV2);
  line["coat_weight"] = 1, line["specular_level"] = 0;
  line["coat_tint_r"] = line["coat_tint_g"] = 0;
  line["wo_x"] = 0.6, line["wo_z"] = 0.8;
  const auto blue = [&](double tint) {
    line["coat_tint_b"] = tint;
    const auto f = line.value();
    return f[2] - f[0];
  };
  EXPECT_EQ(blue(3e-5), 0);
  EXPECT_GT(blue(5e-5), 1e-6);
}

TEST(Probe, SlopesAreDifferencesOfTheValue) {
  for (const auto version : {Flavour::Version::kV1, Flavour::Version::kV2}) {
    Line line(version);
    const bool version1 = version == Flavour::Version::kV1;
    line["transmission"] = 0.375;
    line["metallic"] = 0.25;
    line["roughness"] = 0.4375;  // between the nodes of the tables
    line["base_r"] = 0.75, line["base_g"] = 0.5, line["base_b"] = 0.25;
    if (version1) {
      line["specular_tint"] = 0.5, line["transmission_roughness"] = 0.25;
    } else {
      for (const char* name : {"coat_weight", "coat_roughness", "diffuse_roughness", "sheen_weight",
                               "sheen_roughness"})
        line[name] = 0.515625;
      // No two channels equal: the largest one darkens.
      line["specular_tint_r"] = 0.75, line["specular_tint_g"] = 0.625;
      line["specular_tint_b"] = 0.5, line["coat_tint_g"] = 0.5;
      line["sheen_tint_r"] = 0.75, line["sheen_tint_b"] = 0.5;
    }
    line["wi_x"] = 0.48, line["wi_z"] = version1 ? -std::sqrt(1 - 0.48 * 0.48) : 0.8772684879784524;
    line["wo_x"] = -0.6, line["wo_z"] = version1 ? -0.8 : 0.8;
    const ProbeTable table(version, line.names);
    std::vector<double> slopes(3 * table.parameters());
    const std::uint8_t multi_ggx = !version1;
    table.differentiate(line.numbers.data(), &multi_ggx, 1, slopes.data());
    std::size_t k = 0;
    for (const ProbeColumn& column : probe_columns(version)) {
      if (!column.parameter) continue;
      double& x = line[column.name];
      const double old = x, h = 0x1p-13;  // a step that 32 bits hold exactly
      // One-sided where the range ends, of second order.
      const double side = old + h > column.upper ? -1 : old - h < column.lower ? 1 : 0;
      const auto at = [&](double step) {
        x = old + step;
        const auto f = line.value(multi_ggx);
        x = old;
        return f;
      };
      const auto f = line.value(multi_ggx);
      const auto a = at(side == 0 ? -h : side * h), b = at(side == 0 ? h : 2 * side * h);
      for (int c = 0; c < 3; ++c) {
        const double want =
            side == 0 ? (b[c] - a[c]) / (2 * h) : side * (4 * a[c] - 3 * f[c] - b[c]) / (2 * h);
        EXPECT_NEAR(slopes[c * table.parameters() + k], want, 1e-6 + 1e-4 * std::abs(want))
            << column.name << " of channel " << c << " in version " << (version1 ? 1 : 2);
      }
      ++k;
    }
    EXPECT_EQ(k, table.parameters());
  }
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
  EXPECT_EQ(count, 24);
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

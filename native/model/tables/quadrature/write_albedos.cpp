// SPDX-License-Identifier: GPL-3.0-or-later
//
// write_albedos FILE: writes the source of AlbedoTables that Selenite is linked with. Here the tables are
// those that albedo_tables.cpp works out.

#include <array>
#include <bit>
#include <cstdio>

#include "model/tables/albedo_tables.h"

int main(int count, char** arguments) {
  using selenite::AlbedoTables;
  if (count != 2) return 2;
  std::FILE* file = std::fopen(arguments[1], "w");
  if (!file) {
    std::perror(arguments[1]);
    return 1;
  }
  const auto numbers =
      std::bit_cast<std::array<float, sizeof(AlbedoTables) / sizeof(float)>>(AlbedoTables::get());
  std::fputs(
      "// Written by native/model/tables/quadrature/write_albedos.cpp\n"
      "#include <array>\n"
      "#include <bit>\n\n"
      "#include \"model/tables/albedo_tables.h\"\n\n"
      "namespace selenite {\n\n"
      "const AlbedoTables& AlbedoTables::get() {\n"
      "  static const AlbedoTables tables = std::bit_cast<AlbedoTables>(\n"
      "      std::array<float, sizeof(AlbedoTables) / sizeof(float)>{\n",
      file);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    std::fprintf(file, "%af,%c", static_cast<double>(numbers[i]), i % 8 == 7 ? '\n' : ' ');
  std::fputs("});\n  return tables;\n}\n\n}  // namespace selenite\n", file);
  const bool failed = std::ferror(file) != 0;
  if (std::fclose(file) != 0 || failed) {
    std::perror(arguments[1]);
    return 1;
  }
  return 0;
}

// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/radiance_header.h"

#include <cmath>
#include <sstream>

namespace selenite {
namespace {

constexpr std::uint64_t kLongestHeader = 1u << 16;

/// Numbers in the text, up to `most`.
template <std::size_t Most>
std::size_t parse(const std::string& text, std::array<double, Most>& numbers) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  std::size_t count = 0;
  while (count < Most && stream >> numbers[count]) ++count;
  return count;
}

void read_variable(const std::string& line, RadianceHeader& header) {
  const std::size_t equals = line.find('=');
  if (equals == std::string::npos) return;
  const std::string name = line.substr(0, equals), value = line.substr(equals + 1);
  std::array<double, 3> three{};
  std::array<double, 8> eight{};
  if (name == "FORMAT") {
    std::istringstream(value) >> header.format;
  } else if (name == "EXPOSURE" && parse(value, three) >= 1) {
    for (double& channel : header.exposure) channel *= three[0];
  } else if (name == "COLORCORR" && parse(value, three) == 3) {
    for (std::size_t c = 0; c < 3; ++c) header.exposure[c] *= three[c];
  } else if (name == "PRIMARIES" && parse(value, eight) == 8) {
    header.primaries = eight;
  } else if (name == "GAMMA" && parse(value, three) >= 1) {
    header.gamma = three[0];
  }
}

/// "-Y 480 +X 640" and the seven other orders.
void read_resolution(const std::string& line, RadianceHeader& header) {
  std::istringstream stream(line);
  stream.imbue(std::locale::classic());
  std::string first, second;
  int scanlines = 0, length = 0;
  if (!(stream >> first >> scanlines >> second >> length)) return;
  const auto is_axis = [](const std::string& text, char axis) {
    return text.size() == 2 && (text[0] == '-' || text[0] == '+') && text[1] == axis;
  };
  header.columns_first = is_axis(first, 'X') && is_axis(second, 'Y');
  if (!header.columns_first && !(is_axis(first, 'Y') && is_axis(second, 'X'))) return;
  if (scanlines < 1 || length < 1) return;
  const std::string& x = header.columns_first ? first : second;
  const std::string& y = header.columns_first ? second : first;
  header.x_decreases = x[0] == '-';
  header.y_decreases = y[0] == '-';
  header.scanlines = scanlines;
  header.scanline_length = length;
}

}  // namespace

RadianceHeader radiance_header(const FileView& view) {
  RadianceHeader header;
  std::istringstream text(view.bytes(0, kLongestHeader));
  std::string line;
  bool in_variables = true;
  while (std::getline(text, line)) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!in_variables) {
      read_resolution(line, header);
      break;
    }
    if (line.empty())
      in_variables = false;
    else
      read_variable(line, header);
  }
  return header;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

// Files as bytes, written here and not by the libraries that read them.

namespace selenite {

/// `size` bytes of a whole number.
inline std::string number(std::uint64_t value, int size, bool big_endian) {
  std::string text;
  for (int i = 0; i < size; ++i)
    text += static_cast<char>(value >> 8 * (big_endian ? size - 1 - i : i) & 255);
  return text;
}

// ---- TIFF

struct TiffTag {
  int tag, type;
  std::vector<std::uint32_t> values;
};

/// One page: its tags (BYTE, SHORT and LONG) and its pixels.
struct TiffPage {
  std::vector<TiffTag> tags;
  std::string pixels;
};

/// Little-endian TIFF; tags have to be in order, StripOffsets and StripByteCounts are added.
inline std::string tiff_bytes(const std::vector<TiffPage>& pages) {
  std::string file("II*\0\0\0\0\0", 8);
  std::size_t link = 4;
  for (const TiffPage& page : pages) {
    const std::size_t pixels = file.size();
    file += page.pixels;
    if (file.size() % 2) file += '\0';
    std::vector<TiffTag> tags;
    for (const TiffTag& tag : page.tags) {
      if (tag.tag > 273 && (tags.empty() || tags.back().tag < 273))
        tags.push_back({273, 4, {static_cast<std::uint32_t>(pixels)}});
      if (tag.tag > 279 && tags.back().tag < 279)
        tags.push_back({279, 4, {static_cast<std::uint32_t>(page.pixels.size())}});
      tags.push_back(tag);
    }
    const std::size_t table = file.size();
    file.replace(link, 4, number(table, 4, false));
    std::string entries = number(tags.size(), 2, false), values;
    const std::size_t behind = table + 2 + 12 * tags.size() + 4;
    for (const TiffTag& tag : tags) {
      const int size = tag.type == 3 ? 2 : tag.type == 4 ? 4 : 1;
      std::string data;
      for (const std::uint32_t value : tag.values) data += number(value, size, false);
      entries += number(tag.tag, 2, false) + number(tag.type, 2, false) +
                 number(tag.values.size(), 4, false);
      if (data.size() <= 4) {
        entries += data + std::string(4 - data.size(), '\0');
      } else {
        entries += number(behind + values.size(), 4, false);
        values += data + std::string(data.size() % 2, '\0');
      }
    }
    link = file.size() + entries.size();
    file += entries + std::string(4, '\0') + values;
  }
  return file;
}

/// Tags of a page; `photometric` 2 is RGB, 1 grey.
inline std::vector<TiffTag> tiff_tags(int width, int height, int samples, int bits, int photometric,
                                      int sample_format = 1, std::vector<TiffTag> further = {}) {
  const auto each = [&](int value) {
    return std::vector<std::uint32_t>(static_cast<std::size_t>(samples),
                                      static_cast<std::uint32_t>(value));
  };
  std::vector<TiffTag> tags{{256, 4, {static_cast<std::uint32_t>(width)}},
                            {257, 4, {static_cast<std::uint32_t>(height)}},
                            {258, 3, each(bits)},
                            {259, 3, {1}},
                            {262, 3, {static_cast<std::uint32_t>(photometric)}},
                            {277, 3, {static_cast<std::uint32_t>(samples)}},
                            {278, 4, {static_cast<std::uint32_t>(height)}},
                            {284, 3, {1}},
                            {339, 3, each(sample_format)}};
  for (TiffTag& tag : further) {
    auto at = tags.begin();
    while (at != tags.end() && at->tag < tag.tag) ++at;
    if (at != tags.end() && at->tag == tag.tag)
      *at = tag;
    else
      tags.insert(at, tag);
  }
  return tags;
}

template <class T>
std::string raw_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// ---- PNG

/// Source: ISO/IEC 15948, annex D.
inline std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? 0xedb88320u ^ (crc >> 1) : crc >> 1;
  }
  return ~crc;
}

inline std::string png_chunk(const std::string& kind, const std::string& data) {
  return number(data.size(), 4, true) + kind + data + number(crc32(kind + data), 4, true);
}

/// zlib stream of stored blocks.
inline std::string stored(const std::string& data) {
  std::uint32_t a = 1, b = 0;
  for (const char byte : data) {
    a = (a + static_cast<unsigned char>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  std::string text("\x78\x01", 2);
  for (std::size_t at = 0; at < data.size(); at += 65535) {
    const std::string block = data.substr(at, 65535);
    text += static_cast<char>(at + 65535 >= data.size());
    text += number(block.size(), 2, false) + number(~block.size() & 0xffff, 2, false) + block;
  }
  return text + number(b << 16 | a, 4, true);
}

/// 16-bit RGB of one colour.
inline std::string png_bytes(int width, int height, const std::array<double, 3>& encoded,
                             const std::string& chunks) {
  std::string row(1, '\0');
  for (int x = 0; x < width; ++x)
    for (const double value : encoded)
      row += number(static_cast<std::uint64_t>(value * 65535 + 0.5), 2, true);
  std::string rows;
  for (int y = 0; y < height; ++y) rows += row;
  return std::string("\x89PNG\r\n\x1a\n") +
         png_chunk("IHDR", number(width, 4, true) + number(height, 4, true) +
                               std::string("\x10\x02\0\0\0", 5)) +
         chunks + png_chunk("IDAT", stored(rows)) + png_chunk("IEND", "");
}

// ---- JPEG

inline std::string jpeg_segment(char marker, const std::string& data) {
  return std::string("\xff") + marker + number(data.size() + 2, 2, true) + data;
}

// ---- ICC profile, version 2 or 4

/// Numbers of 16 bits after the point.
inline std::string fixed(double value) {
  return number(static_cast<std::uint32_t>(
                    static_cast<std::int32_t>(value * 65536 + (value < 0 ? -0.5 : 0.5))),
                4, true);
}

inline std::string icc_xyz(const std::array<double, 3>& xyz) {
  return std::string("XYZ \0\0\0\0", 8) + fixed(xyz[0]) + fixed(xyz[1]) + fixed(xyz[2]);
}

/// Curve of one exponent, of a table, and the parametric one of sRGB (type 3).
inline std::string icc_gamma(double exponent) {
  return std::string("curv\0\0\0\0", 8) + number(1, 4, true) +
         number(static_cast<std::uint64_t>(exponent * 256 + 0.5), 2, true) + std::string(2, '\0');
}
inline std::string icc_table(const std::vector<double>& values) {
  std::string text = std::string("curv\0\0\0\0", 8) + number(values.size(), 4, true);
  for (const double value : values)
    text += number(static_cast<std::uint64_t>(value * 65535 + 0.5), 2, true);
  return text + std::string(text.size() % 4, '\0');
}
inline std::string icc_parametric_srgb() {
  return std::string("para\0\0\0\0\0\x03\0\0", 12) + fixed(2.4) + fixed(1 / 1.055) +
         fixed(0.055 / 1.055) + fixed(1 / 12.92) + fixed(0.04045);
}

struct IccTag {
  std::string name, data;
};

inline std::string icc_bytes(const std::string& color_space, const std::string& connection,
                             std::vector<IccTag> tags, int version = 2) {
  const std::string name = "Test profile";
  tags.insert(tags.begin(),
              {"desc", std::string("desc\0\0\0\0", 8) + number(name.size() + 1, 4, true) + name +
                           std::string(1 + 4 + 4 + 2 + 1 + 67, '\0')});
  if (version == 4) {
    std::string wide;
    for (const char c : name) wide += std::string(1, '\0') + c;
    tags[0].data = std::string("mluc\0\0\0\0", 8) + number(1, 4, true) + number(12, 4, true) +
                   "enUS" + number(wide.size(), 4, true) + number(28, 4, true) + wide;
  }
  tags.push_back({"wtpt", icc_xyz({0.9642, 1, 0.8249})});
  std::string table = number(tags.size(), 4, true), body;
  const std::size_t first = 128 + 4 + 12 * tags.size();
  for (IccTag& tag : tags) {
    while (tag.data.size() % 4) tag.data += '\0';
    table += tag.name + number(first + body.size(), 4, true) + number(tag.data.size(), 4, true);
    body += tag.data;
  }
  std::string head = number(first + body.size(), 4, true) + std::string(4, '\0') +
                     number(version, 1, true) + std::string(3, '\0') + "mntr" + color_space +
                     connection + std::string(12, '\0') + "acsp" + std::string(28, '\0') +
                     fixed(0.9642) + fixed(1) + fixed(0.8249);
  head.resize(128, '\0');
  return head + table + body;
}

}  // namespace selenite

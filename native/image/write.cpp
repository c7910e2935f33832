// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/write.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>

#include "image/file_error.h"
#include "image/limits.h"
#include "math/error.h"
#include "math/srgb.h"

namespace selenite {
namespace {

void check_shape(const std::string& path, int width, int height, int channels) {
  if (width < 1 || height < 1 || channels < 1 ||
      static_cast<std::int64_t>(width) * height > kLargestPicture)
    throw InvalidArgument("'" + path + "': a picture of " + std::to_string(width) + " x " +
                          std::to_string(height) + " with " + std::to_string(channels) +
                          " channels cannot be written; sizes from 1 to 100 megapixels can");
}

/// Runs `write(temporary name)` and gives the result its name, or cleans up and throws FileError.
template <class Write>
void replace_file(const std::string& path, Write&& write) {
  std::random_device entropy;  // two processes may write the same file
  const std::string temporary =
      path + "." + std::to_string(entropy()) + std::to_string(entropy()) + ".part";
  std::error_code ignored;
  try {
    write(temporary);
    std::filesystem::rename(path_from_utf8(temporary), path_from_utf8(path));
  } catch (const std::exception& error) {
    std::filesystem::remove(path_from_utf8(temporary), ignored);
    throw FileError("'" + path + "' cannot be written: " + error.what() +
                    "; check that the folder exists, is writable and has room");
  }
}

std::vector<std::string> default_names(int channels) {
  if (channels == 1) return {"Y"};
  if (channels == 3) return {"R", "G", "B"};
  if (channels == 4) return {"R", "G", "B", "A"};
  return {};
}

template <class T>
std::vector<T> encoded(const float* pixels, std::size_t count, float top) {
  std::vector<T> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float linear = pixels[i] > 0 ? std::min(pixels[i], 1.f) : 0.f;  // NaN: 0
    values[i] = static_cast<T>(std::lround(srgb_encode(linear) * top));
  }
  return values;
}

}  // namespace

void write_exr(const std::string& path, const float* pixels, int width, int height, int channels,
               std::vector<std::string> names) {
  check_shape(path, width, height, channels);
  if (names.empty()) names = default_names(channels);
  if (static_cast<int>(names.size()) != channels ||
      names.size() != std::set(names.begin(), names.end()).size())
    throw InvalidArgument("'" + path + "': " + std::to_string(channels) +
                          " channels need as many different names, not " +
                          std::to_string(names.size()) + "; give channel_names");
  replace_file(path, [&](const std::string& temporary) {
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer buffer;
    const std::size_t x_stride = sizeof(float) * static_cast<std::size_t>(channels);
    for (int c = 0; c < channels; ++c) {
      const std::string& name = names[static_cast<std::size_t>(c)];
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      // OpenEXR's slices are for reading and writing alike, hence not const; writing only reads.
      char* first = reinterpret_cast<char*>(const_cast<float*>(pixels + c));
      buffer.insert(name, Imf::Slice(Imf::FLOAT, first, x_stride,
                                     x_stride * static_cast<std::size_t>(width)));
    }
    Imf::OutputFile file(temporary.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(height);
  });
}

void write_png(const std::string& path, const float* pixels, int width, int height, int channels,
               int bit_depth) {
  check_shape(path, width, height, channels);
  if (channels != 1 && channels != 3)
    throw InvalidArgument("'" + path + "': PNG is written with 1 or 3 channels, not " +
                          std::to_string(channels));
  if (bit_depth != 8 && bit_depth != 16)
    throw InvalidArgument("'" + path + "': bit_depth = " + std::to_string(bit_depth) +
                          " must be 8 or 16");
  const std::size_t count = static_cast<std::size_t>(width) * height * channels;
  replace_file(path, [&](const std::string& temporary) {
    const auto file = OIIO::ImageOutput::create("png");
    if (!file) throw FileError(OIIO::geterror());
    const auto type = bit_depth == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
    OIIO::ImageSpec spec(width, height, channels, type);
    const auto check = [&](bool ok) {
      if (!ok) throw FileError(file->geterror());
    };
    check(file->open(temporary, spec));
    if (bit_depth == 8)
      check(file->write_image(type, encoded<std::uint8_t>(pixels, count, 255.f).data()));
    else
      check(file->write_image(type, encoded<std::uint16_t>(pixels, count, 65535.f).data()));
    check(file->close());
  });
}

}  // namespace selenite

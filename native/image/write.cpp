// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/write.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#ifndef _WIN32
#include <unistd.h>
#endif

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <set>

#include "image/file_error.h"
#include "image/limits.h"
#include "math/fault.h"
#include "math/srgb.h"

namespace selenite {
namespace {

/// Numbers of a picture that is compressed in a third of the time, to some 5 % more bytes.
constexpr std::size_t kLargeEnough = 12'000'000;
constexpr int kFastCompression = 3;

void check_shape(const std::string& path, int width, int height, int channels) {
  if (width < 1 || height < 1 || channels < 1 ||
      static_cast<std::int64_t>(width) * height > kLargestPicture)
    throw Refused("'" + path + "'",
                  "a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                      " with " + std::to_string(channels) + " channels cannot be written",
                  "sizes from 1 to 100 megapixels can");
}

/// A picture in memory: its encoders do not say whether a disk took all of a file.
class Bytes : public Imf::OStream {
 public:
  explicit Bytes(const std::string& path) : Imf::OStream(path.c_str()) {}
  void write(const char data[], int count) override {
    const std::size_t size = static_cast<std::size_t>(count);
    if (at_ + size > content.size()) content.resize(at_ + size);
    std::copy_n(data, size, content.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += size;
  }
  // OpenEXR 3 has other types of numbers in these two than OpenEXR 2.
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = static_cast<std::size_t>(position); }

  std::vector<char> content;

 private:
  std::size_t at_ = 0;
};

/// Writes all of `content` to the disk, or throws.
void write_whole(const std::filesystem::path& path, const char* content, std::size_t size) {
#ifdef _WIN32
  std::FILE* file = _wfopen(path.c_str(), L"wb");
#else
  std::FILE* file = std::fopen(path.c_str(), "wb");
#endif
  const auto fail = [](int code) { throw std::runtime_error(std::strerror(code)); };
  if (file == nullptr) fail(errno);
  const bool is_written = std::fwrite(content, 1, size, file) == size && std::fflush(file) == 0;
  int code = is_written ? 0 : errno;
#ifndef _WIN32
  // A disk over a network, and a quota, may refuse only now.
  if (code == 0 && ::fsync(::fileno(file)) != 0 && errno != EINVAL) code = errno;
#endif
  if (std::fclose(file) != 0 && code == 0) code = errno;
  if (code != 0) fail(code);
}

/// Gives the bytes their name once they are all there, or cleans up and throws FileError. The name
/// until then is short, as that of the file may be as long as a file system permits.
void replace_file(const std::string& path, const char* content, std::size_t size) {
  std::random_device entropy;  // two processes may write the same file
  const std::filesystem::path target = path_from_utf8(path);
  const std::filesystem::path temporary =
      target.parent_path() /
      path_from_utf8(".selenite-" + std::to_string(entropy()) + std::to_string(entropy()));
  std::error_code ignored;
  try {
    write_whole(temporary, content, size);
    std::filesystem::rename(temporary, target);
  } catch (const std::exception& error) {
    std::filesystem::remove(temporary, ignored);
    refuse(path, std::string("cannot be written: ") + error.what(),
           "check that the folder exists, is writable and has room");
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
    throw Refused("'" + path + "'",
                  std::to_string(channels) + " channels need as many different names, not " +
                      std::to_string(names.size()),
                  "give channel_names");
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer buffer;
  const std::size_t x_stride = sizeof(float) * static_cast<std::size_t>(channels);
  for (int c = 0; c < channels; ++c) {
    const std::string& name = names[static_cast<std::size_t>(c)];
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    // OpenEXR's slices are for reading and writing alike, hence not const; writing only reads.
    char* first = reinterpret_cast<char*>(const_cast<float*>(pixels + c));
    buffer.insert(
        name, Imf::Slice(Imf::FLOAT, first, x_stride, x_stride * static_cast<std::size_t>(width)));
  }
  Bytes bytes(path);
  {
    Imf::OutputFile file(bytes, header);  // its destructor writes the table of lines
    file.setFrameBuffer(buffer);
    file.writePixels(height);
  }
  replace_file(path, bytes.content.data(), bytes.content.size());
}

void write_png(const std::string& path, const float* pixels, int width, int height, int channels,
               int bit_depth) {
  check_shape(path, width, height, channels);
  if (channels != 1 && channels != 3)
    throw Refused("'" + path + "'",
                  "PNG is written with 1 or 3 channels, not " + std::to_string(channels));
  if (bit_depth != 8 && bit_depth != 16)
    throw Refused("'" + path + "'",
                  "bit_depth = " + std::to_string(bit_depth) + " must be 8 or 16");
  const std::size_t count = static_cast<std::size_t>(width) * height * channels;
  const auto file = OIIO::ImageOutput::create("png");
  const auto fail = [&](const std::string& why) {
    refuse(path, "cannot be written: " + why, "this OpenImageIO is at fault");
  };
  if (!file) fail(OIIO::geterror());
  const auto type = bit_depth == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
  OIIO::ImageSpec spec(width, height, channels, type);
  if (count > kLargeEnough) spec.attribute("png:compressionLevel", kFastCompression);
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto check = [&](bool ok) {
    if (!ok) fail(file->geterror());
  };
  check(file->set_ioproxy(&memory));
  check(file->open("picture.png", spec));
  if (bit_depth == 8)
    check(file->write_image(type, encoded<std::uint8_t>(pixels, count, 255.f).data()));
  else
    check(file->write_image(type, encoded<std::uint16_t>(pixels, count, 65535.f).data()));
  check(file->close());
  replace_file(path, reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

}  // namespace selenite

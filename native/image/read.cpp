// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/read.h"

#include <OpenImageIO/imageio.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "image/file_error.h"
#include "math/srgb.h"

namespace selenite {
namespace {

/// What the camera or scanner cut off: the top value and the one below it, as a JPEG blurs it.
constexpr int kClipMargin = 1;

struct Opened {
  std::unique_ptr<OIIO::ImageInput> input;
  OIIO::ImageSpec spec;
  PictureInfo info;
  std::array<int, 3> color{};  ///< channels of the file to take
  int alpha = -1;
};

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw FileError("'" + path + "' " + why);
}

std::string size_text(std::int64_t width, std::int64_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

void check_size(const std::string& path, const OIIO::ImageSpec& spec) {
  const std::int64_t pixels = static_cast<std::int64_t>(spec.width) * spec.height;
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1)
    refuse(path, "has no flat picture of at least 1 x 1 pixels; export it again");
  if (pixels > kLargestPicture)
    refuse(path, "says it has " + size_text(spec.width, spec.height) +
                     " pixels; at most 100 megapixels are read: scale it down");
  constexpr int kMostChannels = 64;
  if (spec.nchannels > kMostChannels)
    refuse(path, "has " + std::to_string(spec.nchannels) + " channels; save R, G, B (and A) only");
}

void choose_channels(const std::string& path, Opened& file) {
  const OIIO::ImageSpec& spec = file.spec;
  std::array<int, 3> rgb{-1, -1, -1};
  int grey = -1;
  for (int c = 0; c < spec.nchannels; ++c) {
    const std::string& name = spec.channelnames[static_cast<std::size_t>(c)];
    if (name == "R") rgb[0] = c;
    if (name == "G") rgb[1] = c;
    if (name == "B") rgb[2] = c;
    if (name == "A") file.alpha = c;
    if (name == "Y" || name == "I") grey = c;
  }
  if (spec.alpha_channel >= 0) file.alpha = spec.alpha_channel;
  const int rest = spec.nchannels - (file.alpha >= 0 ? 1 : 0);
  if (rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0) {
    file.color = rgb;
  } else if (grey >= 0 || rest == 1) {
    if (grey < 0) grey = file.alpha == 0 ? 1 : 0;
    file.color = {grey, grey, grey};
    file.info.grey = true;
  } else {
    std::string names;
    for (const std::string& name : spec.channelnames) names += (names.empty() ? "" : ", ") + name;
    refuse(path, "has no channels R, G, B or one grey channel but: " + names +
                     "; save it as plain RGB or RGBA (not multilayer)");
  }
}

void check_depth(const std::string& path, const FileHead& head, Opened& file) {
  const OIIO::ImageSpec& spec = file.spec;
  const int bits = spec.get_int_attribute("oiio:BitsPerSample", 0);
  constexpr int kTiffPalette = 3;
  if (head.png_palette ||
      spec.get_int_attribute("tiff:PhotometricInterpretation", -1) == kTiffPalette)
    refuse(path, "has a palette instead of colours; save it as RGB with 8 or 16 bits per channel");
  if ((head.png_bit_depth > 0 && head.png_bit_depth < 8) || (bits > 0 && bits < 8))
    refuse(path, "has fewer than 8 bits per channel; save it with 8 or 16 bits");
  const auto base = spec.format.basetype;
  file.info.is_float = spec.format.is_floating_point();
  if (!file.info.is_float && base != OIIO::TypeDesc::UINT8 && base != OIIO::TypeDesc::UINT16)
    refuse(path, "stores " + std::string(spec.format.c_str()) +
                     " numbers; save it with 8 or 16 bits per channel or as float");
  file.info.bit_depth = static_cast<int>(spec.format.size()) * 8;
}

void collect_warnings(Opened& file) {
  PictureInfo& info = file.info;
  const OIIO::ImageSpec& spec = file.spec;
  const auto text = [&](const char* name) { return std::string(spec.get_string_attribute(name)); };
  info.orientation = spec.get_int_attribute("Orientation", 1);
  info.cmyk = text("jpeg:ColorSpace") == "CMYK" || text("jpeg:ColorSpace") == "YCbCrK" ||
              text("tiff:ColorSpace") == "CMYK" || text("oiio:ColorSpace") == "CMYK" ||
              spec.get_int_attribute("tiff:PhotometricInterpretation", -1) == 5;
  if (info.orientation != 1)
    info.warnings.push_back("its EXIF orientation is " + std::to_string(info.orientation) +
                            " (turned or mirrored); pixels are taken as stored");
  if (info.cmyk) info.warnings.push_back("it is CMYK; its colours are not calibrated");
  if (const std::string profile = text("ICCProfile:profile_description");
      !profile.empty() && profile.find("sRGB") == std::string::npos)
    info.warnings.push_back("its colour profile '" + profile + "' is ignored; sRGB is assumed");
  if (!info.is_float && text("oiio:ColorSpace") == "Linear")
    info.warnings.push_back("it says that its integers are linear; they are read as sRGB");
}

Opened open(const std::string& path) {
  const FileHead head = recognise(path);
  Opened file;
  file.info.format = head.format;
  // By plugin name: the extension plays no part, and no other decoder sees the file.
  file.input = OIIO::ImageInput::create(format_name(head.format));
  if (!file.input)
    refuse(path, std::string("is ") + format_name(head.format) +
                     ", which this OpenImageIO cannot read: " + OIIO::geterror());
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  if (!file.input->open(path, file.spec, config))
    refuse(path, "cannot be read: " + file.input->geterror() + "; copy or export it again");
  const OIIO::ImageSpec& spec = file.spec;
  check_size(path, spec);
  if (spec.deep) refuse(path, "is a deep picture; save it flat");
  if (spec.width != spec.full_width || spec.height != spec.full_height || spec.x != spec.full_x ||
      spec.y != spec.full_y)
    refuse(path, "stores " + size_text(spec.width, spec.height) + " pixels of a frame of " +
                     size_text(spec.full_width, spec.full_height) +
                     "; save the whole frame, without crop or overscan");
  check_depth(path, head, file);
  choose_channels(path, file);
  file.info.width = spec.width;
  file.info.height = spec.height;
  file.info.channels = spec.nchannels;
  collect_warnings(file);
  return file;
}

template <class T>
std::vector<T> read_all(const std::string& path, Opened& file, OIIO::TypeDesc type) {
  const OIIO::ImageSpec& spec = file.spec;
  std::vector<T> raw(static_cast<std::size_t>(spec.width) * spec.height * spec.nchannels);
  const bool ok = file.input->read_image(0, 0, 0, spec.nchannels, type, raw.data());
  // Half a JPEG reads "ok", with grey filler; the error string is the only trace.
  const std::string error = file.input->geterror();
  if (!ok || !error.empty())
    refuse(path, "is truncated or damaged" + (error.empty() ? "" : ": " + error) +
                     "; copy or export it again");
  return raw;
}

/// Integer file: a table does the decoding, as there are few values.
template <class T>
void fill_from_integers(const std::string& path, Opened& file, bool as_linear, Photo& photo) {
  constexpr int kTop = std::numeric_limits<T>::max();
  const std::vector<T> raw =
      read_all<T>(path, file, sizeof(T) == 1 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16);
  std::vector<float> decoded(kTop + 1);
  for (int i = 0; i <= kTop; ++i) {
    const float value = static_cast<float>(i) / kTop;
    decoded[static_cast<std::size_t>(i)] = as_linear ? srgb_decode(value) : value;
  }
  const std::size_t step = static_cast<std::size_t>(file.spec.nchannels);
  for (std::size_t i = 0; i < photo.valid.size(); ++i) {
    const T* in = raw.data() + i * step;
    for (int c = 0; c < 3; ++c) {
      const T value = in[file.color[static_cast<std::size_t>(c)]];
      photo.pixels[3 * i + static_cast<std::size_t>(c)] = decoded[value];
      if (value >= kTop - kClipMargin) photo.clipped[i] = 1;
    }
    if (file.alpha >= 0) photo.alpha[i] = static_cast<float>(in[file.alpha]) / kTop;
  }
}

void fill_from_floats(const std::string& path, Opened& file, Photo& photo) {
  const std::vector<float> raw = read_all<float>(path, file, OIIO::TypeDesc::FLOAT);
  const std::size_t step = static_cast<std::size_t>(file.spec.nchannels);
  for (std::size_t i = 0; i < photo.valid.size(); ++i) {
    const float* in = raw.data() + i * step;
    float* out = photo.pixels.data() + 3 * i;
    float unmultiply = 1;
    if (file.alpha >= 0) {
      const float alpha = in[file.alpha];
      if (!std::isfinite(alpha)) photo.valid[i] = 0;
      photo.alpha[i] = std::isfinite(alpha) ? std::fmin(std::fmax(alpha, 0.f), 1.f) : 0;
      // Only EXR is stored multiplied; TIFF has been asked for as it is.
      if (file.info.format == FileFormat::kExr && photo.alpha[i] > 0)
        unmultiply = 1 / photo.alpha[i];
    }
    bool negative = false;
    for (int c = 0; c < 3; ++c) {
      const float value = in[file.color[static_cast<std::size_t>(c)]] * unmultiply;
      if (!std::isfinite(value)) photo.valid[i] = 0;
      negative |= value < 0;
      out[c] = std::fmax(value, 0.f);
    }
    if (!photo.valid[i]) {
      ++photo.nan_pixels;
      out[0] = out[1] = out[2] = 0;
    } else if (negative) {
      ++photo.negative_pixels;
    }
  }
}

}  // namespace

PictureInfo probe_photo(const std::string& path) { return open(path).info; }

Photo read_photo(const std::string& path, bool as_linear) {
  Opened file = open(path);
  const std::size_t size = static_cast<std::size_t>(file.spec.width) * file.spec.height;
  Photo photo;
  photo.info = file.info;
  photo.pixels.resize(3 * size);
  photo.valid.assign(size, 1);
  photo.clipped.assign(size, 0);
  if (file.alpha >= 0) photo.alpha.resize(size);
  if (file.info.is_float)
    fill_from_floats(path, file, photo);
  else if (file.info.bit_depth == 8)
    fill_from_integers<std::uint8_t>(path, file, as_linear, photo);
  else
    fill_from_integers<std::uint16_t>(path, file, as_linear, photo);
  if (photo.nan_pixels > 0)
    photo.info.warnings.push_back(std::to_string(photo.nan_pixels) +
                                  " pixels are not finite and are left out");
  if (photo.negative_pixels > 0)
    photo.info.warnings.push_back(std::to_string(photo.negative_pixels) +
                                  " pixels are below 0 and are set to 0");
  return photo;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/samples.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string_view>

#include "image/file_error.h"
#include "image/limits.h"

namespace selenite {
namespace {

constexpr std::string_view kXyze = "32-bit_rle_xyze", kRgbe = "32-bit_rle_rgbe";
constexpr const char* kAgain = "copy or export it again";

/// Radiance stores scanlines along either axis, in either direction.
template <class T>
void turn_upright(const RadianceHeader& header, Samples& samples, std::vector<T>& values) {
  if (!header.columns_first && !header.x_decreases && header.y_decreases) return;
  const std::size_t lines = static_cast<std::size_t>(samples.height);
  const std::size_t length = static_cast<std::size_t>(samples.width);
  const std::size_t channels = static_cast<std::size_t>(samples.channels);
  if (header.columns_first) std::swap(samples.width, samples.height);
  const std::size_t width = static_cast<std::size_t>(samples.width);
  const std::size_t height = static_cast<std::size_t>(samples.height);
  std::vector<T> upright(values.size());
  for (std::size_t line = 0; line < lines; ++line) {
    for (std::size_t i = 0; i < length; ++i) {
      std::size_t x = header.columns_first ? line : i, y = header.columns_first ? i : line;
      if (header.x_decreases) x = width - 1 - x;
      if (!header.y_decreases) y = height - 1 - y;
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>((line * length + i) * channels),
                  channels,
                  upright.begin() + static_cast<std::ptrdiff_t>((y * width + x) * channels));
    }
  }
  values = std::move(upright);
}

/// Less than half of the least that 16 bits tell from 0.
constexpr float kLeastAlpha = 0.5f / 65535;

/// Floats that are 0 but for rounding become 0: Cycles leaves 2e-8 where its film is transparent, and
/// a pixel with any alpha counts.
void round_alpha(const Samples& samples, std::vector<float>& values) {
  const auto channels = static_cast<std::size_t>(samples.channels);
  for (std::size_t at = static_cast<std::size_t>(samples.alpha); at < values.size(); at += channels)
    if (values[at] < kLeastAlpha) values[at] = 0;  // NaN stays
}

/// Undoes a multiplication by alpha; where alpha is 0 there is no colour to find.
template <class T>
void divide_by_alpha(const Samples& samples, std::vector<T>& values) {
  for (std::size_t at = 0; at < values.size(); at += static_cast<std::size_t>(samples.channels)) {
    T* pixel = values.data() + at;
    const T alpha = pixel[samples.alpha];
    for (int c = 0; c < (samples.grey() ? 1 : 3); ++c) {
      T& value = pixel[samples.color[static_cast<std::size_t>(c)]];
      if constexpr (std::is_floating_point_v<T>) {
        if (alpha > 0) value /= std::fmin(alpha, 1.f);
      } else if (alpha > 0) {
        constexpr std::uint64_t kTop = std::numeric_limits<T>::max();
        const std::uint64_t straight = (value * kTop + alpha / 2) / alpha;
        value = static_cast<T>(std::min(straight, kTop));
      }
    }
  }
}

}  // namespace

struct Decoder::Input {
  std::string bytes;  // of the file, where it is not read from disk
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
  std::unique_ptr<OIIO::ImageInput> file;  // closed before what it reads from
  OIIO::ImageSpec spec;
};

Decoder::~Decoder() = default;

Decoder::Decoder(const std::string& path, Contents& contents)
    : path_(path), contents_(contents), input_(std::make_unique<Input>()) {
  // By plugin name: the extension plays no part, and no other decoder sees the file.
  input_->file = OIIO::ImageInput::create(format_name(contents.format));
  if (!input_->file)
    refuse(path,
           std::string("is ") + format_name(contents.format) +
               ", which this OpenImageIO cannot read: " + OIIO::geterror(),
           "convert it to another format");
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // of TIFF and PNG: values as they are
  OIIO::ImageSpec& spec = input_->spec;
  if (contents.format == FileFormat::kHdr && contents.radiance.format == kXyze) open_as_rgbe();
  if (!input_->file->open(path, spec, config) ||
      (contents.part > 0 && !input_->file->seek_subimage(contents.part, 0, spec)))
    refuse(path, "cannot be read: " + input_->file->geterror(), kAgain);
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.deep || spec.nchannels < 1)
    refuse(path, "has no flat picture of at least 1 x 1 pixels", "export it again");
  const std::string color_space = spec.get_string_attribute("jpeg:ColorSpace");
  contents.cmyk |= color_space == "CMYK" || color_space == "YCbCrK";

  const auto base = spec.format.basetype;
  form_.is_float = spec.format.is_floating_point();
  if (!form_.is_float && base != OIIO::TypeDesc::UINT8 && base != OIIO::TypeDesc::UINT16)
    refuse(path, "stores " + std::string(spec.format.c_str()) + " numbers",
           "save it with 8 or 16 bits per channel or as float");
  form_.bit_depth = static_cast<int>(spec.format.size()) * 8;
  form_.channels = spec.nchannels;
  form_.width = spec.width;
  form_.height = spec.height;
  if (contents.format == FileFormat::kHdr && contents.radiance.columns_first)
    std::swap(form_.width, form_.height);
  if (contents.format == FileFormat::kExr) {
    form_.width = static_cast<int>(contents.exr.display.width());
    form_.height = static_cast<int>(contents.exr.display.height());
  }
  choose_channels(contents);
  form_.grey = color_[0] == color_[1];
  const std::int64_t stored = form_.is_float ? sizeof(float) : spec.format.size();
  check_size(path, spec.width, spec.height, stored * (form_.grey ? 1 : 3));
}

/// OpenImageIO unpacks RGBE only; XYZE is packed alike, and its header names it by as many letters.
void Decoder::open_as_rgbe() {
  const FileView view(path_);
  input_->bytes = view.bytes(0, view.size());
  const std::size_t at = input_->bytes.find(kXyze);
  if (at != std::string::npos) input_->bytes.replace(at, kRgbe.size(), kRgbe);
  input_->memory =
      std::make_unique<OIIO::Filesystem::IOMemReader>(input_->bytes.data(), input_->bytes.size());
  if (!input_->file->set_ioproxy(input_->memory.get()))
    refuse(path_, "is in XYZ (XYZE), which this OpenImageIO cannot read", "save it as RGBE");
}

void Decoder::choose_channels(const Contents& contents) {
  const OIIO::ImageSpec& spec = input_->spec;
  const auto index_of = [&](const std::string& name) {
    const auto found = std::find(spec.channelnames.begin(), spec.channelnames.end(), name);
    return found == spec.channelnames.end() ? -1
                                            : static_cast<int>(found - spec.channelnames.begin());
  };
  if (contents.format == FileFormat::kExr) {
    color_ = {index_of("R"), index_of("G"), index_of("B")};
    alpha_ = spec.nchannels > 1 ? index_of("A") : -1;
    if (std::min({color_[0], color_[1], color_[2]}) < 0) {
      int grey = std::max(index_of("Y"), index_of("I"));
      if (grey < 0) grey = alpha_ == 0 ? 1 : 0;
      color_ = {grey, grey, grey};
    }
    return;
  }
  const int alpha =
      contents.format == FileFormat::kTiff ? contents.alpha.value_or(-1) : spec.alpha_channel;
  const int colors = contents.format == FileFormat::kTiff ? contents.colors
                                                          : spec.nchannels - (alpha >= 0 ? 1 : 0);
  const int needed = std::max(colors, alpha + 1);
  if ((colors != 1 && colors < 3) || spec.nchannels < needed)
    refuse(
        path_,
        "has " + std::to_string(spec.nchannels) + " channels, which are neither grey nor R, G, B",
        "save it as plain RGB or RGBA");
  color_ = colors == 1 ? std::array<int, 3>{0, 0, 0} : std::array<int, 3>{0, 1, 2};
  alpha_ = alpha;
}

template <class T>
void Decoder::fill(Samples& samples) {
  int first = std::min({color_[0], color_[1], color_[2]});
  int end = std::max({color_[0], color_[1], color_[2]}) + 1;
  if (alpha_ >= 0) {
    first = std::min(first, alpha_);
    end = std::max(end, alpha_ + 1);
  }
  samples.channels = end - first;
  for (std::size_t c = 0; c < 3; ++c) samples.color[c] = color_[c] - first;
  samples.alpha = alpha_ < 0 ? -1 : alpha_ - first;
  check_size(path_, samples.width, samples.height,
             static_cast<std::int64_t>(sizeof(T)) * samples.channels);
  std::vector<T> values(static_cast<std::size_t>(samples.width) * samples.height *
                        samples.channels);
  const bool ok = input_->file->read_image(contents_.part, 0, first, end,
                                           OIIO::BaseTypeFromC<T>::value, values.data());
  // Half a JPEG reads "ok", with grey filler; the error string is the only trace.
  const std::string error = input_->file->geterror();
  if (!ok || !error.empty())
    refuse(path_, "is truncated or damaged" + (error.empty() ? "" : ": " + error), kAgain);
  if (contents_.format == FileFormat::kHdr) turn_upright(contents_.radiance, samples, values);
  if constexpr (std::is_floating_point_v<T>)
    if (samples.alpha >= 0) round_alpha(samples, values);
  if (samples.alpha >= 0 && contents_.associated_alpha) divide_by_alpha(samples, values);
  samples.values = std::move(values);
}

Samples Decoder::read() {
  Samples samples;
  samples.width = input_->spec.width;
  samples.height = input_->spec.height;
  samples.frame_width = form_.width;
  samples.frame_height = form_.height;
  if (contents_.format == FileFormat::kExr) {
    samples.x = static_cast<int>(contents_.exr.data.x0 - contents_.exr.display.x0);
    samples.y = static_cast<int>(contents_.exr.data.y0 - contents_.exr.display.y0);
  }
  if (form_.is_float)
    fill<float>(samples);
  else if (form_.bit_depth == 8)
    fill<std::uint8_t>(samples);
  else
    fill<std::uint16_t>(samples);
  return samples;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/read.h"

#include <algorithm>
#include <numeric>

#include "image/color/encoding.h"
#include "image/container.h"
#include "image/file_error.h"
#include "image/limits.h"
#include "image/photo_rows.h"
#include "image/samples.h"

namespace selenite {

std::int64_t PixelCounts::all() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::int64_t{0});
}

PictureInfo picture_info(const std::string& path, const Contents& contents, const StoredForm& form,
                         bool as_linear, ColorEncoding& encoding) {
  PictureInfo info;
  info.format = contents.format;
  info.width = form.width;
  info.height = form.height;
  info.channels = form.channels;
  info.bit_depth = form.bit_depth;
  info.is_float = form.is_float;
  info.grey = form.grey;
  info.orientation = contents.orientation;
  info.cmyk = contents.cmyk;
  info.warnings = contents.warnings;
  if (!as_linear) {
    info.color = "stored values";
    return info;
  }
  encoding = color_encoding(path, contents, form.is_float, form.grey);
  info.color = encoding.name;
  if (info.cmyk) info.warnings.emplace_back("it is CMYK; its colours are not calibrated");
  info.warnings.insert(info.warnings.end(), encoding.warnings.begin(), encoding.warnings.end());
  return info;
}

PictureInfo probe_photo(const std::string& path, bool as_linear) {
  return with_memory(path, [&] {
    Contents contents = examine(path);
    const Decoder decoder(path, contents);
    ColorEncoding encoding;
    return picture_info(path, contents, decoder.form(), as_linear, encoding);
  });
}

Photo read_photo(const std::string& path, bool as_linear) {
  return with_memory(path, [&] {
    const PictureInfo header = probe_photo(path, as_linear);
    const std::int64_t stored = header.is_float ? sizeof(float) : header.bit_depth / 8;
    constexpr std::int64_t kResult = 4 * sizeof(float) + sizeof(PixelUse);
    check_size(path, header.width, header.height, kResult + stored * std::min(header.channels, 4),
               kMostBytesAsFloats);
    const PhotoRows rows(path, as_linear);
    Photo photo;
    photo.info = rows.info();
    const std::size_t width = static_cast<std::size_t>(photo.info.width);
    const std::size_t size = width * static_cast<std::size_t>(photo.info.height);
    photo.pixels.resize(3 * size);
    photo.use.resize(size);
    std::vector<float> alpha(width);
    if (rows.has_alpha()) photo.alpha.reserve(size);
    for (int y = 0; y < photo.info.height; ++y) {
      const std::size_t first = static_cast<std::size_t>(y) * width;
      rows.convert(y, photo.pixels.data() + 3 * first, alpha.data(), photo.use.data() + first);
      if (rows.has_alpha()) photo.alpha.insert(photo.alpha.end(), alpha.begin(), alpha.end());
    }
    for (const PixelUse use : photo.use) photo.counts.add(use);
    for (std::string& text : rows.remarks(photo.counts, UnusedShares::of(photo.counts)))
      photo.info.warnings.push_back(std::move(text));
    return photo;
  });
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/photo_rows.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace selenite {
namespace {

/// Colours outside Rec. 709 have a channel below 0. As far as eight bits round a colour at the rim
/// of a wide gamut, such a channel is 0; beyond, no render in Rec. 709 can hold the colour.
constexpr float kGamutTolerance = 0.01f;  // of the largest channel

/// Noise of a camera goes below 0 once its black level is subtracted. Left out, what remains of a
/// shadow is too bright; values farther below 0 are marks or faults.
constexpr float kNoiseBelowZero = 0.02f;  // of the picture's bright level
constexpr double kBrightLevel = 0.999;    // quantile of the values above 0

/// 0 where no value is below 0: nothing shows such noise then.
float depth_of_noise(const Samples& samples) {
  const auto* values = std::get_if<std::vector<float>>(&samples.values);
  if (values == nullptr) return 0;
  const auto of_colours = [&](auto&& action) {
    for (std::size_t i = 0; i < values->size(); i += static_cast<std::size_t>(samples.channels))
      for (const int channel : samples.color)
        action((*values)[i + static_cast<std::size_t>(channel)]);
  };
  bool goes_below = false;
  of_colours([&](float value) { goes_below |= value < 0; });
  if (!goes_below) return 0;
  std::vector<float> bright;
  of_colours([&](float value) {
    if (value > 0 && std::isfinite(value)) bright.push_back(value);
  });
  if (bright.empty()) return 0;
  const auto at = bright.begin() + static_cast<std::ptrdiff_t>(
                                       kBrightLevel * static_cast<double>(bright.size() - 1));
  std::nth_element(bright.begin(), at, bright.end());
  return kNoiseBelowZero * *at;
}

/// Three digits of a number above 0, never below it.
std::string three_digits(double value) {
  const double step = std::pow(10, std::floor(std::log10(value)) - 2);
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", std::ceil(value / step - 1e-6) * step);
  return text.data();
}

}  // namespace

PhotoRows::PhotoRows(const std::string& path, bool as_linear, const Response& response)
    : as_linear_(as_linear), counted_(response.counted) {
  Contents contents = examine(path);
  Decoder decoder(path, contents);
  info_ = picture_info(path, contents, decoder.form(), as_linear, encoding_);
  if (!response.curves.empty()) {
    std::copy_n(response.curves.begin(), 3, encoding_.curves.begin());
    info_.color = "the given response";
  }
  samples_ = decoder.read();
  if (as_linear && response.finds_clipping) clipping_ = clipping_levels(samples_);
  const auto is_linear = [](const TransferCurve& curve) { return curve.linear(); };
  if (as_linear && std::all_of(encoding_.curves.begin(), encoding_.curves.end(), is_linear))
    below_zero_ = depth_of_noise(samples_);
  if (samples_.is_float()) return;
  for (CodeRange& range : counted_) range = {range.lowest * top(), range.highest * top()};
  for (std::size_t c = 0; c < 3; ++c) {
    tables_[c].reserve(static_cast<std::size_t>(top()) + 1);
    for (int i = 0; i <= top(); ++i) {
      tables_[c].push_back(decode(c, static_cast<double>(i) / top()));
      uses_[c].push_back(counted(c, i));
    }
  }
  const auto is_light = [](float value) { return std::isfinite(value) && value >= 0; };
  is_plain_ = !has_alpha() && !encoding_.has_matrix() && samples_.x == 0 && samples_.y == 0 &&
              samples_.width == info_.width && samples_.height == info_.height;
  for (const std::vector<float>& table : tables_)
    is_plain_ = is_plain_ && std::all_of(table.begin(), table.end(), is_light);
}

UnusedShares UnusedShares::of(const PixelCounts& counts) {
  const double all = std::max<double>(1, static_cast<double>(counts.all()));
  return {static_cast<double>(counts[PixelUse::kClipped]) / all,
          static_cast<double>(counts[PixelUse::kTooDark]) / all};
}

int PhotoRows::top() const {
  if (samples_.is_float()) return 1;
  return info_.bit_depth == 8 ? 255 : 65535;
}

float PhotoRows::decode(std::size_t channel, double stored) const {
  const TransferCurve& curve = encoding_.curves[channel];
  return static_cast<float>(curve.linear() ? stored : curve.decode(stored));
}

PixelUse PhotoRows::counted(std::size_t channel, double stored) const {
  const CodeRange& range = counted_[channel];
  if (stored >= clipping_[channel].from || stored > range.highest) return PixelUse::kClipped;
  return stored < range.lowest ? PixelUse::kTooDark : PixelUse::kCounts;
}

/// Of decoded values: primaries are converted, and what cannot count becomes 0.
PixelUse PhotoRows::finish(float* rgb) const {
  if (encoding_.has_matrix()) {
    const Vector3 linear = product(encoding_.to_rec709, Vector3{rgb[0], rgb[1], rgb[2]});
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<float>(linear[c]);
  }
  if (!std::isfinite(rgb[0]) || !std::isfinite(rgb[1]) || !std::isfinite(rgb[2]))
    return PixelUse::kNotFinite;
  if (!as_linear_) return PixelUse::kCounts;
  const float tolerance =
      std::max(kGamutTolerance * std::max({rgb[0], rgb[1], rgb[2]}), below_zero_);
  bool is_outside = false;
  for (std::size_t c = 0; c < 3; ++c) {
    is_outside |= rgb[c] < -tolerance;
    rgb[c] = std::fmax(rgb[c], -below_zero_);
  }
  return is_outside ? PixelUse::kOutsideGamut : PixelUse::kCounts;
}

template <class T>
void PhotoRows::look_up(const T* in, float* rgb, float* alpha, PixelUse* use) const {
  const auto [red, green, blue] = samples_.color;
  const int channels = samples_.channels;
  for (int x = 0; x < info_.width; ++x, in += channels, rgb += 3) {
    const T r = in[red], g = in[green], b = in[blue];
    rgb[0] = tables_[0][r];
    rgb[1] = tables_[1][g];
    rgb[2] = tables_[2][b];
    PixelUse found = uses_[0][r];
    if (found == PixelUse::kCounts) found = uses_[1][g];
    if (found == PixelUse::kCounts) found = uses_[2][b];
    use[x] = found;
  }
  std::fill_n(alpha, info_.width, 1.f);
}

template <class T>
void PhotoRows::convert_values(const std::vector<T>& values, int y, float* rgb, float* alpha,
                               PixelUse* use) const {
  const int row = y - samples_.y;
  if constexpr (std::is_integral_v<T>) {
    if (is_plain_)
      return look_up(values.data() + static_cast<std::size_t>(row) * samples_.width *
                                         static_cast<std::size_t>(samples_.channels),
                     rgb, alpha, use);
  }
  for (int x = 0; x < info_.width; ++x) {
    const int column = x - samples_.x;
    float* out = rgb + 3 * static_cast<std::ptrdiff_t>(x);
    out[0] = out[1] = out[2] = 0;
    alpha[x] = 1;
    if (row < 0 || row >= samples_.height || column < 0 || column >= samples_.width) {
      use[x] = PixelUse::kOutsideFile;
      continue;
    }
    const T* in = values.data() +
                  (static_cast<std::size_t>(row) * samples_.width + column) * samples_.channels;
    PixelUse found = PixelUse::kCounts;
    if (samples_.alpha >= 0) {
      const T stored = in[samples_.alpha];
      if constexpr (std::is_integral_v<T>) {
        alpha[x] = static_cast<float>(stored) / std::numeric_limits<T>::max();
      } else {
        if (!std::isfinite(stored)) found = PixelUse::kNotFinite;
        alpha[x] = std::isfinite(stored) ? std::clamp(stored, 0.f, 1.f) : 0.f;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const T stored = in[samples_.color[c]];
      if constexpr (std::is_integral_v<T>) {
        out[c] = tables_[c][stored];
      } else {
        if (!std::isfinite(stored))
          found = PixelUse::kNotFinite;
        else if (stored < -below_zero_ && found != PixelUse::kNotFinite)
          found = PixelUse::kNegative;
        else if (stored > encoding_.curves[c].highest && found == PixelUse::kCounts)
          found = PixelUse::kClipped;
        out[c] = std::isfinite(stored) && stored >= -below_zero_ ? decode(c, stored) : 0;
      }
      if (found == PixelUse::kCounts) found = counted(c, static_cast<double>(stored));
    }
    if (found != PixelUse::kNotFinite) {
      const PixelUse finished = finish(out);
      if (found == PixelUse::kCounts || finished == PixelUse::kNotFinite) found = finished;
    }
    if (found == PixelUse::kNotFinite)
      out[0] = out[1] = out[2] = 0;
    else if (alpha[x] == 0)
      found = PixelUse::kCounts;  // with no weight: what is hidden there is nothing to tell
    use[x] = found;
  }
}

void PhotoRows::convert(int y, float* rgb, float* alpha, PixelUse* use) const {
  std::visit([&](const auto& values) { convert_values(values, y, rgb, alpha, use); },
             samples_.values);
}

std::string PhotoRows::clipped() const {
  constexpr std::array kChannels{"red", "green", "blue"};
  const double first = clipping_[0].from;
  if (std::isfinite(first) && clipping_[1].from == first && clipping_[2].from == first)
    return "clipped (from " + three_digits(first / top()) + ")";
  std::string levels;
  for (std::size_t c = 0; c < 3; ++c)
    if (std::isfinite(clipping_[c].from))
      levels += (levels.empty() ? "" : ", ") + std::string(kChannels[c]) + " " +
                three_digits(clipping_[c].from / top());
  return levels.empty() ? "clipped" : "clipped (from " + levels + ")";
}

std::string PhotoRows::clipping_cure() const {
  const auto has_level = [](const ClippingLevel& level) { return std::isfinite(level.from); };
  if (std::none_of(clipping_.begin(), clipping_.end(), has_level)) return "";
  const bool is_guessed = std::any_of(clipping_.begin(), clipping_.end(),
                                      [](const auto& level) { return level.is_guessed; });
  if (!is_guessed) return "; give the photo less exposure";
  double highest = 0;
  for (const ClippingLevel& level : clipping_) highest = std::max(highest, level.maximum);
  return "; if nothing is cut off there, let all count: 'clip' [0, " +
         three_digits(highest / top()) + "] in the captures or Clip Levels in the panel";
}

std::vector<std::string> PhotoRows::remarks(const PixelCounts& counts,
                                            const UnusedShares& unused) const {
  std::vector<std::string> warnings;
  const auto add = [&](PixelUse use, const std::string& what) {
    const std::int64_t count = counts[use];
    if (count > 0)
      warnings.push_back(std::to_string(count) + " of its pixels " + (count == 1 ? "is " : "are ") +
                         what + " and left out");
  };
  add(PixelUse::kNotFinite, "not finite (NaN or infinite)");
  add(PixelUse::kNegative, "below 0");
  add(PixelUse::kOutsideGamut, "outside the colours of Rec. 709, in which Cycles renders,");
  const auto add_share = [&](double share, const std::string& what, const std::string& cure) {
    constexpr double kWorthSaying = 0.001;
    if (!(share > kWorthSaying)) return;
    std::array<char, 32> percent{};
    std::snprintf(percent.data(), percent.size(), "%.1f%%", 100 * share);
    warnings.push_back(std::string(percent.data()) + " of its pixels are " + what +
                       " and do not count" + cure);
  };
  add_share(unused.clipped, clipped(), clipping_cure());
  add_share(unused.too_dark, "darker than what counts", "");
  if (std::any_of(clipping_.begin(), clipping_.end(),
                  [](const ClippingLevel& level) { return level.is_even_white; }))
    warnings.emplace_back(
        "its largest value is 1.0, in even areas with hard edges; they count: "
        "mask them if they are overexposed");
  return warnings;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "image/container.h"

namespace selenite {

/// Stored values of a picture, upright, with straight colours (not multiplied by alpha).
struct Samples {
  using Values =
      std::variant<std::vector<std::uint8_t>, std::vector<std::uint16_t>, std::vector<float>>;

  Values values{};  ///< (height, width, channels)
  int width = 0, height = 0, channels = 0;
  std::array<int, 3> color{};  ///< channels of red, green, blue; a grey picture repeats its one
  int alpha = -1;
  /// The frame that the camera took, and where its first pixel lies in it
  int frame_width = 0, frame_height = 0, x = 0, y = 0;

  bool grey() const { return color[0] == color[1]; }
  bool is_float() const { return std::holds_alternative<std::vector<float>>(values); }
};

/// What a decoder says of a picture before its pixels are read.
struct StoredForm {
  int width = 0, height = 0;  ///< of the frame, upright
  int channels = 0;           ///< in the file
  int bit_depth = 0;          ///< of a channel
  bool is_float = false, grey = false;
};

/// Opens the picture with OpenImageIO. Throws FileError for what it cannot decode.
class Decoder {
 public:
  Decoder(const std::string& path, Contents& contents);
  ~Decoder();
  const StoredForm& form() const { return form_; }
  /// Throws FileError when the file is truncated or damaged.
  Samples read();

 private:
  void open_as_rgbe();
  void choose_channels(const Contents& contents);
  template <class T>
  void fill(Samples& samples);

  struct Input;
  std::string path_;
  const Contents& contents_;
  std::unique_ptr<Input> input_;
  StoredForm form_;
  std::array<int, 3> color_{};
  int alpha_ = -1;
};

}  // namespace selenite

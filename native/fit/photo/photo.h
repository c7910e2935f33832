// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fit/photo/camera_alignment.h"
#include "render/driver/render.h"
#include "render/film/film.h"
#include "scene/lights/light_state.h"
#include "scene/parameter_table.h"
#include "scene/scene.h"

namespace selenite {

/// The parameters of a photo that can be fitted. They are applied to what was rendered: a render does
/// not know of them.
struct PhotoParameters {
  Color<double> gain{1, 1, 1};

  template <class Self, class Visit>
  static constexpr void fields(Self& p, Visit&& visit) {
    visit(Parameter{.name = "gain",
                    .sockets = "",
                    .unit = "1",
                    .lower = 0.001,
                    .upper = 1000,
                    .fit_lower = 0.1,
                    .fit_upper = 10,
                    .initial = 1,
                    .scale = Scale::kLog,
                    .effect = Effect::kEmission,
                    .help = "Factor on what the camera renders for this photo, linear Rec. 709: "
                            "exposure and white balance"},
          p.gain);
  }
};
const ParameterTable& photo_parameter_table();

/// What a fit may find of a photo's gain by itself, in closed form, beside `PhotoParameters`.
enum class GainFreedom { kNone, kScalar, kRgb };

/// A photo at working size. Several photos may be of one camera: under different light, say.
///
/// What differs from photo to photo has its place here: a gain, the alignment of its camera, which
/// lamps were on. `resized` carries it along and `fingerprint` includes
/// it; no other function copies or identifies a photo.
struct Photo {
  std::string id;  ///< unique in a fit; `check_photos` sets an empty one to the camera's name
  std::string camera;
  int width = 0, height = 0;
  PhotoFrame frame;           ///< of the photo before it was brought to working size
  Picture reference;          ///< linear radiance, row 0 at the top
  std::vector<float> weight;  ///< per pixel, >= 0; 0 = background, clipped or not a number
  /// Share of each pixel that its masks say shows the object whose vertices are fitted; empty: nobody
  /// says.
  std::vector<float> coverage{};
  PhotoParameters values{};                       ///< what is not unknown of them
  GainFreedom gain_freedom = GainFreedom::kNone;  ///< of a factor on `values.gain`
  Alignment alignment{};                          ///< of its camera, in pixels of this size
  bool align = false;   ///< whether a fit finds a small one, from `alignment` on
  LightState lights{};  ///< which were on, and where

  /// What is rendered of it; null: all.
  std::shared_ptr<const PixelMask> pixels;

  /// The camera from which it was taken. UnknownName: no such camera.
  Camera camera_in(const Scene& scene) const {
    return alignment.apply(scene.camera(camera), width, height, frame);
  }
  std::size_t size() const { return reference.size(); }
  /// Weight of a pixel and channel: with it a weighted sum over pixels and channels is a mean.
  double share(std::size_t pixel) const { return weight[pixel] / (3 * total_weight); }
  /// The photo with at most `longest` pixels along its longer side; itself where it is no larger.
  /// A pixel is the mean over those it covers. It has weight 0 where one of them has, since a
  /// render of it shows them all.
  Photo resized(int longest) const;
  /// Hash of what a fit compares with: id, camera, size, frame, parameters, lights, and every pixel
  /// and weight.
  std::uint64_t fingerprint() const;

  double total_weight = 0;  ///< sum of `weight`, set by `check_photos`
  bool is_small = false;    ///< made by `resized`
};

/// A photo of which only camera and size are known: black.
Photo photo_of_size(const std::string& camera, int width, int height);

/// Sets empty ids and empty weights (to 1), and pixels of weight 0 to black, so that no NaN can
/// leak. Reports all problems at once: InvalidArgument (sizes, NaN or infinite photo pixels,
/// negative or all-zero weights, parameters out of range, an id given twice), UnknownName (no such camera or lamp).
void check_photos(const Scene& scene, std::vector<Photo>& photos);
/// The same for one photo, whatever its camera: InvalidArgument.
void check_photo(Photo& photo);

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <variant>
#include <vector>

#include "render/driver/progress.h"
#include "render/film/film.h"
#include "render/film/render_settings.h"
#include "scene/scene.h"

namespace selenite {

/// How a loss depends on the mean image I of one pixel: its slope d loss / d I, and the curvature
/// that meets the covariance of I with its derivative (see LossResult).
struct PixelSlope {
  Colorf slope, curvature;
};
/// Called once for each pixel when its samples are done, from any thread: may read that pixel of the
/// film and nothing else of it.
using PixelLoss = std::function<PixelSlope(std::size_t pixel, const Film& film)>;

/// The mean over the pixels of (I - reference)^2, each channel for itself.
PixelLoss squared_error(const Picture& reference);
/// The mean of the picture, each channel for itself, with a weight for each pixel.
/// InvalidArgument: a weight is negative or not finite, or their sum is 0.
PixelLoss mean_of_pixels(std::vector<float> weights);

/// A field of unknowns: the grid, the image of a surface or of the world, or the colours of a mesh.
using Field =
    std::variant<const PlacedGrid*, const Texture*, const EnvironmentMap*, const VertexColors*>;

/// A picture, and the derivative of a loss by every value of some fields.
struct FieldGradient {
  /// Where a single image is unknown it has a slot: the derivative by a shift of all that is looked
  /// up in the image (decoded).
  Film film;
  /// Each as long as its grid's `values`, or three numbers a texel, pixel, vertex or corner, one where
  /// the image gives a number; row 0 at the top.
  std::vector<std::vector<double>> fields;
};

/// Renders, and differentiates a loss with respect to every voxel of the grids, every texel of the
/// images and every colour of the meshes in `unknown`, in the same pass: each path leaves a tape, which is swept back when its pixel's
/// residual is known. The cost does not depend on their number, and the memory of a pass only by one
/// number for each.
///
/// For a squared loss this is the unbiased form over all pairs of different samples of a pixel:
/// sample i weighs slope / n - curvature (I_i - I) / (n (n - 1)). Detached sampling, as `render`.
/// Equal settings give equal bytes whatever the number of threads. No `loss`: the picture alone,
/// from the same samples. Throws Cancelled, InvalidArgument (no such field, one twice).
FieldGradient render_field_gradient(const Scene& scene, const Camera& camera,
                                    const std::vector<FieldRef>& unknown,
                                    const RenderSettings& settings, const PixelLoss& loss,
                                    Progress* progress = nullptr);

/// A row for each square cell of pixels, row by row of the picture; a column for each number of a
/// field.
using CellJacobian = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The derivative, channel by channel, of a cell by a colour of a field or by a number that acts on all channels.
struct PlaceSlope {
  std::uint32_t place;
  Colorf slope;
};
/// The same as a `CellJacobian` where a cell depends on few places: for each cell those that its paths
/// have met.
using PlaceSlopes = std::vector<std::vector<PlaceSlope>>;

/// A picture, and the derivatives of weighted sums over its cells by every value of some fields, each
/// channel for itself.
struct FieldJacobian {
  Film film;
  std::vector<CellJacobian> fields{};  ///< without columns for the images of surfaces
  std::vector<PlaceSlopes> places{};   ///< of those images; empty for other fields
};

inline int cells_along(int pixels, int cell) { return (pixels + cell - 1) / cell; }

/// As above, with one `weights` a pixel and cells of `cell` pixels a side, which divides 16. The memory
/// is cells times numbers, and of images that of the places that are met. Throws as above, and InvalidArgument for weights and cells that do not fit.
FieldJacobian render_field_jacobian(const Scene& scene, const Camera& camera,
                                    const std::vector<FieldRef>& unknown,
                                    const RenderSettings& settings,
                                    const std::vector<float>& weights, int cell,
                                    Progress* progress = nullptr);

}  // namespace selenite

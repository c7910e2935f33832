// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fit/photo/photo.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/settings.h"
#include "fit/shape/mesh_smoothing.h"
#include "fit/state/fit_result.h"
#include "render/shape/shape_gradient.h"

namespace selenite {

/// The vertices of an object as unknowns.
struct UnknownVertices {
  std::string object;
  /// No vertex leaves the bounding box of the start with its ends moved by so many of its sizes.
  double minimum = -0.5, maximum = 0.5;
  /// Length of the largest step in the coordinates of the descent, in diagonals of that box.
  double learning_rate = 0.01;
  /// lambda of MeshSmoothing for each vertex: the same part of the surface moves together, however
  /// fine the mesh is.
  double smoothness = 0.01;
};

/// One row of its history: the state before step `iteration`.
struct ShapeRow {
  int iteration = 0;
  double loss = 0;  ///< mean over the photos, without the bias of noise where the loss has none
  Color<double> mean_bias;
  Vec3d centre;  ///< mean of the vertices, in the object's space
};

/// What a descent has found.
struct ShapeResult {
  VertexMatrix best, last;  ///< vertices in the object's own space, as its mesh has them
  std::vector<ShapeRow> history;
  int iterations = 0, best_iteration = 0;
  double best_loss = 0;           ///< NaN: none yet
  std::vector<double> residuals;  ///< root mean square of render minus photo, of each photo
  double cpu_seconds = 0;
  std::int64_t samples = 0;
};

/// Moves the vertices of an object until renders match photos: descent with large steps, in which all
/// vertices share one second moment, and whose length falls to a twentieth. A step that would turn a
/// face over is shortened.
///
/// Source: Nicolet, Jacobson, Jakob 2021, "Large Steps in Inverse Rendering of Geometry".
class ShapeFit {
 public:
  /// All problems at once: InvalidArgument, UnknownName.
  ShapeFit(Scene scene, std::vector<Photo> photos, UnknownVertices unknown, FitSettings settings);

  /// One iteration over all photos; false when the fit is over. A cancelled one changes nothing.
  bool step(Progress* progress = nullptr);
  /// See Fit.
  std::string saved();
  void restore(std::string_view saved);

  /// So far.
  ShapeResult result() const;
  const std::vector<std::shared_ptr<const Picture>>& previews() const { return previews_; }
  const std::vector<Photo>& photos() const { return photos_; }
  const UnknownVertices& unknown() const { return unknown_; }
  const FitSettings& settings() const { return settings_; }
  StopReason stopped() const { return stopped_; }
  /// Ends it.
  void stop(StopReason reason) { stopped_ = reason; }

 private:
  void check() const;
  void members(SavedState& state);
  /// Loss of a photo at the present vertices; adds its gradient where there is to be one.
  double evaluate(const Scene& scene, std::size_t photo, VertexMatrix* gradient,
                  Color<double>& bias, Progress* progress);
  /// Goes along `direction`, in coordinates of the descent, as far as no face turns over.
  void move(const VertexMatrix& direction);
  /// Of each face twice its area along its normal, and its cosine to the smoothed surface.
  struct Faces {
    std::vector<Vec3d> doubled;
    std::vector<double> cosine;
  };
  Faces faces_of(const VertexMatrix& positions) const;
  /// Whether one is turned over on the way from `faces_` to these.
  bool turns_over(const Faces& faces) const;
  VertexMatrix object_positions(const VertexMatrix& world) const;

  Scene scene_;
  std::vector<Photo> photos_;
  UnknownVertices unknown_;
  FitSettings settings_;
  int instance_;
  std::unique_ptr<VertexNormals> normals_;
  std::unique_ptr<MeshSmoothing> smoothing_;
  std::array<double, 3> low_{}, high_{};  ///< that no vertex leaves
  double size_ = 0;                       ///< diagonal of the box at the start

  VertexMatrix positions_, best_, coordinates_;
  VertexMatrix mean_, squares_;  ///< moments of the gradient
  Faces faces_;
  int iteration_ = 0, best_iteration_ = 0;
  double best_loss_ = 0, cpu_seconds_ = 0;
  std::int64_t samples_ = 0;
  StopReason stopped_ = StopReason::kNone;
  std::vector<ShapeRow> history_;
  std::vector<double> residuals_;
  std::vector<std::shared_ptr<const Picture>> previews_;
};

}  // namespace selenite

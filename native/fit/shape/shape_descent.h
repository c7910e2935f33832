// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "fit/shape/face_guard.h"
#include "fit/shape/mesh_smoothing.h"
#include "fit/shape/vertex_moments.h"
#include "fit/state/phase.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "ShapeDescentOptions".
struct ShapeDescentOptions {
  /// Of the two moments. One rare bright path may not shorten the steps for the rest of the fit.
  double first_decay = 0.9, second_decay = 0.99;
  double last_step = 0.05;  ///< what is left of a step's length at the end
  int halvings = 6;         ///< of a step, and of a vertex's way, before it is given up
  /// lambda of MeshSmoothing for each vertex: the same part of the surface moves together, however
  /// fine the mesh is.
  double smoothness = 0.01;
  /// In root mean squares of the photo or the first picture, whichever is larger: a brighter pixel
  /// counts by the square of this over its brightness. Else a highlight outweighs all outlines.
  double bright = 1;
  /// Of the squared error of the outline, where masks say it, beside that of the picture, in mean
  /// squares of the photo or the first picture, whichever is larger.
  double outline = 1;
};

/// Moves the vertices of an object until renders match photos: descent with large steps, in which all
/// vertices share one second moment, and none goes farther than the length of a step. Vertices
/// whose faces would turn over or go through another surface are held back. Where photos are
/// explained worse than before, the best vertices are taken again, with shorter steps.
///
/// Source: Nicolet, Jacobson, Jakob 2021, "Large Steps in Inverse Rendering of Geometry".
class ShapeDescent final : public Phase {
 public:
  explicit ShapeDescent(const FitRun& run, ShapeDescentOptions options = {});
  ShapeDescent(const ShapeDescent&) = delete;
  ShapeDescent& operator=(const ShapeDescent&) = delete;

  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kShape; }
  bool step(FitRun& run) override;
  double fraction() const override;
  void members(SavedState& state) override;

 private:
  /// The loss at the present vertices and its gradient, as a row of the history.
  HistoryRow observe(FitRun& run, VertexMatrix& gradient);
  /// The slope of the loss in a photo, with less of what is bright there or in the picture.
  void dim_highlights(std::size_t photo, const Picture& shown, Picture& slope) const;
  /// Adds the gradient by the outline in a photo, where its masks say what it should be.
  void observe_outline(FitRun& run, const Scene& here, std::size_t photo, const Evaluation& how,
                       VertexMatrix& gradient) const;
  /// Whether the present vertices explain the photos worse than the best ones.
  bool validate(FitRun& run, HistoryRow& row);
  bool finish(FitRun& run);
  void return_to_best();
  /// Along the smoothed gradient, as far as no face turns over.
  void move(const VertexMatrix& gradient, ShapeSteps& steps);
  /// Vertices of faces that turn over or go through others go less far, or stay.
  void hold_back(VertexMatrix& there, bool& turned, bool& crossed) const;
  Scene scene() const;
  /// In the object's own space, as a field holds them.
  Vector own_positions() const;

  const FitProblem* problem_;
  ShapeDescentOptions options_;
  Scene start_;
  MovableVertices vertices_;
  bool with_image_;  ///< lies on the surface, and slides with the vertices
  MeshSmoothing smoothing_;
  FaceGuard guard_;
  std::array<double, 3> low_{}, high_{};  ///< that no vertex leaves
  double size_ = 0;                       ///< diagonal of the box at the start

  VertexMatrix positions_, coordinates_, best_;
  VertexMoments moments_;
  std::vector<double> brightness_;  ///< mean square, of each photo or its first picture
  double share_ = 1;                ///< of a step that is taken
  int done_ = 0;
};

}  // namespace selenite

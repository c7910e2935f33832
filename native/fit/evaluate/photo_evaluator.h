// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "fit/evaluate/field_loss.h"
#include "fit/evaluate/photo_question.h"
#include "fit/objective/alignment.h"
#include "fit/photo/photo_render.h"
#include "fit/problem/fit_problem.h"
#include "fit/problem/point.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/field_gradient.h"
#include "render/shape/coverage.h"
#include "render/shape/shape_gradient.h"

namespace selenite {

/// What a photo shows at a point. Phases know this interface; a test answers with a film of its own.
class Evaluator {
 public:
  virtual ~Evaluator() = default;
  /// The picture and, where asked for, the derivative pictures of `Problem::layout`.
  /// Throws Cancelled, InvalidArgument.
  virtual Film evaluate(const Point& point, const Photo& photo, const Evaluation& how) = 0;
  /// Says what `evaluate` will soon be asked for: workers may render it meanwhile. The answer is the same
  /// without.
  virtual void expect(const Point&, const Photo&, const Evaluation&) {}
  /// How many pictures it wants to know of beforehand.
  virtual int ahead() const { return 0; }
};

/// Tells an evaluator what a loop will ask for, some pictures ahead.
class Ahead {
 public:
  /// The loop has come to picture `at` of `count`; expect(i) says what picture i is.
  template <class Expect>
  void reach(const Evaluator& evaluator, std::size_t at, std::size_t count, const Expect& expect) {
    if (evaluator.ahead() == 0) return;
    const std::size_t end = std::min(count, at + static_cast<std::size_t>(evaluator.ahead()));
    for (next_ = std::max(next_, at); next_ < end; ++next_) expect(next_);
  }

 private:
  std::size_t next_ = 0;  ///< that has not been told
};

/// The vertices of an object that move, and how its shading normals follow.
struct MovableVertices {
  int instance;
  VertexNormals normals;
};

/// The scene behind the photos, as a function of the point.
struct SceneModel {
  const Problem& problem;
  const Reparametrization* differences;  ///< null: derivatives are carried along all paths
  std::function<Scene(const Point&)> scene_at;
  bool of_workers = true;  ///< workers know it, from scene and unknowns
};
SceneModel scene_model(const FitProblem& problem);
SceneModel scene_model(const FitProblem& problem, const UniformFields& uniform);

/// The only place where a fit renders.
class PhotoEvaluator final : public Evaluator {
 public:
  /// `settings` and `counts` must outlive it.
  PhotoEvaluator(SceneModel model, const FitSettings& settings, RenderCounts& counts)
      : model_(std::move(model)), settings_(&settings), counts_(&counts) {}

  /// What it remembers of the photos.
  void members(SavedState& state) { state(gains_, alignments_, aims_, aim_verdicts_); }

  /// Renders from now on report to `progress` and can be cancelled through it; null: neither.
  void watch(Progress* progress) { progress_ = progress; }
  Progress* progress() const { return progress_; }

  Film evaluate(const Point& point, const Photo& photo, const Evaluation& how) override;
  void expect(const Point& point, const Photo& photo, const Evaluation& how) override;
  int ahead() const override;
  /// What a worker renders, without the gain of the photo. InvalidArgument: no photo has the id.
  Film answer(const PhotoQuestion& question);
  /// The free gain of a photo, as the last render of it gives; 1 before the first.
  Colorf found_gain(const Photo& photo) const;
  /// With which the next render of a photo is made, whatever its size.
  Alignment alignment(const Photo& photo) const;
  /// Goes on from what another one has found.
  void take_alignments(const PhotoEvaluator& other) { alignments_ = other.alignments_; }
  /// Picture, and the derivative of the loss by every value of the fields.
  FieldGradient field_gradient(const Point& point, const Photo& photo, const Fields& fields,
                               FilmLoss loss, const Evaluation& how);
  /// Picture, and the derivatives of weighted means over cells of pixels by every value of the fields.
  FieldJacobian field_jacobian(const Point& point, const Photo& photo, const Fields& fields,
                               const std::vector<float>& weights, int cell, const Evaluation& how);
  /// Picture, and the derivative of its loss by vertices, from other samples. `scene`: that of the
  /// point, with the vertices where they are; `loss`: of the picture with the photo's gain.
  ShapeGradient shape_gradient(const Scene& scene, const MovableVertices& vertices,
                               const Point& point, const Photo& photo, const PictureLoss& loss,
                               const Evaluation& how);
  /// Likewise of where the photo shows the object, over all of its pixels.
  CoverageGradient coverage_gradient(const Scene& scene, const MovableVertices& vertices,
                                     const Photo& photo, const CoverageLoss& loss,
                                     const Evaluation& how);

 private:
  /// What the photo shows. At which lamps paths aim is decided at the first point that is asked for.
  Scene scene_of(const Photo& photo, const Point& point);
  Scene lit_for(const Photo& photo, const Scene& of_point);
  RenderSettings settings_of(const Photo& photo, int spp, std::uint64_t seed) const;
  Colorf gain_of(const Photo& photo, const Point& point) const;
  void find_gain(const Photo& photo, const Film& film);
  void find_alignment(const Photo& photo, const Film& film);
  Camera camera_of(const Scene& scene, const Photo& photo) const;
  /// Without the gain of the photo.
  Film rendered(const Point& point, const Photo& photo, const Evaluation& how);
  /// The same by workers.
  Film fetched(const Point& point, const Photo& photo, const Evaluation& how);
  RenderWorkers* workers() const { return model_.of_workers ? settings_->workers.get() : nullptr; }
  /// In samples, roughly.
  double work_of(const Photo& photo, const Evaluation& how) const;
  PhotoQuestion question(const Point& point, const Photo& photo, const Evaluation& how);
  /// `direct`: paths end at the first surface.
  Film picture(Scene scene, const Photo& photo, const SlotLayout& layout, int spp,
               std::uint64_t seed, bool direct = false);

  /// Questions that nobody has asked for yet, with their numbers.
  struct Expected {
    std::shared_ptr<RenderWorkers> workers{};
    std::deque<std::pair<std::string, std::int64_t>> questions{};
    Expected() = default;
    Expected(const Expected&) = delete;
    Expected& operator=(const Expected&) = delete;
    ~Expected();
    void forget_oldest();
  };
  struct FoundAlignment {
    AlignmentEstimate estimate{};
    int width = 0;  ///< of the photo of which it is
    void members(SavedState& state) { state(estimate, width); }
  };

  SceneModel model_;
  const FitSettings* settings_;
  RenderCounts* counts_;
  Progress* progress_ = nullptr;
  std::map<std::string, Colorf> gains_{};               ///< by the id of a photo
  std::map<std::string, FoundAlignment> alignments_{};  ///< likewise
  std::map<std::string, std::vector<char>> aims_{};     ///< likewise, of each lamp
  std::vector<AimVerdict> aim_verdicts_{};
  Expected expected_;
};

}  // namespace selenite

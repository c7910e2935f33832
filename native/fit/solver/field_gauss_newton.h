// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "fit/photo/photo.h"
#include "fit/problem/fields.h"
#include "fit/problem/settings.h"
#include "fit/solver/bounded_influence.h"
#include "fit/solver/cell_matrix.h"
#include "fit/solver/field_numbers.h"
#include "fit/solver/field_prior.h"
#include "fit/solver/instrumental_variables.h"
#include "render/driver/field_gradient.h"

namespace selenite {

class SavedState;

/// Sources: docs/measurements/constants.md, "FieldGaussNewtonOptions".
struct FieldGaussNewtonOptions {
  int cell = 8, large_cell = 16;  ///< pixels along a cell; the large one where memory is short
  /// Of a grid, where larger cells are fewer than its voxels: photos of few pixels.
  int finest_cell = 2;
  double most_entries = 1 << 26;  ///< of the Jacobians: 256 MiB
  /// The same where the world's image is unknown: its light shows in detail, as shadows and highlights.
  int environment_cell = 2;
  double most_fine_entries = 1 << 23;      ///< of cells below `cell`
  std::ptrdiff_t most_numbers = 3 * 2048;  ///< of the fields: their normal matrices are dense
  /// Of images: texels, as they are solved for all at once, and cells.
  std::ptrdiff_t most_texels = 1 << 16, most_image_cells = 1 << 17;
  /// Of a cell's largest derivative by a texel: smaller ones join those of their group of texels, of
  /// which there are so many along each side of an image.
  float least_share = 0.1f;
  int groups = 4;
  int variance_rounds =
      2;  ///< of the variance of residuals, which depends on the prior's part in them
  /// Random vectors that measure how many residuals texels take up: at first, and where the standard error of
  /// these is a larger share of what is left.
  int first_probes = 3, probes = 8;
  double trace_error = 0.04;
  double probe_tolerance = 1e-2;  ///< of the solutions for them and for the residual beside them
  double most_leverage = 0.9;     ///< share of a residual that texels may take up
  double jacobian_kept =
      0.9;  ///< share of a Jacobian that each iteration keeps: it changes with voxels
  /// Share of the residuals that each iteration keeps where images of numbers are alone: earlier ones
  /// have moved as if pictures followed these linearly.
  double numbers_kept = 0.9;
  FieldPriorOptions prior{};
  /// In units of the strength of a voxel that shows; they go from one to the other geometrically.
  double first_damping = 3e-3, last_damping = 3e-4;
  BoundedInfluenceOptions influence{};  ///< of cells on numbers
  int blocks = 10;                      ///< along a photo's longer side, as of `GainPriorOptions`
  double environment_damping = 1e-5;    ///< light is linear: far steps are as good as near ones
  int active_set_rounds = 8;
  bool by_agreement = true;  ///< see `FitSettings::prior`

  static FieldGaussNewtonOptions of(const FitSettings& settings) {
    return {.by_agreement = settings.by_agreement()};
  }
};

/// Gauss-Newton for fields, for `JointGaussNewton`: the voxels of albedo grids, images of colours and
/// numbers, the world's image. A voxel stands for each of them in what follows.
///
/// Scattered light is smooth: means over cells of pixels hold nearly all that photos know of voxels. So
/// the Jacobian of the cells by all voxels is small enough to be kept. It is gathered over iterations, as
/// the instruments of `GaussNewton` are. Adam goes by the product of one iteration's noisy derivatives
/// and residuals, which hides the effect of hundreds of voxels.
///
/// Voxels and scalars can make up for each other. The instruments of the scalars are therefore made
/// orthogonal to the Jacobian of the voxels (partial regression: Frisch and Waugh 1933, Econometrica 1).
/// The equations that they make are those of the joint normal matrix with the fields eliminated, and
/// hold wherever the voxels are. The voxels take their own step and what a step of the scalars implies.
/// A channel has normal equations of its own, unless a number acts on all channels (`FieldNumbers`).
///
/// Before any photo a voxel of a grid lies within a standard deviation of its first value. A pixel of the
/// world's image lies near its neighbours. Voxels that a step would take beyond their bounds are pinned
/// there, and the others make up for that (active sets).
class FieldGaussNewton {
 public:
  /// Whether the fields are albedo grids of colours, the world's image, or images of colours and numbers.
  /// Numbers and photos must not be too many.
  static bool applies(const Fields& fields, const std::vector<Photo>& photos,
                      const FieldGaussNewtonOptions& options = {}) {
    return cell_size(fields, photos, options) > 0;
  }
  /// Null where it does not apply.
  static std::unique_ptr<FieldGaussNewton> of(const Fields& fields,
                                              const std::vector<Photo>& photos,
                                              const FieldGaussNewtonOptions& options = {});

  int cell() const { return cell_; }  ///< pixels along a side of it
  bool has_environment() const { return prior_.has_environment(); }
  bool has_images() const { return groups_ != nullptr; }
  /// Of images that act on all channels, such as a roughness. Pictures follow these less linearly than colours.
  bool has_numbers() const { return has_images() && systems_.front().part.channels > 1; }
  /// Of each pixel of photo i in its cell.
  const std::vector<float>& shares(std::size_t i) const { return views_[i].share; }

  /// Goes on from these values, at which no residual has been seen. The first ones are the prior's.
  void set_values(const FieldValues& values);
  /// Adds the residuals of photo i at the current values; of those before, the share `keep` stays.
  /// `weight` of the residuals, 3 numbers a pixel; `samples` in units of those of an iteration.
  void add_residual(std::size_t i, const Halves& seen, const Eigen::VectorXf& weight, double keep,
                    double samples = 1);
  /// Derivatives join the sums; `samples` as above.
  void gather(std::size_t i, const FieldJacobian& derivatives, double samples = 1);

  /// Makes the normal equations; `done`: share of the iterations, as damping falls.
  void solve(double done);
  /// The instruments of the scalars for a photo.
  struct Regressors {
    InstrumentalVariables::Set* whole;
    const Eigen::VectorXf* weight;                            ///< of the residuals
    const InstrumentalVariables::Set* informative = nullptr;  ///< those of some pixels; null: none
    const Eigen::VectorXf* informative_weight = nullptr;
    /// Takes, for images, by how much errors exceed residuals: texels take up a part of these; null: nobody.
    Eigen::VectorXf* widening = nullptr;
  };
  /// Takes from the instruments of all whole photos what the voxels explain of these and of the
  /// informative ones, by the last `solve`: their equations together then depend on no voxel. Keeps the
  /// slopes of the whole photos for `advance`. Returns the covariance that remains in the equations of
  /// the scalars because of voxels that hardly show, by the prior of these.
  Eigen::MatrixXd eliminate_fields(const std::vector<Regressors>& z);
  /// Steps the voxels, where the scalars move by du (in `Reparametrization`).
  void advance(const Eigen::VectorXd& du);
  const FieldValues& values() const { return values_; }
  /// By which the prior counted in the last `solve`, of green where channels have their own equations: the
  /// variance of a residual of weight 1.
  double prior_strength() const { return systems_[systems_.size() / 2].variance; }
  /// Share of the squared residuals of the last `solve` that fields could still explain; 0 but for images.
  double pattern_left() const;

  void members(SavedState& state);

 private:
  FieldGaussNewton(const Fields& fields, const std::vector<Photo>& photos,
                   const FieldGaussNewtonOptions& options);
  /// 0: it does not apply.
  static int cell_size(const Fields& fields, const std::vector<Photo>& photos,
                       const FieldGaussNewtonOptions& options);

  struct View {
    int width = 0, height = 0;
    std::vector<float> share;
    std::vector<Eigen::Index> cells;  ///< those with a pixel that counts: the rows of what follows
    std::vector<Eigen::Index> rows;   ///< of each cell, -1: it does not count
    CellJacobian jacobian;            ///< mean over iterations, all numbers of all fields
    PlaceSlopes near{};               ///< of images in its place: the largest of each cell
    Eigen::MatrixXf far{};            ///< and the rest, three columns a group of places
    double gathered = 0;              ///< iterations in it
    Eigen::MatrixXf residual, variance, weight;  ///< of the cells, a column a channel; of the mean
    double seen = 0;                             ///< iterations in `residual`, by their samples
    Eigen::MatrixXf slopes;  ///< by the scalars; rows are cells, channel by channel
    void members(SavedState& state);
  };
  /// Equations that are solved together.
  struct System {
    FieldNumbers::Part part;
    std::vector<Eigen::VectorXf> roots{};  ///< of the weights, of each photo
    /// Times the roots of the weights, of all photos.
    std::shared_ptr<const CellMatrix> jacobian = std::make_shared<const CellMatrix>();
    NormalMatrix normal{};
    double variance = 0;  ///< of a residual of weight 1, by which the prior's precision counts
    Eigen::VectorXd descent{};  ///< right side of the equations of the voxels at fixed scalars
    /// Variance of a residual of weight 1: of all of them, and of what texels cannot explain.
    double whole = 0, remaining = 0;
  };
  /// Sums over cells: (cells * 3, columns), channel by channel.
  template <class Pixels>
  Eigen::MatrixXf of_cells(const View& view, const Pixels& pixels) const;
  /// For one half and one system, by the sums over cells of all channels. Returns the regression of the
  /// scalars on the voxels.
  Eigen::MatrixXd eliminate_from_half(const std::vector<Regressors>& z,
                                      InstrumentalVariables::Half InstrumentalVariables::Set::*half,
                                      const FieldNumbers::Part& part,
                                      const std::vector<Eigen::MatrixXf>& sums,
                                      const std::vector<CellMatrix>& jacobians,
                                      const NormalMatrix& solver) const;
  /// Of the residuals of a system; see `Regressors::widening`.
  void widen(const CellMatrix& jacobian, const NormalMatrix& normal, const FieldNumbers::Part& part,
             const std::vector<Regressors>& z) const;
  /// The rows and columns of a system.
  CellMatrix jacobian_of(const View& view, const FieldNumbers::Part& part) const;
  /// Roots of the weights of a photo's rows in a system.
  Eigen::VectorXf roots_of(const View& view, const System& system,
                           const CellMatrix& jacobian) const;
  /// Of each number of a system: by the strength of those of its field that show.
  Eigen::VectorXd damping_of(const System& system, double done) const;
  void gather_places(View& view, const std::vector<PlaceSlopes>& places, float fresh) const;
  /// Random ones, a column a probe.
  static Eigen::MatrixXf signs(Eigen::Index rows, int probes);
  /// Of each row, the share of its residual that texels take up.
  Eigen::VectorXf leverage(const CellMatrix& jacobian, const NormalMatrix& normal) const;
  /// Variance of a residual of weight 1 by what remains beside texels that follow the photos: what several
  /// photos of a texel agree on is none.
  double remaining_variance(const CellMatrix& jacobian, const NormalMatrix& normal,
                            const Eigen::VectorXf& residual) const;
  /// Of J^T r for residuals of weight 1, times ||J||^2: the trace of its covariance.
  double variance_of_blocks(const Eigen::MatrixXf& jacobian, const Eigen::VectorXf& residual) const;
  /// The row of a pixel's cell, -1: it has none.
  Eigen::Index row_of(const View& view, std::size_t pixel) const;
  /// The step of a system's numbers along `right`, from `low` to `high`.
  Eigen::VectorXd bounded_step(const System& system, const Eigen::VectorXd& right,
                               const Eigen::VectorXd& low, const Eigen::VectorXd& high) const;

  FieldGaussNewtonOptions options_;
  int cell_;
  FieldNumbers numbers_;
  Eigen::VectorXd minimum_, maximum_;  ///< of all numbers
  FieldValues values_;
  FieldPrior prior_;
  std::vector<View> views_;
  std::vector<System> systems_;
  /// Of places and of the numbers of a system; null: no image is unknown.
  std::shared_ptr<const CellMatrix::Groups> place_groups_, groups_;
  std::vector<std::size_t> group_places_;  ///< one of each group of places
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "fit/problem/photo.h"
#include "fit/problem/fields.h"
#include "fit/solver/instrumental_variables.h"
#include "render/driver/field_gradient.h"

namespace selenite {

class SavedState;

/// Gauss-Newton for the voxels of albedo grids, together with the scalars beside them.
///
/// Light that has been scattered is smooth: means over cells of pixels say nearly all that photos know
/// of voxels. So the Jacobian of the cells by all voxels is small enough to be kept. It is gathered over
/// iterations, as the instruments of `GaussNewton` are, since the product of one iteration's noisy
/// derivatives and residuals, which Adam goes by, hides what hundreds of voxels do.
///
/// Voxels and scalars can stand in for each other. The scalars' instruments are therefore made
/// orthogonal to the Jacobian of the voxels (partial regression: Frisch and Waugh 1933, Econometrica 1):
/// the equations that they make are those of the joint normal matrix with the voxels eliminated, and
/// hold wherever the voxels are. The voxels follow: their own step, and what a step of the scalars takes
/// along. The normal equations of a channel are those of its own voxels. Before anything is seen, a
/// voxel is where the search left it to within a standard deviation.
class FieldGaussNewton {
 public:
  /// Null where the fields are other than albedo grids of colours, or numbers and photos too many.
  static bool applies(const Fields& fields, const std::vector<Photo>& photos);
  static std::unique_ptr<FieldGaussNewton> of(const Fields& fields,
                                         const std::vector<Photo>& photos);

  int cell() const { return cell_; }
  /// Of the pixels of photo i in their cells.
  const std::vector<float>& shares(std::size_t i) const { return views_[i].share; }

  /// Stands at these values, which no residual has been seen at. The first ones are the prior's.
  void set_values(const FieldValues& values);
  /// A render of photo i at the current values, of which a share of what was seen before is kept;
  /// `weight` is that of its numbers.
  void add_residual(std::size_t i, const Halves& seen, const Eigen::VectorXf& weight, double keep);
  /// Derivatives join the sums.
  void gather(std::size_t i, const FieldJacobian& derivatives);

  /// Makes the normal equations; `done`: share of the iterations, as damping falls.
  void solve(double done);
  /// The scalars' instruments for a photo.
  struct Regressors {
    InstrumentalVariables::Set* whole;
    const Eigen::VectorXf* weight;             ///< of the numbers of the photo
    const InstrumentalVariables::Set* informative = nullptr;  ///< more of them, on some pixels, if there are
    const Eigen::VectorXf* informative_weight = nullptr;
  };
  /// Takes from those for whole photos, all of them, what voxels can imitate of these and of those on
  /// some pixels, by the last `solve`: what both say together is then none of the voxels. Keeps the
  /// slopes of the whole ones for `advance`. Returns the covariance that the scalars' equations are
  /// left with because of voxels that hardly show, by what was known of these before any photo.
  Eigen::MatrixXd eliminate_fields(const std::vector<Regressors>& z);
  /// The voxels go where they should if the scalars move by du (in `Reparametrization`).
  void advance(const Eigen::VectorXd& du);
  const FieldValues& values() const { return values_; }

  void members(SavedState& state);

 private:
  FieldGaussNewton(const Fields& fields, const std::vector<Photo>& photos, int cell);

  struct View {
    int width = 0, height = 0;
    std::vector<float> share;
    CellJacobian jacobian;  ///< mean over iterations, all numbers of all fields
    double gathered = 0;    ///< iterations in it
    Eigen::MatrixXf residual, variance, weight;  ///< of the cells, a column a channel
    double seen = 0;                             ///< iterations in `residual`
    Eigen::MatrixXf slopes;  ///< by the scalars; rows are cells, channel by channel
    void members(SavedState& state);
  };
  struct Channel {
    Eigen::MatrixXf jacobian;  ///< times the roots of the weights, all photos'
    Eigen::LLT<Eigen::MatrixXd> normal;
    double prior = 0;     ///< on the diagonal of `normal`, beside the damping
    Eigen::VectorXd way;  ///< of the voxels at fixed scalars
  };
  /// Sums over cells: (cells * 3, columns), channel by channel.
  template <class Pixels>
  Eigen::MatrixXf of_cells(const View& view, const Pixels& pixels) const;
  /// Of one half and channel c, by the sums over cells of all channels; returns what voxels are like
  /// the scalars.
  Eigen::MatrixXd eliminate_fields(const std::vector<Regressors>& z,
                           InstrumentalVariables::Half InstrumentalVariables::Set::*half, int c,
                           const std::vector<Eigen::MatrixXf>& sums,
                           const Eigen::LLT<Eigen::MatrixXd>& solver) const;
  Eigen::Index cell_of(const View& view, std::size_t pixel) const;

  int cell_;
  Eigen::VectorXd minimum_, maximum_;  ///< of all numbers
  FieldValues values_;
  Eigen::VectorXd prior_;
  std::vector<View> views_;
  std::array<Channel, 3> channels_;
};

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

namespace selenite {

/// Derivatives of cells of pixels by the numbers of a part of `FieldNumbers`: dense, or sparse with a
/// coarse rest.
///
/// A cell sees few texels directly, and all others a little by light between surfaces. `near` holds
/// the texels that it sees most. `far` holds sums over groups of texels, as if the texels of a group
/// had equal parts in what a cell sees of the group beyond `near`.
class CellMatrix {
 public:
  using Sparse = Eigen::SparseMatrix<float, Eigen::RowMajor>;
  /// Of each column its group, and the size of each group.
  struct Groups {
    std::vector<int> of;
    std::vector<float> share;  ///< of each group: 1 / size
  };

  CellMatrix() = default;
  explicit CellMatrix(Eigen::MatrixXf dense) : dense_(std::move(dense)) {}
  CellMatrix(Sparse near, Eigen::MatrixXf far, std::shared_ptr<const Groups> groups)
      : near_(std::move(near)), far_(std::move(far)), groups_(std::move(groups)) {}

  bool is_sparse() const { return groups_ != nullptr; }
  Eigen::Index rows() const { return is_sparse() ? near_.rows() : dense_.rows(); }
  Eigen::Index cols() const { return is_sparse() ? near_.cols() : dense_.cols(); }
  const Eigen::MatrixXf& dense() const { return dense_; }
  const Sparse& near() const { return near_; }

  /// This matrix times `x`, and its transpose times `y`.
  Eigen::MatrixXf times(const Eigen::MatrixXf& x) const;
  Eigen::MatrixXf transposed_times(const Eigen::MatrixXf& y) const;
  /// Squared lengths of the rows and of the columns.
  Eigen::VectorXf squared_rows() const;
  Eigen::VectorXd squared_columns() const;
  /// Each row times a number.
  CellMatrix scaled(const Eigen::VectorXf& factors) const;
  /// All rows of several matrices with the same columns.
  static CellMatrix stacked(const std::vector<CellMatrix>& parts);

 private:
  /// Sums over groups, times the shares, and back.
  Eigen::MatrixXf of_groups(const Eigen::MatrixXf& x) const;

  Eigen::MatrixXf dense_;
  Sparse near_;
  Eigen::MatrixXf far_;
  std::shared_ptr<const Groups> groups_;
};

/// What is known of such numbers beforehand: the inverse of their covariance. Dense, or
/// `sparse` less `level` * `level`^T.
struct Precision {
  Eigen::MatrixXd dense;
  Eigen::SparseMatrix<double> sparse;
  Eigen::MatrixXd level;  ///< columns of directions that are free, beside `sparse`

  Eigen::MatrixXd times(const Eigen::MatrixXd& x) const;
};

/// J^T J + strength * precision + damping, symmetric and positive definite.
///
/// A dense one is decomposed. A sparse one is solved by conjugate gradients, preconditioned by the
/// incomplete Cholesky decomposition of the part that joins neighbours. Sources: Saad 2003, Iterative Methods
/// for Sparse Linear Systems, chapter 9; Lin and More 1999, SIAM Journal on Scientific Computing 21.
class NormalMatrix {
 public:
  NormalMatrix() = default;
  explicit NormalMatrix(std::shared_ptr<const CellMatrix> jacobian);
  /// Of J^T J alone.
  const Eigen::VectorXd& diagonal() const { return diagonal_; }
  double trace() const { return diagonal_.sum(); }
  /// Ends the sum. `like`: of another strength, whose preconditioner is taken if that is near; null: none.
  void add(double strength, std::shared_ptr<const Precision> precision,
           const Eigen::VectorXd& damping, const NormalMatrix* like = nullptr);
  /// tolerance: of a sparse sum, of the length of the remainder in the preconditioner's norm.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right, double tolerance = 1e-4) const;
  /// The sum, where it is dense.
  const Eigen::MatrixXd& dense() const { return dense_; }

 private:
  using Sparse = Eigen::SparseMatrix<double>;
  using Preconditioner =
      Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>>;
  Eigen::MatrixXd times(const Eigen::MatrixXd& x) const;
  Eigen::MatrixXd conjugate_gradients(const Eigen::MatrixXd& right, double tolerance) const;

  std::shared_ptr<const CellMatrix> jacobian_;
  Eigen::VectorXd diagonal_;
  Eigen::MatrixXd dense_;
  std::shared_ptr<const Eigen::LLT<Eigen::MatrixXd>> decomposed_;
  double strength_ = 0;
  Eigen::VectorXd damping_;
  std::shared_ptr<const Precision> precision_;
  std::shared_ptr<const Preconditioner> preconditioner_;
};

}  // namespace selenite

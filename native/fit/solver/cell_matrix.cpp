// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/cell_matrix.h"

#include <algorithm>
#include <cmath>

#include "math/scalar.h"

namespace selenite {
namespace {

/// Of the diagonal of an incomplete factor, where it breaks down: columns of the scaled matrix have a length
/// of at most 1, so a few doublings make every factor definite.
constexpr double kSafeShift = 1;

/// J^T J, whole.
Eigen::MatrixXd gram(const Eigen::MatrixXf& jacobian) {
  Eigen::MatrixXf sum = Eigen::MatrixXf::Zero(jacobian.cols(), jacobian.cols());
  sum.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
  sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
  return sum.cast<double>();
}

/// Of `precision` its entries, and of the sparse part of J^T J those in the same places. The others join
/// the diagonal by their size: the sum stays positive definite, and its decomposition sparse.
Eigen::SparseMatrix<double> neighbours(const CellMatrix::Sparse& near, double strength,
                                       const Eigen::SparseMatrix<double>& precision) {
  Eigen::SparseMatrix<double> sum = strength * precision;
  const auto entry = [&](Eigen::Index row, Eigen::Index column) -> double* {
    const auto* const begin = sum.innerIndexPtr() + sum.outerIndexPtr()[column];
    const auto* const end = sum.innerIndexPtr() + sum.outerIndexPtr()[column + 1];
    const auto* const found = std::lower_bound(begin, end, row);
    return found == end || *found != row ? nullptr : sum.valuePtr() + (found - sum.innerIndexPtr());
  };
  for (Eigen::Index p = 0; p < near.rows(); ++p)
    for (CellMatrix::Sparse::InnerIterator a(near, p); a; ++a)
      for (CellMatrix::Sparse::InnerIterator b(near, p); b; ++b) {
        const double product = static_cast<double>(a.value()) * b.value();
        if (double* const at = entry(a.col(), b.col()))
          *at += product;
        else
          *entry(a.col(), a.col()) += std::abs(product);
      }
  return sum;
}

}  // namespace

Eigen::MatrixXf CellMatrix::of_groups(const Eigen::MatrixXf& x) const {
  Eigen::MatrixXf sums = Eigen::MatrixXf::Zero(far_.cols(), x.cols());
  for (Eigen::Index q = 0; q < x.rows(); ++q)
    sums.row(groups_->of[static_cast<std::size_t>(q)]) += x.row(q);
  for (Eigen::Index g = 0; g < sums.rows(); ++g)
    sums.row(g) *= groups_->share[static_cast<std::size_t>(g)];
  return sums;
}

Eigen::MatrixXf CellMatrix::times(const Eigen::MatrixXf& x) const {
  if (!is_sparse()) return dense_ * x;
  Eigen::MatrixXf product = near_ * x;
  product.noalias() += far_ * of_groups(x);
  return product;
}

Eigen::MatrixXf CellMatrix::transposed_times(const Eigen::MatrixXf& y) const {
  if (!is_sparse()) return dense_.transpose() * y;
  Eigen::MatrixXf product = near_.transpose() * y;
  const Eigen::MatrixXf sums = far_.transpose() * y;
  for (Eigen::Index q = 0; q < product.rows(); ++q) {
    const int group = groups_->of[static_cast<std::size_t>(q)];
    product.row(q) += groups_->share[static_cast<std::size_t>(group)] * sums.row(group);
  }
  return product;
}

Eigen::VectorXf CellMatrix::squared_rows() const {
  if (!is_sparse()) return dense_.rowwise().squaredNorm();
  Eigen::VectorXf sums(rows());
  for (Eigen::Index p = 0; p < rows(); ++p) {
    float sum = 0;
    for (std::size_t g = 0; g < groups_->share.size(); ++g)
      sum += far_(p, static_cast<Eigen::Index>(g)) * far_(p, static_cast<Eigen::Index>(g)) *
             groups_->share[g];
    for (Sparse::InnerIterator one(near_, p); one; ++one) {
      const int group = groups_->of[static_cast<std::size_t>(one.col())];
      sum += one.value() *
             (one.value() + 2 * far_(p, group) * groups_->share[static_cast<std::size_t>(group)]);
    }
    sums[p] = sum;
  }
  return sums;
}

Eigen::VectorXd CellMatrix::squared_columns() const {
  if (!is_sparse()) return dense_.cast<double>().colwise().squaredNorm();
  const Eigen::VectorXd of_far = far_.cast<double>().colwise().squaredNorm();
  Eigen::VectorXd sums(cols());
  for (Eigen::Index q = 0; q < cols(); ++q) {
    const auto group = static_cast<std::size_t>(groups_->of[static_cast<std::size_t>(q)]);
    const double share = groups_->share[group];
    sums[q] = of_far[static_cast<Eigen::Index>(group)] * share * share;
  }
  for (Eigen::Index p = 0; p < rows(); ++p)
    for (Sparse::InnerIterator one(near_, p); one; ++one) {
      const int group = groups_->of[static_cast<std::size_t>(one.col())];
      sums[one.col()] += static_cast<double>(
          one.value() *
          (one.value() + 2 * far_(p, group) * groups_->share[static_cast<std::size_t>(group)]));
    }
  return sums;
}

CellMatrix CellMatrix::scaled(const Eigen::VectorXf& factors) const {
  if (!is_sparse()) return CellMatrix(factors.asDiagonal() * dense_);
  return {factors.asDiagonal() * near_, factors.asDiagonal() * far_, groups_};
}

CellMatrix CellMatrix::stacked(const std::vector<CellMatrix>& parts) {
  Eigen::Index rows = 0, at = 0;
  for (const CellMatrix& one : parts) rows += one.rows();
  const CellMatrix& first = parts.front();
  if (!first.is_sparse()) {
    Eigen::MatrixXf all(rows, first.cols());
    for (const CellMatrix& one : parts) {
      all.middleRows(at, one.rows()) = one.dense_;
      at += one.rows();
    }
    return CellMatrix(std::move(all));
  }
  Eigen::MatrixXf far(rows, first.far_.cols());
  Sparse near(rows, first.cols());
  Eigen::Index count = 0;
  for (const CellMatrix& one : parts) count += one.near_.nonZeros();
  near.reserve(count);
  for (const CellMatrix& one : parts) {
    far.middleRows(at, one.rows()) = one.far_;
    for (Eigen::Index p = 0; p < one.rows(); ++p, ++at) {
      near.startVec(at);
      for (Sparse::InnerIterator it(one.near_, p); it; ++it)
        near.insertBack(at, it.col()) = it.value();
    }
  }
  near.finalize();
  return {std::move(near), std::move(far), first.groups_};
}

Eigen::MatrixXd Precision::times(const Eigen::MatrixXd& x) const {
  if (sparse.cols() == 0) return dense * x;
  Eigen::MatrixXd product = sparse * x;
  product.noalias() -= level * (level.transpose() * x);
  return product;
}

NormalMatrix::NormalMatrix(std::shared_ptr<const CellMatrix> jacobian)
    : jacobian_(std::move(jacobian)) {
  if (jacobian_->is_sparse()) {
    diagonal_ = jacobian_->squared_columns();
  } else {
    dense_ = gram(jacobian_->dense());
    diagonal_ = dense_.diagonal();
  }
}

void NormalMatrix::add(double strength, std::shared_ptr<const Precision> precision,
                       const Eigen::VectorXd& damping, const NormalMatrix* like) {
  strength_ = strength;
  damping_ = damping;
  precision_ = std::move(precision);
  if (!jacobian_->is_sparse()) {
    dense_ += strength * precision_->dense;
    dense_.diagonal() += damping;
    decomposed_ = std::make_shared<const Eigen::LLT<Eigen::MatrixXd>>(dense_);
    return;
  }
  constexpr double kNear = 4;
  if (like && strength < kNear * like->strength_ && like->strength_ < kNear * strength) {
    preconditioner_ = like->preconditioner_;
    return;
  }
  Sparse sum = neighbours(jacobian_->near(), strength, precision_->sparse);
  for (Eigen::Index q = 0; q < sum.cols(); ++q) sum.coeffRef(q, q) += damping[q];
  auto preconditioner = std::make_shared<Preconditioner>();
  preconditioner->compute(sum);
  if (preconditioner->info() != Eigen::Success) {  // its own small shifts are not enough
    preconditioner->setInitialShift(kSafeShift);
    preconditioner->compute(sum);
  }
  preconditioner_ = std::move(preconditioner);
}

Eigen::MatrixXd NormalMatrix::times(const Eigen::MatrixXd& x) const {
  Eigen::MatrixXd product =
      jacobian_->transposed_times(jacobian_->times(x.cast<float>())).cast<double>();
  product += strength_ * precision_->times(x);
  product += damping_.asDiagonal() * x;
  return product;
}

Eigen::MatrixXd NormalMatrix::solve(const Eigen::MatrixXd& right, double tolerance) const {
  return decomposed_ ? Eigen::MatrixXd(decomposed_->solve(right))
                     : conjugate_gradients(right, tolerance);
}

/// All columns at once, each with its own lengths.
Eigen::MatrixXd NormalMatrix::conjugate_gradients(const Eigen::MatrixXd& right,
                                                  double tolerance) const {
  constexpr int kMost = 100;
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(right.rows(), right.cols()), rest = right;
  Eigen::MatrixXd ahead = preconditioner_->solve(rest), way = ahead;
  Eigen::ArrayXd product = rest.cwiseProduct(ahead).colwise().sum().transpose();
  const Eigen::ArrayXd enough = square(tolerance) * product;
  for (int i = 0; i < kMost && (product > enough).any(); ++i) {
    const Eigen::MatrixXd mapped = times(way);
    const Eigen::ArrayXd along = way.cwiseProduct(mapped).colwise().sum().transpose();
    const Eigen::VectorXd length = (along > 0).select(product / along, 0);
    x += way * length.asDiagonal();
    rest -= mapped * length.asDiagonal();
    ahead = preconditioner_->solve(rest);
    const Eigen::ArrayXd next = rest.cwiseProduct(ahead).colwise().sum().transpose();
    const Eigen::VectorXd turn = (product > 0).select(next / product, 0);
    way = ahead + way * turn.asDiagonal();
    product = next;
  }
  return x;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/cell_matrix.h"

#include <gtest/gtest.h>

#include <random>

#include "math/draws.h"

namespace selenite {
namespace {

constexpr Eigen::Index kRows = 150, kSide = 8, kColumns = kSide * kSide;
constexpr int kGroups = 4;

std::shared_ptr<const CellMatrix::Groups> quarters() {
  auto groups = std::make_shared<CellMatrix::Groups>();
  groups->share.assign(kGroups, 1.0f * kGroups / kColumns);
  for (Eigen::Index q = 0; q < kColumns; ++q)
    groups->of.push_back(static_cast<int>(q / kSide / (kSide / 2) * 2 + q % kSide / (kSide / 2)));
  return groups;
}

/// Cells that see four neighbours and one texel far away, and a little of all groups.
struct Example {
  CellMatrix sparse;
  Eigen::MatrixXf dense = Eigen::MatrixXf::Zero(kRows, kColumns);
  std::mt19937 random{4};
  Normal<float> normal;

  Example() {
    const auto groups = quarters();
    CellMatrix::Sparse near(kRows, kColumns);
    std::uniform_real_distribution<double> uniform(0, kColumns - kSide - 1);
    const auto any = [&] { return static_cast<Eigen::Index>(uniform(random)); };
    for (Eigen::Index p = 0; p < kRows; ++p) {
      const Eigen::Index first = any();
      for (const Eigen::Index q : {first, first + 1, first + kSide, first + kSide + 1, any()})
        near.coeffRef(p, q) += 1 + normal(random);
    }
    near.makeCompressed();
    const Eigen::MatrixXf far =
        Eigen::MatrixXf::NullaryExpr(kRows, kGroups, [&](auto...) { return normal(random); });
    dense = Eigen::MatrixXf(near);
    for (Eigen::Index q = 0; q < kColumns; ++q) {
      const auto group = static_cast<std::size_t>(groups->of[static_cast<std::size_t>(q)]);
      dense.col(q) += groups->share[group] * far.col(static_cast<Eigen::Index>(group));
    }
    sparse = CellMatrix(near, far, groups);
  }
  Eigen::MatrixXf any(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXf::NullaryExpr(rows, columns, [&](auto...) { return normal(random); });
  }
};

/// Differences of neighbours and an even deviation, whose mean is free.
std::shared_ptr<const Precision> smooth() {
  auto precision = std::make_shared<Precision>();
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index q = 0; q < kColumns; ++q) {
    entries.emplace_back(q, q, 3);
    const auto join = [&](Eigen::Index other) {
      entries.emplace_back(q, q, 1);
      entries.emplace_back(other, other, 1);
      entries.emplace_back(q, other, -1);
      entries.emplace_back(other, q, -1);
    };
    if (q % kSide + 1 < kSide) join(q + 1);
    if (q + kSide < kColumns) join(q + kSide);
  }
  precision->sparse.resize(kColumns, kColumns);
  precision->sparse.setFromTriplets(entries.begin(), entries.end());
  precision->level = Eigen::MatrixXd::Constant(kColumns, 1, std::sqrt(3.0 / kColumns));
  return precision;
}

TEST(CellMatrix, ASparseOneIsTheSameAsItsDenseSum) {
  Example one;
  const Eigen::MatrixXf x = one.any(kColumns, 3), y = one.any(kRows, 2);
  EXPECT_LT((one.sparse.times(x) - one.dense * x).norm(), 1e-4);
  EXPECT_LT((one.sparse.transposed_times(y) - one.dense.transpose() * y).norm(), 1e-4);
  EXPECT_LT((one.sparse.squared_rows() - one.dense.rowwise().squaredNorm()).norm(), 1e-4);
  EXPECT_LT(
      (one.sparse.squared_columns() - one.dense.cast<double>().colwise().squaredNorm().transpose())
          .norm(),
      1e-3);
}

TEST(CellMatrix, ScaledAndStackedRowsAreThoseOfTheDenseSum) {
  Example one;
  const Eigen::VectorXf factors = one.any(kRows, 1), x = one.any(kColumns, 1);
  const CellMatrix both = CellMatrix::stacked({one.sparse, one.sparse.scaled(factors)});
  ASSERT_EQ(both.rows(), 2 * kRows);
  const Eigen::VectorXf product = both.times(x), plain = one.dense * x;
  EXPECT_LT((product.head(kRows) - plain).norm(), 1e-4);
  EXPECT_LT((product.tail(kRows) - factors.cwiseProduct(plain)).norm(), 1e-4);
}

TEST(NormalMatrix, ASparseOneIsSolvedAsADenseOne) {
  Example one;
  NormalMatrix sparse(std::make_shared<const CellMatrix>(one.sparse));
  NormalMatrix dense(std::make_shared<const CellMatrix>(one.dense));
  EXPECT_NEAR(sparse.trace(), dense.trace(), 1e-5 * dense.trace());
  const auto precision = smooth();
  auto whole = std::make_shared<Precision>();
  whole->dense =
      Eigen::MatrixXd(precision->sparse) - precision->level * precision->level.transpose();
  const Eigen::VectorXd damping = Eigen::VectorXd::LinSpaced(kColumns, 0.01, 0.03);
  sparse.add(0.2, precision, damping);
  dense.add(0.2, whole, damping);
  const Eigen::MatrixXd right = one.any(kColumns, 3).cast<double>();
  const Eigen::MatrixXd wanted = dense.solve(right);
  EXPECT_LT((sparse.solve(right) - wanted).norm(), 1e-3 * wanted.norm());
}

/// An incomplete factor leaves entries out, and what remains need not be definite.
TEST(NormalMatrix, IsSolvedWhereItsIncompleteFactorBreaksDown) {
  constexpr Eigen::Index kNumbers = 60, kCells = 20;
  constexpr int kSeen = 12;
  std::mt19937 random{1};
  Normal<float> normal;
  std::uniform_real_distribution<double> place(0, kNumbers);
  auto groups = std::make_shared<CellMatrix::Groups>();
  groups->of.assign(kNumbers, 0);
  groups->share = {1.0f / kNumbers};
  const Eigen::MatrixXf far = Eigen::MatrixXf::Zero(kCells, 1);
  auto precision = std::make_shared<Precision>();
  precision->dense = Eigen::MatrixXd::Identity(kNumbers, kNumbers);
  precision->level = Eigen::MatrixXd::Zero(kNumbers, 1);
  const Eigen::VectorXd damping = Eigen::VectorXd::Zero(kNumbers);
  for (int example = 0; example < 100; ++example) {
    CellMatrix::Sparse near(kCells, kNumbers);
    for (Eigen::Index p = 0; p < kCells; ++p)
      for (int k = 0; k < kSeen; ++k)
        near.coeffRef(p, static_cast<Eigen::Index>(place(random))) += normal(random);
    near.makeCompressed();
    // All that a cell joins has an entry, and the others have none.
    precision->sparse = (near.transpose() * near).cast<double>() * 0.0;
    for (Eigen::Index q = 0; q < kNumbers; ++q) precision->sparse.coeffRef(q, q) = 1;
    NormalMatrix sparse(std::make_shared<const CellMatrix>(near, far, groups));
    NormalMatrix dense(std::make_shared<const CellMatrix>(Eigen::MatrixXf(near)));
    sparse.add(0.01, precision, damping);
    dense.add(0.01, precision, damping);
    const Eigen::MatrixXd right = Eigen::MatrixXd::Ones(kNumbers, 1);
    const Eigen::MatrixXd wanted = dense.solve(right);
    EXPECT_LT((sparse.solve(right) - wanted).norm(), 1e-2 * wanted.norm()) << example;
  }
}

/// The prior says nothing of it.
TEST(Precision, TheMeanOfAnImageIsFree) {
  const auto precision = smooth();
  EXPECT_LT(precision->times(Eigen::VectorXd::Ones(kColumns)).norm(), 1e-9);
  Eigen::VectorXd uneven = Eigen::VectorXd::Zero(kColumns);
  uneven[3] = 1;
  EXPECT_GT(uneven.dot(precision->times(uneven).col(0)), 1);
}

}  // namespace
}  // namespace selenite

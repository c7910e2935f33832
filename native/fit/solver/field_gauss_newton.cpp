// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/field_gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "fit/objective/pixel_blocks.h"
#include "fit/problem/pixel_weights.h"
#include "fit/problem/saved_state.h"
#include "math/rng.h"
#include "math/scalar.h"

namespace selenite {
namespace {

/// Texels of all images in squares, so many along each side of an image. `kinds`: numbers or places of a texel.
std::shared_ptr<const CellMatrix::Groups> groups_of(const FieldNumbers& numbers, int along,
                                                    int FieldNumbers::Lattice::*kinds) {
  auto groups = std::make_shared<CellMatrix::Groups>();
  for (const FieldNumbers::Lattice& image : numbers.lattices()) {
    const auto first = static_cast<int>(groups->share.size());
    const int count = image.*kinds;
    groups->share.resize(groups->share.size() + static_cast<std::size_t>(along * along * count));
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int k = 0; k < count; ++k) {
          const int square = y * along / image.height * along + x * along / image.width;
          groups->of.push_back(first + square * count + k);
          ++groups->share[static_cast<std::size_t>(groups->of.back())];
        }
  }
  for (float& one : groups->share)
    if (one > 0) one = 1 / one;
  return groups;
}

/// Which cells of a photo have a pixel that counts, row by row.
std::vector<char> counted_cells(const Photo& photo, int cell) {
  const int columns = cells_along(photo.width, cell);
  std::vector<char> counted(static_cast<std::size_t>(columns) * cells_along(photo.height, cell), 0);
  for (std::size_t p = 0; p < photo.size(); ++p)
    if (photo.weight[p] > 0) {
      const int x = static_cast<int>(p) % photo.width, y = static_cast<int>(p) / photo.width;
      counted[static_cast<std::size_t>(y / cell * columns + x / cell)] = 1;
    }
  return counted;
}

/// A residual counts by how much its cell depends on fields: the noise of a bright background is none of theirs.
double variance_of(const Eigen::VectorXf& residual, const Eigen::VectorXf& strength) {
  const double all = strength.cast<double>().dot((residual.array() != 0).cast<double>().matrix());
  return all > 0 ? strength.cast<double>().dot(residual.cast<double>().cwiseAbs2()) / all : 0;
}

/// Three of each, as the numbers of pixels lie.
Eigen::ArrayXf of_numbers(const std::vector<float>& pixels) {
  const Eigen::Map<const Eigen::VectorXf> all(pixels.data(),
                                              static_cast<Eigen::Index>(pixels.size()));
  return all.replicate(1, 3).transpose().reshaped();
}

}  // namespace

std::unique_ptr<FieldGaussNewton> FieldGaussNewton::of(const Fields& fields,
                                                       const std::vector<Photo>& photos,
                                                       const FieldGaussNewtonOptions& options) {
  if (!applies(fields, photos, options)) return nullptr;
  return std::unique_ptr<FieldGaussNewton>(new FieldGaussNewton(fields, photos, options));
}

int FieldGaussNewton::cell_size(const Fields& fields, const std::vector<Photo>& photos,
                                const FieldGaussNewtonOptions& options) {
  std::ptrdiff_t numbers = 0, images = 0;
  bool environment = false;
  for (std::size_t f = 0; f < fields.refs().size(); ++f) {
    const auto* grid = std::get_if<GridRef>(&fields.refs()[f]);
    const bool image = fields.image(f) != nullptr;
    environment = environment || fields.is_environment(f);
    if (!fields.is_environment(f) && !image &&
        (!grid || grid->kind != GridKind::kAlbedo || fields.channels(f) != 3))
      return 0;
    images += image;
    numbers += fields.start()[f].size();
  }
  if (images > 0 && images < std::ssize(fields.refs())) return 0;
  if (numbers == 0 || (images == 0 && numbers > options.most_numbers)) return 0;
  const auto cells = [&](int cell) {
    std::ptrdiff_t sum = 0;
    for (const Photo& photo : photos) sum += std::ranges::count(counted_cells(photo, cell), 1);
    return sum;
  };
  if (images > 0) {
    for (int cell = 1; cell <= options.large_cell; cell *= 2)
      if (cells(cell) <= options.most_image_cells) return cell;
    return 0;
  }
  int finest = options.cell;
  if (environment) finest = options.environment_cell;
  while (!environment && finest > options.finest_cell && 3 * cells(finest) < numbers) finest /= 2;
  for (int cell = finest; cell <= options.large_cell; cell *= 2) {
    const double most = cell < options.cell ? options.most_fine_entries : options.most_entries;
    if (static_cast<double>(cells(cell)) * static_cast<double>(numbers) <= most) return cell;
  }
  return 0;
}

FieldGaussNewton::FieldGaussNewton(const Fields& fields, const std::vector<Photo>& photos,
                                   const FieldGaussNewtonOptions& options)
    : options_(options),
      cell_(cell_size(fields, photos, options)),
      numbers_(fields, options.most_texels),
      prior_(fields, numbers_, options.prior) {
  for (const FieldNumbers::Part& part : numbers_.parts()) systems_.push_back({part});
  if (fields.image(0)) {
    place_groups_ = groups_of(numbers_, options.groups, &FieldNumbers::Lattice::places);
    groups_ = groups_of(numbers_, options.groups, &FieldNumbers::Lattice::columns);
    group_places_.resize(place_groups_->share.size());
    for (std::size_t place = 0; place < place_groups_->of.size(); ++place)
      group_places_[static_cast<std::size_t>(place_groups_->of[place])] = place;
  }
  minimum_.resize(numbers_.size());
  maximum_.resize(numbers_.size());
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < numbers_.lattices().size(); ++f) {
    const Eigen::Index count = numbers_.lattices()[f].count;
    minimum_.segment(at, count).setConstant(fields.wanted()[f].minimum);
    maximum_.segment(at, count).setConstant(fields.wanted()[f].maximum);
    at += count;
  }
  for (const Photo& photo : photos) {
    View view;
    view.width = photo.width;
    view.height = photo.height;
    for (const char counts : counted_cells(photo, cell_)) {
      view.rows.push_back(counts ? static_cast<Eigen::Index>(view.cells.size()) : -1);
      if (counts) view.cells.push_back(static_cast<Eigen::Index>(view.rows.size()) - 1);
    }
    const Eigen::VectorXf relative = relative_weights(photo, photos.size());
    Eigen::VectorXf sums = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(view.cells.size()));
    for (std::size_t p = 0; p < photo.size(); ++p) {
      view.share.push_back(relative.segment<3>(static_cast<Eigen::Index>(3 * p)).mean());
      if (const Eigen::Index row = row_of(view, p); row >= 0) sums[row] += view.share.back();
    }
    for (std::size_t p = 0; p < photo.size(); ++p)
      if (view.share[p] > 0) view.share[p] /= sums[row_of(view, p)];
    const Eigen::Index cells = sums.size();
    view.jacobian = CellJacobian::Zero(cells, has_images() ? 0 : minimum_.size());
    if (has_images()) {
      view.near.resize(static_cast<std::size_t>(cells));
      view.far = Eigen::MatrixXf::Zero(cells, 3 * std::ssize(place_groups_->share));
    }
    view.residual = view.variance = view.weight = Eigen::MatrixXf::Zero(cells, 3);
    views_.push_back(std::move(view));
  }
}

void FieldGaussNewton::View::members(SavedState& state) {
  state(jacobian, near, far, gathered, residual, variance, weight, seen, slopes);
}

void FieldGaussNewton::members(SavedState& state) {
  state(values_, prior_);
  for (View& view : views_) state(view);
}

void FieldGaussNewton::set_values(const FieldValues& values) {
  values_ = values;
  if (prior_.empty()) prior_.begin(numbers_.of(values));
  for (View& view : views_) view.seen = 0;
}

Eigen::Index FieldGaussNewton::row_of(const View& view, std::size_t pixel) const {
  const int x = static_cast<int>(pixel) % view.width, y = static_cast<int>(pixel) / view.width;
  const int cell = y / cell_ * cells_along(view.width, cell_) + x / cell_;
  return view.rows[static_cast<std::size_t>(cell)];
}

template <class Pixels>
Eigen::MatrixXf FieldGaussNewton::of_cells(const View& view, const Pixels& pixels) const {
  const Eigen::Index cells = view.jacobian.rows();
  Eigen::MatrixXf sums = Eigen::MatrixXf::Zero(3 * cells, pixels.cols());
  for (std::size_t p = 0; p < view.share.size(); ++p)
    if (const Eigen::Index row = row_of(view, p); row >= 0)
      for (int c = 0; c < 3; ++c)
        sums.row(c * cells + row) += pixels.row(static_cast<Eigen::Index>(3 * p) + c);
  return sums;
}

void FieldGaussNewton::add_residual(std::size_t i, const Halves& seen,
                                    const Eigen::VectorXf& weight, double keep, double samples) {
  View& view = views_[i];
  const Eigen::ArrayXf share = of_numbers(view.share);
  Eigen::MatrixXf sums(share.size(), 3);
  sums.col(0) = share * (seen.residual_a + seen.residual_b).array() / 2;
  sums.col(1) = share.square() * seen.variance.array() / 2;
  sums.col(2) = (share > 0).select(share.square() / weight.array(), 0);
  sums = of_cells(view, sums);
  const auto of_channels = [&](Eigen::Index k) {
    return sums.col(k).reshaped(view.jacobian.rows(), 3);
  };
  const double kept = keep * view.seen;
  const auto fresh = static_cast<float>(samples / (kept + samples));
  view.residual += fresh * (of_channels(0) - view.residual);
  view.variance = square(1 - fresh) * view.variance + square(fresh) * of_channels(1);
  view.seen = kept + samples;
  view.weight = (of_channels(2).array() > 0).select(of_channels(2).cwiseInverse(), 0.f);
}

void FieldGaussNewton::gather(std::size_t i, const FieldJacobian& derivatives, double samples) {
  View& view = views_[i];
  const double kept = options_.jacobian_kept * view.gathered;
  const auto fresh = static_cast<float>(samples / (kept + samples));
  Eigen::Index at = 0;
  for (const CellJacobian& one : derivatives.fields) {
    auto block = view.jacobian.middleCols(at, one.cols());
    block += fresh * (one(view.cells, Eigen::all) - block);
    at += one.cols();
  }
  if (has_images()) gather_places(view, derivatives.places, fresh);
  view.gathered = kept + samples;
}

void FieldGaussNewton::gather_places(View& view, const std::vector<PlaceSlopes>& places,
                                     float fresh) const {
  view.far *= 1 - fresh;
  std::vector<int> found(place_groups_->of.size(), -1);  // of each place, its entry
  for (std::size_t row = 0; row < view.cells.size(); ++row) {
    std::vector<PlaceSlope>& near = view.near[row];
    for (PlaceSlope& one : near) {
      one.slope *= Colorf(1 - fresh);
      found[one.place] = static_cast<int>(&one - near.data());
    }
    for (std::size_t f = 0; f < places.size(); ++f)
      for (const auto& [place, slope] : places[f][static_cast<std::size_t>(view.cells[row])])
        numbers_.each_place(f, place, [&](std::uint32_t to, float share) {
          int& at = found[to];
          if (at < 0) {
            at = static_cast<int>(near.size());
            near.push_back({to, {}});
          }
          near[static_cast<std::size_t>(at)].slope += Colorf(fresh * share) * slope;
        });
    const auto size = [](const PlaceSlope& one) {
      return std::abs(one.slope.r) + std::abs(one.slope.g) + std::abs(one.slope.b);
    };
    float largest = 0;
    for (const PlaceSlope& one : near) {
      found[one.place] = -1;
      largest = std::max(largest, size(one));
    }
    std::erase_if(near, [&](const PlaceSlope& one) {
      if (size(one) >= options_.least_share * largest) return false;
      for (int c = 0; c < 3; ++c)
        view.far(static_cast<Eigen::Index>(row), 3 * place_groups_->of[one.place] + c) +=
            one.slope[c];
      return true;
    });
    std::ranges::sort(near, {}, &PlaceSlope::place);
  }
}

CellMatrix FieldGaussNewton::jacobian_of(const View& view, const FieldNumbers::Part& part) const {
  if (!has_images()) return CellMatrix(view.jacobian(Eigen::all, part.numbers));
  const Eigen::Index cells = view.far.rows();
  CellMatrix::Sparse near(part.channels * cells, part.numbers.size());
  Eigen::MatrixXf far =
      Eigen::MatrixXf::Zero(near.rows(), static_cast<Eigen::Index>(groups_->share.size()));
  Eigen::Index count = 0;
  for (const auto& row : view.near) count += std::ssize(row);
  near.reserve(part.channels * count);
  for (int k = 0; k < part.channels; ++k) {
    const int channel = part.first_channel + k;
    for (Eigen::Index row = 0; row < cells; ++row) {
      near.startVec(k * cells + row);
      for (const auto& [place, slope] : view.near[static_cast<std::size_t>(row)])
        near.insertBack(k * cells + row, numbers_.column(place, channel)) = slope[channel];
    }
    for (std::size_t group = 0; group < group_places_.size(); ++group) {
      if (place_groups_->share[group] == 0) continue;  // an image of fewer texels along than groups
      const Eigen::Index column = numbers_.column(group_places_[group], channel);
      far.col(groups_->of[static_cast<std::size_t>(column)]).segment(k * cells, cells) =
          view.far.col(3 * static_cast<Eigen::Index>(group) + channel);
    }
  }
  near.finalize();
  return {std::move(near), std::move(far), groups_};
}

Eigen::MatrixXf FieldGaussNewton::signs(Eigen::Index rows, int probes) {
  Eigen::MatrixXf all(rows, probes);
  for (Eigen::Index k = 0; k < all.cols(); ++k)
    for (Eigen::Index i = 0; i < rows; ++i)
      all(i, k) = (mix64(static_cast<std::uint64_t>(k * rows + i)) & 1) != 0 ? 1.f : -1.f;
  return all;
}

/// The diagonal of the matrix that maps residuals to what texels explain, by random signs.
/// Source: Hutchinson 1990, Communications in Statistics 19.
Eigen::VectorXf FieldGaussNewton::leverage(const CellMatrix& jacobian,
                                           const NormalMatrix& normal) const {
  const Eigen::MatrixXf sides = signs(jacobian.rows(), options_.probes);
  const Eigen::MatrixXd seen = jacobian.transposed_times(sides).cast<double>();
  const Eigen::MatrixXf explained =
      jacobian.times(normal.solve(seen, options_.probe_tolerance).cast<float>());
  return sides.cwiseProduct(explained).rowwise().mean();
}

/// The trace of that matrix counts the degrees of freedom that texels take from the residuals. These count as in
/// `variance_of`. Few vectors of many texels tell it.
double FieldGaussNewton::remaining_variance(const CellMatrix& jacobian, const NormalMatrix& normal,
                                            const Eigen::VectorXf& residual) const {
  const auto explained = [&](const Eigen::MatrixXf& sides) -> Eigen::MatrixXf {
    const Eigen::MatrixXd seen = jacobian.transposed_times(sides).cast<double>();
    return jacobian.times(normal.solve(seen, options_.probe_tolerance).cast<float>());
  };
  const Eigen::ArrayXd strength = jacobian.squared_rows().cast<double>().array();
  const double all = (strength * (residual.array() != 0).cast<double>()).sum();
  const Eigen::MatrixXf probes = signs(residual.size(), options_.probes);
  const auto left_by = [&](const auto& sides, const auto& by_texels) -> Eigen::ArrayXd {
    return all -
           (strength.matrix().transpose() * sides.cwiseProduct(by_texels).template cast<double>())
               .array()
               .transpose();
  };
  const int first = std::min(options_.first_probes, options_.probes);
  Eigen::MatrixXf sides(residual.size(), 1 + first);
  sides << residual, probes.leftCols(first);
  const Eigen::MatrixXf by_texels = explained(sides);
  Eigen::ArrayXd lefts = left_by(sides.rightCols(first), by_texels.rightCols(first));
  const double scatter = (lefts - lefts.mean()).square().sum() / std::max(first - 1, 1);
  if (std::sqrt(scatter / first) > options_.trace_error * std::abs(lefts.mean())) {
    const int more = options_.probes - first;
    const Eigen::ArrayXd found = left_by(probes.rightCols(more), explained(probes.rightCols(more)));
    lefts.conservativeResize(options_.probes);
    lefts.tail(more) = found;
  }
  const double left = lefts.mean();
  const double squares =
      (strength * (residual - by_texels.col(0)).cast<double>().array().square()).sum();
  // At least that of one cell of their mean strength.
  const double least =
      strength.square().sum() / std::max(strength.sum(), std::numeric_limits<double>::min());
  return squares / std::max(left, least);
}

void FieldGaussNewton::solve(double done) {
  const Eigen::VectorXd values = numbers_.of(values_);
  std::vector<Eigen::VectorXf> residuals;
  Eigen::VectorXd known = Eigen::VectorXd::Zero(systems_.front().part.numbers.size());
  for (System& system : systems_) {
    std::vector<CellMatrix> parts;
    std::vector<Eigen::VectorXf> rows;
    Eigen::Index count = 0;
    double noise = 0;
    system.roots.clear();
    for (const View& view : views_) {
      const CellMatrix jacobian = jacobian_of(view, system.part);
      const Eigen::VectorXf& root = system.roots.emplace_back(roots_of(view, system, jacobian));
      parts.push_back(jacobian.scaled(root));
      rows.push_back(root.cwiseProduct(system.part.rows_of(view.residual)));
      count += root.size();
      noise += (parts.back().squared_rows().array() * root.array().square() *
                system.part.rows_of(view.variance).array())
                   .sum();
    }
    system.jacobian = std::make_shared<const CellMatrix>(CellMatrix::stacked(parts));
    Eigen::VectorXf& residual = residuals.emplace_back(count);
    Eigen::Index at = 0;
    for (const Eigen::VectorXf& one : rows) {
      residual.segment(at, one.size()) = one;
      at += one.size();
    }
    system.normal = NormalMatrix(system.jacobian);
    system.descent = -system.jacobian->transposed_times(residual).cast<double>();
    const double all = system.normal.trace();
    system.variance = all > 0 ? noise / all : 0;
    system.whole = variance_of(residual, system.jacobian->squared_rows());
    system.remaining = system.whole;
    if (all > 0 && !options_.by_agreement)
      system.variance =
          std::max(system.variance, variance_of(residual, Eigen::VectorXf::Ones(residual.size())));
    // What no light explains is not noise: a residual that stays counts as well.
    if (all > 0 && has_environment())
      system.variance =
          std::max(system.variance, variance_of_blocks(system.jacobian->dense(), residual) / all);
    if (system.variance > 0)
      known += system.normal.diagonal() / (static_cast<double>(systems_.size()) * system.variance);
  }
  prior_.adapt(values, known);
  for (std::size_t s = 0; s < systems_.size(); ++s) {
    System& system = systems_[s];
    const double all = system.normal.trace();
    const Eigen::VectorXd damping = damping_of(system, done);
    NormalMatrix last;
    if (has_images() && all > 0) {
      const double noise = system.variance;
      for (int round = 0; round < options_.variance_rounds; ++round) {
        NormalMatrix normal = system.normal;
        normal.add(system.variance, prior_.precision(), damping, &last);
        system.remaining = remaining_variance(*system.jacobian, normal, residuals[s]);
        // Numbers have noise of few samples, which weights that are smooth overrate.
        if (options_.by_agreement)
          system.variance = has_numbers() ? system.remaining : std::max(noise, system.remaining);
        last = std::move(normal);
      }
    }
    system.normal.add(system.variance, prior_.precision(), damping, &last);
    system.descent -=
        system.variance * prior_.precision()->times((values - prior_.mean())(system.part.numbers));
  }
}

Eigen::VectorXf FieldGaussNewton::roots_of(const View& view, const System& system,
                                           const CellMatrix& jacobian) const {
  const Eigen::VectorXf weight = system.part.rows_of(view.weight);
  if (!has_numbers()) return weight.cwiseSqrt();
  const Eigen::Index cells = std::ssize(view.cells);
  const Eigen::ArrayXf of_rows = weight.array() * jacobian.squared_rows().array();
  const Eigen::ArrayXf of_cells = of_rows.reshaped(cells, system.part.channels).rowwise().sum();
  Eigen::ArrayXf strength = Eigen::ArrayXf::Zero(std::ssize(view.rows));
  for (Eigen::Index row = 0; row < cells; ++row)
    strength[view.cells[static_cast<std::size_t>(row)]] = of_cells[row];
  const Eigen::ArrayXf factors =
      bounded_influence(strength, cells_along(view.width, cell_), options_.influence);
  const Eigen::ArrayXf counted = factors(view.cells);
  return (weight.array() * counted.replicate(system.part.channels, 1)).sqrt();
}

Eigen::VectorXd FieldGaussNewton::damping_of(const System& system, double done) const {
  const double share = has_environment() ? options_.environment_damping
                                         : std::exp(std::log(options_.first_damping) * (1 - done) +
                                                    std::log(options_.last_damping) * done);
  Eigen::VectorXd damping(system.part.numbers.size());
  Eigen::Index at = 0;
  for (const FieldNumbers::Lattice& one : numbers_.lattices()) {
    const Eigen::Index count = one.count / system.part.numbers.incrObject();
    const auto strengths = system.normal.diagonal().segment(at, count);
    const double all = strengths.sum();
    damping.segment(at, count).setConstant(all > 0 ? share * strengths.squaredNorm() / all : 1);
    at += count;
  }
  return damping;
}

double FieldGaussNewton::pattern_left() const {
  double whole = 0, remaining = 0;
  for (const System& system : systems_) {
    whole += system.whole;
    remaining += system.remaining;
  }
  return whole > 0 ? std::max(0.0, 1 - remaining / whole) : 0;
}

/// Neighbouring cells share what no light explains, and each block of them says it once.
double FieldGaussNewton::variance_of_blocks(const Eigen::MatrixXf& jacobian,
                                            const Eigen::VectorXf& residual) const {
  double sum = 0;
  Eigen::Index row = 0;
  for (const View& view : views_) {
    const int columns = cells_along(view.width, cell_), rows = cells_along(view.height, cell_);
    const PixelBlocks blocks(columns, rows, options_.blocks);
    Eigen::MatrixXf scores = Eigen::MatrixXf::Zero(blocks.count, jacobian.cols());
    for (const Eigen::Index cell : view.cells) {
      const std::size_t block =
          blocks.of(static_cast<int>(cell) % columns, static_cast<int>(cell) / columns);
      scores.row(static_cast<Eigen::Index>(block)) += jacobian.row(row) * residual[row];
      ++row;
    }
    sum += scores.cast<double>().squaredNorm();
  }
  return sum;
}

Eigen::MatrixXd FieldGaussNewton::eliminate_fields(const std::vector<Regressors>& z) {
  const Eigen::Index unknowns = z.front().whole->a.slopes.cols();
  Eigen::MatrixXd remaining = Eigen::MatrixXd::Zero(unknowns, unknowns);
  // Of the cells: in the equations of the scalars residuals have weights of their own.
  std::vector<Eigen::MatrixXf> weights, sums_a, sums_b;
  for (std::size_t i = 0; i < z.size(); ++i) {
    View& view = views_[i];
    const InstrumentalVariables::Set& whole = *z[i].whole;
    // A texel shows in few pixels, over which the noise of means does not cancel.
    const Jacobian slopes = has_images() ? Jacobian((whole.a.filtered + whole.b.filtered) / 2)
                                         : Jacobian((whole.a.slopes + whole.b.slopes) / 2);
    view.slopes = of_cells(view, of_numbers(view.share).matrix().asDiagonal() * slopes);
    weights.push_back(of_cells(view, *z[i].weight).reshaped(view.jacobian.rows(), 3));
    const auto sums = [&](InstrumentalVariables::Half InstrumentalVariables::Set::*half) {
      Eigen::MatrixXf all = of_cells(view, z[i].weight->asDiagonal() * (whole.*half).filtered);
      if (z[i].informative)
        all += of_cells(view,
                        z[i].informative_weight->asDiagonal() * (z[i].informative->*half).filtered);
      return all;
    };
    sums_a.push_back(sums(&InstrumentalVariables::Set::a));
    sums_b.push_back(sums(&InstrumentalVariables::Set::b));
  }
  for (const System& system : systems_) {
    const FieldNumbers::Part& part = system.part;
    std::vector<CellMatrix> jacobians, parts;
    for (std::size_t i = 0; i < z.size(); ++i) {
      jacobians.push_back(jacobian_of(views_[i], part));
      parts.push_back(jacobians.back().scaled(part.rows_of(weights[i]).cwiseSqrt()));
    }
    const auto jacobian = std::make_shared<const CellMatrix>(CellMatrix::stacked(parts));
    NormalMatrix solver(jacobian);
    const double strength = system.jacobian->squared_columns().sum();
    const double variance = strength > 0 ? system.variance * (solver.trace() / strength) : 1;
    solver.add(variance, prior_.precision(), Eigen::VectorXd::Zero(part.numbers.size()));
    if (z.front().widening) widen(*jacobian, solver, part, z);
    const Eigen::MatrixXd like =
        (eliminate_from_half(z, &InstrumentalVariables::Set::a, part, sums_a, jacobians, solver) +
         eliminate_from_half(z, &InstrumentalVariables::Set::b, part, sums_b, jacobians, solver)) /
        2;
    // The equations still move by variance * precision * like where a voxel is off by 1, and the
    // covariance of the voxels is variance / normal.
    const Eigen::MatrixXd moves = variance * prior_.precision()->times(like);
    remaining += variance * (moves.transpose() * solver.solve(moves));
  }
  return remaining;
}

void FieldGaussNewton::widen(const CellMatrix& jacobian, const NormalMatrix& normal,
                             const FieldNumbers::Part& part,
                             const std::vector<Regressors>& z) const {
  const Eigen::ArrayXf factors =
      (1 -
       leverage(jacobian, normal).array().min(static_cast<float>(options_.most_leverage)).max(0))
          .rsqrt();
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    const View& view = views_[i];
    Eigen::VectorXf& widening = *z[i].widening;
    if (part.first_channel == 0) widening = Eigen::VectorXf::Ones(3 * std::ssize(view.share));
    for (int k = 0; k < part.channels; ++k, first += view.weight.rows())
      for (std::size_t p = 0; p < view.share.size(); ++p)
        if (const Eigen::Index row = row_of(view, p); row >= 0)
          widening[static_cast<Eigen::Index>(3 * p) + part.first_channel + k] =
              factors[first + row];
  }
}

Eigen::MatrixXd FieldGaussNewton::eliminate_from_half(
    const std::vector<Regressors>& z, InstrumentalVariables::Half InstrumentalVariables::Set::*half,
    const FieldNumbers::Part& part, const std::vector<Eigen::MatrixXf>& sums,
    const std::vector<CellMatrix>& jacobians, const NormalMatrix& solver) const {
  Eigen::MatrixXf seen = Eigen::MatrixXf::Zero(part.numbers.size(), sums.front().cols());
  for (std::size_t i = 0; i < z.size(); ++i)
    seen += jacobians[i].transposed_times(part.blocks_of(sums[i]));
  Eigen::MatrixXd like = solver.solve(seen.cast<double>());
  for (std::size_t i = 0; i < z.size(); ++i) {
    const View& view = views_[i];
    const Eigen::Index cells = view.weight.rows();
    const Eigen::MatrixXf explained = jacobians[i].times(like.cast<float>());
    Jacobian& instruments = (z[i].whole->*half).filtered;
    for (int k = 0; k < part.channels; ++k)
      for (std::size_t p = 0; p < view.share.size(); ++p)
        if (const Eigen::Index row = row_of(view, p); row >= 0)
          instruments.row(static_cast<Eigen::Index>(3 * p) + part.first_channel + k) -=
              explained.row(k * cells + row);
  }
  return like;
}

/// Numbers beyond a bound are pinned to it until none of the others is.
Eigen::VectorXd FieldGaussNewton::bounded_step(const System& system, const Eigen::VectorXd& right,
                                               const Eigen::VectorXd& low,
                                               const Eigen::VectorXd& high) const {
  Eigen::VectorXd step = system.normal.solve(right);
  if (!has_environment()) return step.cwiseMax(low).cwiseMin(high);
  std::vector<Eigen::Index> free(static_cast<std::size_t>(step.size()));
  std::iota(free.begin(), free.end(), Eigen::Index{0});
  for (int round = 0; round < options_.active_set_rounds; ++round) {
    const auto beyond = [&](Eigen::Index i) { return step[i] < low[i] || step[i] > high[i]; };
    if (std::ranges::none_of(free, beyond)) break;
    for (const Eigen::Index i : free) step[i] = std::clamp(step[i], low[i], high[i]);
    std::erase_if(free, [&](Eigen::Index i) { return step[i] <= low[i] || step[i] >= high[i]; });
    if (free.empty()) break;
    Eigen::VectorXd pinned = step;
    for (const Eigen::Index i : free) pinned[i] = 0;
    const Eigen::VectorXd rest = right - system.normal.dense() * pinned;
    const Eigen::MatrixXd inner = system.normal.dense()(free, free);
    const Eigen::VectorXd solved = inner.llt().solve(rest(free));
    for (std::size_t k = 0; k < free.size(); ++k)
      step[free[k]] = solved[static_cast<Eigen::Index>(k)];
  }
  return step.cwiseMax(low).cwiseMin(high);
}

void FieldGaussNewton::advance(const Eigen::VectorXd& du) {
  const Eigen::VectorXd before = numbers_.of(values_), longest = prior_.longest_steps(before);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(before.size());
  for (const System& system : systems_) {
    const FieldNumbers::Part& part = system.part;
    Eigen::VectorXf shift = Eigen::VectorXf::Zero(system.jacobian->rows());
    Eigen::Index at = 0;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const View& view = views_[i];
      const Eigen::Index rows = part.channels * view.weight.rows();
      if (view.slopes.size() > 0)
        shift.segment(at, rows) =
            system.roots[i].cwiseProduct(part.blocks_of(view.slopes) * du.cast<float>());
      at += rows;
    }
    const Eigen::VectorXd here = before(part.numbers);
    const Eigen::VectorXd low = (minimum_(part.numbers) - here).cwiseMax(-longest(part.numbers));
    const Eigen::VectorXd high = (maximum_(part.numbers) - here).cwiseMin(longest(part.numbers));
    step(part.numbers) = bounded_step(
        system, system.descent - system.jacobian->transposed_times(shift).cast<double>(), low,
        high);
  }
  numbers_.keep_lengths(before, step);
  numbers_.add(step, values_);
  for (View& view : views_)
    for (const System& system : systems_) {
      const FieldNumbers::Part& part = system.part;
      Eigen::VectorXf moved =
          jacobian_of(view, part).times(Eigen::VectorXf(step(part.numbers).cast<float>()));
      if (view.slopes.size() > 0) moved += part.blocks_of(view.slopes) * du.cast<float>();
      view.residual.middleCols(part.first_channel, part.channels) +=
          moved.reshaped(view.residual.rows(), part.channels);
    }
}

}  // namespace selenite

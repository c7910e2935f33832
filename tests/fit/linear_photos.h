// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "fit/smoke.h"
#include "fit/solver/joint_gauss_newton.h"
#include "fit/taken_photos.h"
#include "math/draws.h"

namespace selenite {

inline constexpr int kSide = 32, kAcross = kSide / 8;
inline constexpr Eigen::Index kCells = kAcross * kAcross, kNumbers = 24;

inline Scene grey_smoke() { return smoke(std::vector<float>(kNumbers, 0.5f), 3); }

inline std::vector<UnknownParameter> colour_and_voxels() {
  return {{"World", "color", {0.5, 0.5, 0.5}, 0, 1, 0.03},
          {"Smoke", "albedo_grid", {}, 0, 1, 0.03}};
}

inline std::vector<Photo> grey_photos(const Scene& scene) {
  std::vector<Photo> photos = taken_photos(scene, kSide, 1);
  for (Photo& photo : photos) photo.reference.assign(photo.size(), Colorf(0.5f));
  return photos;
}

/// Photos of a world without noise that is linear in a colour and in 24 voxels. Half of what the colour
/// does to the pictures, voxels can do as well; the rest of it differs from pixel to pixel.
struct LinearPhotos {
  Scene scene = grey_smoke();
  std::vector<Photo> photos = grey_photos(scene);
  Unknowns unknowns{scene, colour_and_voxels()};
  Fields fields{scene, colour_and_voxels()};
  SlotLayout layout{unknowns.layout(scene)};
  const Loss& loss = find_loss("mse");
  Problem problem{unknowns, layout, photos, loss, 60};
  Vector true_color = Eigen::Vector3d(0.42, 0.56, 0.61), true_voxels{kNumbers};
  std::vector<CellJacobian> by_voxels;
  std::vector<Picture> by_color;

  LinearPhotos() {
    std::mt19937 random(7);
    Normal<float> normal;
    for (Eigen::Index k = 0; k < kNumbers; ++k)
      true_voxels[k] = 0.5 + 0.15 * std::sin(static_cast<double>(k));
    for (std::size_t i = 0; i < photos.size(); ++i) {
      by_voxels.push_back(
          CellJacobian::NullaryExpr(kCells, kNumbers, [&](auto...) { return normal(random); }));
      Picture picture(photos[i].size());
      for (std::size_t p = 0; p < picture.size(); ++p)
        for (int c = 0; c < 3; ++c)
          picture[p][c] = by_voxels[i].row(cell(p))(c) + 0.5f * normal(random);
      by_color.push_back(std::move(picture));
    }
  }

  static Eigen::Index cell(std::size_t pixel) {
    return static_cast<Eigen::Index>(pixel / kSide / 8 * kAcross + pixel % kSide / 8);
  }
  /// What a render of all photos at these values gives.
  std::vector<Observation> at(const Vector& color, const Vector& voxels) const {
    std::vector<Observation> seen;
    for (std::size_t i = 0; i < photos.size(); ++i) {
      Film film(kSide, kSide, 16, 1);
      for (std::size_t p = 0; p < film.size(); ++p)
        for (int c = 0; c < 3; ++c) {
          double value = photos[i].reference[p][c] + by_color[i][p][c] * (color[c] - true_color[c]);
          for (Eigen::Index k = c; k < kNumbers; k += 3)  // a voxel shows in its own channel
            value += by_voxels[i](cell(p), k) * (voxels[k] - true_voxels[k]);
          film.mean[p][c] = film.half_a[p][c] = static_cast<float>(value);
        }
      film.slots[0].mean = film.slots[0].half_a = by_color[i];
      seen.push_back({static_cast<int>(i), std::move(film), {}});
    }
    return seen;
  }
  void gather(JointGaussNewton& solver) const {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      FieldJacobian derivatives;
      derivatives.fields = {by_voxels[i]};
      solver.gather_fields(i, derivatives);
    }
  }
  double voxel_error(const JointGaussNewton& solver) const {
    return (solver.fields()[0] - true_voxels).cwiseAbs().maxCoeff();
  }
};

}  // namespace selenite

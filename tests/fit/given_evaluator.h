// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <utility>

#include "fit/evaluate/photo_evaluator.h"

namespace selenite {

/// An evaluator whose films a test computes: film(scalars, photo, spp, seed, derivatives).
template <class FilmAt>
class GivenEvaluator final : public Evaluator {
 public:
  explicit GivenEvaluator(FilmAt film_at) : film_at_(std::move(film_at)) {}
  Film evaluate(const Point& point, const Photo& photo, const Evaluation& how) override {
    return film_at_(point.scalars, photo, how.spp, how.seed, how.derivatives);
  }

 private:
  FilmAt film_at_;
};

}  // namespace selenite

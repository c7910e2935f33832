// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/field_adam.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "fit/problem/saved_state.h"
#include "math/gaussian_blur.h"
#include "math/scalar.h"

namespace selenite {

FieldAdam::FieldAdam(const Fields& fields, const AdamOptions& options) : fields_(&fields) {
  for (const Vector& start : fields.start()) moments_.emplace_back(start.size(), options);
}

void FieldAdam::members(SavedState& state) {
  for (AdamMoments& moments : moments_) state(moments);
}

void FieldAdam::step(FieldValues& values, const std::vector<std::vector<double>>& gradients,
                     const std::vector<FieldStep>& how) {
  for (std::size_t f = 0; f < values.size(); ++f) {
    for (std::size_t i = 0; i < gradients[f].size(); ++i)
      if (!std::isfinite(gradients[f][i]))
        throw std::runtime_error("The derivative with respect to number " + std::to_string(i) +
                                 " of " + fields_->names()[f] +
                                 " is not finite; report this scene");
    std::vector<double> slopes = gradients[f];
    const Texture* const image = fields_->image(f);
    if (image)
      add_image_prior(*image, fields_->start()[f], values[f], moments_[f].moving(), how[f].prior,
                      slopes, fields_->channels(f));
    if (image && how[f].spread > 0) {
      const double texels = how[f].spread * image->width() * image->height();
      slopes = gaussian_blur(std::move(slopes), image->height(), image->width(),
                             fields_->channels(f), std::sqrt(texels / (4 * kPi<double>)),
                             image->extension() == Extension::kRepeat);
    }
    if (const MeshGraph* const graph = fields_->graph(f)) {
      Eigen::Map<Vector> of_mesh(slopes.data(), static_cast<Eigen::Index>(slopes.size()));
      add_mesh_prior(*graph, values[f], moments_[f].moving(), how[f].prior, of_mesh);
      if (how[f].spread > 0)
        of_mesh = graph->smoothed(of_mesh, how[f].spread * static_cast<double>(graph->size()));
    }
    const Eigen::Map<const Vector> gradient(slopes.data(),
                                            static_cast<Eigen::Index>(slopes.size()));
    const UnknownParameter& one = fields_->wanted()[f];
    const auto same = [&](double x) { return Vector::Constant(gradient.size(), x); };
    values[f] = moments_[f].update(values[f], gradient, same(how[f].rate * one.learning_rate),
                                   same(one.minimum), same(one.maximum));
  }
}

}  // namespace selenite

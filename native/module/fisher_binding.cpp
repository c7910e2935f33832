// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <optional>

#include "fit/inference/fisher_information.h"
#include "module/arrays.h"
#include "module/bindings.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

using OptionalArray = std::optional<Array<float>>;

/// (height, width, 3) and, where not all pixels count alike, (height, width).
Photo photo_of(const Array<float>& reference, const OptionalArray& weight) {
  require_shape(reference, "reference", {-1, -1, 3});
  Photo photo;
  photo.height = static_cast<int>(reference.shape(0));
  photo.width = static_cast<int>(reference.shape(1));
  photo.reference = colors_of(reference);
  if (weight) {
    require_shape(*weight, "weight", {reference.shape(0), reference.shape(1)});
    photo.weight.assign(weight->data(), weight->data() + weight->size());
  }
  return photo;
}

FisherInformation information(const PhotoJacobian& seen, const std::optional<Array<float>>& picture,
                              const OptionalArray& weight, double spp, double relative,
                              double pixels, const std::array<double, 3>& model_error) {
  const Array<float> shown =
      picture ? *picture : Array<float>(picture_array(seen.mean, seen.width, seen.height));
  Photo photo = photo_of(shown, weight);
  if (photo.width != seen.width || photo.height != seen.height)
    throw Refused("picture", std::to_string(photo.width) + " x " + std::to_string(photo.height) +
                                 " pixels given, " + std::to_string(seen.width) + " x " +
                                 std::to_string(seen.height) + " needed");
  check_photo(photo);
  const py::gil_scoped_release release;
  const auto& [of_brightness, absolute, shift] = model_error;
  return fisher_information(seen, photo, {spp, relative, pixels, {of_brightness, absolute, shift}});
}

py::array_t<bool> known(const Vector& errors, const Vector& ranges) {
  const std::vector<bool> found = determined(errors, ranges);
  py::array_t<bool> array(static_cast<py::ssize_t>(found.size()));
  std::ranges::copy(found, array.mutable_data());
  return array;
}

}  // namespace

void bind_fisher_information(py::module_& m) {
  py::class_<FisherInformation>(m, "FisherInformation",
                                R"(What one photo says about the unknowns, in
the coordinates of `reparametrization`: normal, normal_variance (of each entry), score_covariance,
(n, n), and low, high, what the latter can be in units of normal.)")
      .def_readonly("normal", &FisherInformation::normal)
      .def_readonly("normal_variance", &FisherInformation::normal_variance)
      .def_readonly("score_covariance", &FisherInformation::score_covariance)
      .def_readonly("low", &FisherInformation::low)
      .def_readonly("high", &FisherInformation::high)
      .def("relative_uncertainty", &FisherInformation::relative_uncertainty,
           R"(Of the information about the single components the largest error, as a share of it;
infinite where there is none but noise.)")
      .def("precision", &FisherInformation::precision, "resolved"_a = kConfidence.resolved,
           R"((n, n): inverse covariance of what a fit to the photo would find. Directions whose
information is not more than `resolved` standard deviations of its own noise count as not seen.)");
  m.def("fisher_information", &information, "seen"_a, "picture"_a = py::none(),
        "weight"_a = py::none(), py::kw_only(), "spp"_a, "relative"_a, "pixels"_a,
        "model_error"_a = std::array<double, 3>{},
        R"(FisherInformation of a photo, with the weights and the instruments of a fit.

seen: a PhotoJacobian. picture: the photo at its size, (height, width, 3); None: the render in its
place. weight: (height, width), 0 where a pixel does not count. The noise of a residual: spp, samples
of the render that a fit compares; relative, error of the photo as a share of its brightness; pixels,
how many pixels of the photo are one of `seen`; model_error, that a fit has found: relative, absolute,
shift in pixels of the photo. Raises ValueError.)");
  m.def(
      "weakest_direction",
      [](const std::vector<FisherInformation>& photos) { return weakest_direction(photos); },
      "photos"_a,
      R"(Of all directions the least information of the photos together, in standard deviations of
its noise; 0 where a component is not seen.)");
  m.def(
      "expected_errors",
      [](const std::vector<Eigen::MatrixXd>& precisions, const Vector& ranges) {
        return expected_errors(precisions, ranges);
      },
      "precisions"_a, "ranges"_a,
      R"((n,): standard error of each component from the precision of each photo. What no photo shows
is as wide as its bounds, `ranges` apart, leave it.)");
  m.def("determined", &known, "errors"_a, "ranges"_a, "(n,) bool: as in a fit's report.");
  m.def("information_gain", &information_gain, "before"_a, "after"_a, "groups"_a,
        R"(Logarithm of the factor by which errors shrink, the mean over groups: the components of
each parameter.)");
}

}  // namespace selenite

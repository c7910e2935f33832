// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/photo/photo.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <set>

#include "math/fault.h"
#include "math/hash.h"
#include "math/problem_list.h"

namespace selenite {
namespace {

bool finite(const Colorf& c) {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

/// Nothing when the photo is good; mends what is to be mended.
std::optional<Fault> fault_of(Photo& photo) {
  const std::string who = "Photo '" + photo.id + "'";
  const std::string size =
      std::to_string(photo.width) + " x " + std::to_string(photo.height) + " pixels";
  if (photo.width < 1 || photo.height < 1)
    return Fault{who, "its size is " + size, "both must be at least 1"};
  const std::size_t count = static_cast<std::size_t>(photo.width) * photo.height;
  if (photo.reference.size() != count)
    return Fault{who, "it holds " + std::to_string(photo.reference.size()) + " pixels, not " + size,
                 ""};
  if (photo.weight.empty()) photo.weight.assign(count, 1.f);
  if (photo.weight.size() != count)
    return Fault{who,
                 "its mask holds " + std::to_string(photo.weight.size()) + " pixels, not " + size,
                 "make them the same size"};
  if (!photo.coverage.empty() &&
      (photo.coverage.size() != count ||
       !std::ranges::all_of(photo.coverage, [](float share) { return share >= 0 && share <= 1; })))
    return Fault{who, "its coverage is not a share in [0, 1] for each of " + size, ""};
  std::size_t not_finite = 0;
  double total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float weight = photo.weight[i];
    if (!(weight >= 0) || !std::isfinite(weight))
      return Fault{who, "its mask has the value " + std::to_string(weight),
                   "every value must be >= 0"};
    total += weight;
    if (weight == 0)
      photo.reference[i] = Colorf(0.f);
    else if (!finite(photo.reference[i]))
      ++not_finite;
  }
  if (not_finite > 0)
    return Fault{who, std::to_string(not_finite) + " pixels are not finite",
                 "give them weight 0 in the mask"};
  if (total == 0)
    return Fault{who, "its mask leaves no pixel", "enlarge it or leave the photo out"};
  try {
    photo.frame.check();
  } catch (const Refused& error) {
    return error.faults().front().within(who);
  }
  try {
    visit_fields(photo.values, [&](const Parameter& parameter, const double* first, int width) {
      for (int i = 0; i < width; ++i) check_value(photo.id, parameter, first[i]);
    });
  } catch (const Refused& error) {
    return error.faults().front();
  }
  photo.total_weight = total;
  return {};
}

}  // namespace

const ParameterTable& photo_parameter_table() {
  static const auto table = ParameterTable::of<PhotoParameters>();
  return table;
}

Photo photo_of_size(const std::string& camera, int width, int height) {
  Photo photo;
  photo.camera = camera;
  photo.width = width;
  photo.height = height;
  photo.reference.resize(static_cast<std::size_t>(width) * height);
  return photo;
}

void check_photo(Photo& photo) {
  if (auto fault = fault_of(photo)) throw Refused(std::vector{*std::move(fault)});
}

Photo Photo::resized(int longest) const {
  if (std::max(width, height) <= longest) return *this;
  const double scale = static_cast<double>(longest) / std::max(width, height);
  Photo small = *this;  // with everything that is not a pixel
  small.reference.clear();
  small.weight.clear();
  small.coverage.clear();
  small.pixels = nullptr;
  small.total_weight = 0;
  small.is_small = true;
  small.width = std::max(1, static_cast<int>(std::lround(width * scale)));
  small.height = std::max(1, static_cast<int>(std::lround(height * scale)));
  const FrameWindow& window = frame.window;
  small.frame = {frame.aspect, width, height, window};
  small.alignment = alignment.scaled(static_cast<double>(small.width) / width);
  if (!(small.frame.aspect > 0))
    small.frame.aspect = static_cast<double>(width) / (window.right - window.left) /
                         (height / (window.bottom - window.top));
  const double step_x = static_cast<double>(width) / small.width;
  const double step_y = static_cast<double>(height) / small.height;
  const auto covered = [](int i, double low, double high) {
    return std::max(0.0, std::min(i + 1.0, high) - std::max<double>(i, low));
  };
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      const double left = x * step_x, right = left + step_x, top = y * step_y;
      const double bottom = top + step_y;
      Color<double> sum;
      double area = 0, covered_weight = 0;
      bool whole = true;
      double shown = 0;
      for (int j = static_cast<int>(top); j < std::min<double>(bottom, height); ++j)
        for (int i = static_cast<int>(left); i < std::min<double>(right, width); ++i) {
          const double part = covered(i, left, right) * covered(j, top, bottom);
          if (!(part > 0)) continue;
          const auto at = static_cast<std::size_t>(j) * width + i;
          whole = whole && weight[at] > 0;
          sum += Color<double>(reference[at]) * part;
          covered_weight += part * weight[at];
          area += part;
          if (!coverage.empty()) shown += part * coverage[at];
        }
      small.reference.push_back(whole ? Colorf(sum / area) : Colorf(0.f));
      small.weight.push_back(whole ? static_cast<float>(covered_weight / area) : 0.f);
      if (!coverage.empty()) small.coverage.push_back(static_cast<float>(shown / area));
      small.total_weight += small.weight.back();
    }
  // All pixels beside a masked one (a thin object): the photo itself is the way out.
  return small.total_weight > 0 ? small : *this;
}

std::uint64_t Photo::fingerprint() const {
  const auto of_pixels = [](const auto& list) {
    return hash64({reinterpret_cast<const char*>(list.data()), list.size() * sizeof list[0]});
  };
  std::uint64_t sum = 0;
  for (const std::uint64_t part :
       {hash64(id), hash64(camera), static_cast<std::uint64_t>(width),
        static_cast<std::uint64_t>(height), std::bit_cast<std::uint64_t>(frame.aspect),
        static_cast<std::uint64_t>(frame.width), static_cast<std::uint64_t>(frame.height),
        static_cast<std::uint64_t>(gain_freedom), static_cast<std::uint64_t>(align),
        of_pixels(reference), of_pixels(weight)})
    sum = mix64(sum ^ part);
  for (const double side :
       {frame.window.left, frame.window.top, frame.window.right, frame.window.bottom})
    sum = mix64(sum ^ std::bit_cast<std::uint64_t>(side));
  sum = mix64(sum ^ lights.fingerprint());
  if (!coverage.empty()) sum = mix64(sum ^ of_pixels(coverage));
  if (alignment != Alignment{})  // without one a photo stays that of the checkpoints there are
    for (const double part : {alignment.x, alignment.y, alignment.roll})
      sum = mix64(sum ^ std::bit_cast<std::uint64_t>(part));
  PhotoParameters parameters = values;
  visit_fields(parameters, [&](const Parameter&, const double* first, int width) {
    for (int i = 0; i < width; ++i) sum = mix64(sum ^ std::bit_cast<std::uint64_t>(first[i]));
  });
  return sum;
}

void check_photos(const Scene& scene, std::vector<Photo>& photos) {
  ProblemList problems;
  if (photos.empty())
    problems.add({"No photo to fit to", "pair at least one camera with a photo", ""});
  std::set<std::string> ids;
  for (Photo& photo : photos) {
    problems.collect([&] {
      (void)scene.camera(photo.camera);
      if (photo.id.empty()) photo.id = photo.camera;
      check_photo(photo);
      if (!ids.insert(photo.id).second)
        throw Refused("Photo '" + photo.id + "'", "another photo has its id",
                      "give each photo its own");
    });
    problems.collect([&] { photo.lights.check(scene, "Photo '" + photo.id + "'"); });
  }
  problems.raise();
}

}  // namespace selenite

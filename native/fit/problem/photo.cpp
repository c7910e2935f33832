// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/photo.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "math/error.h"

namespace selenite {
namespace {

bool finite(const Colorf& c) {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

/// Empty when the photo is good; mends what is to be mended.
std::string problem_of(Photo& photo) {
  const std::string who = "Photo of camera '" + photo.camera + "': ";
  const std::string size =
      std::to_string(photo.width) + " x " + std::to_string(photo.height) + " pixels";
  if (photo.width < 1 || photo.height < 1)
    return who + "its size is " + size + "; both must be at least 1";
  const std::size_t count = static_cast<std::size_t>(photo.width) * photo.height;
  if (photo.reference.size() != count)
    return who + "it holds " + std::to_string(photo.reference.size()) + " pixels, not " + size;
  if (photo.weight.empty()) photo.weight.assign(count, 1.f);
  if (photo.weight.size() != count)
    return who + "its mask holds " + std::to_string(photo.weight.size()) + " pixels, not " +
           size + "; make them the same size";
  std::size_t not_finite = 0;
  double total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float weight = photo.weight[i];
    if (!(weight >= 0) || !std::isfinite(weight))
      return who + "its mask has the value " + std::to_string(weight) +
             "; every value must be >= 0";
    total += weight;
    if (weight == 0)
      photo.reference[i] = Colorf(0.f);
    else if (!finite(photo.reference[i]))
      ++not_finite;
  }
  if (not_finite > 0)
    return who + std::to_string(not_finite) +
           " pixels are not finite; give them weight 0 in the mask";
  if (total == 0) return who + "its mask leaves no pixel; enlarge it or leave the photo out";
  try {
    photo.frame.check();
  } catch (const InvalidArgument& error) {
    return who + error.what();
  }
  photo.total_weight = total;
  return {};
}

}  // namespace

void check_photos(const Scene& scene, std::vector<Photo>& photos) {
  std::string problems;
  bool only_names = true;
  const auto add = [&](const std::string& line) {
    problems += (problems.empty() ? "" : "\n") + line;
  };
  if (photos.empty()) {
    add("No photo to fit to: pair at least one camera with a photo");
    only_names = false;
  }
  std::set<std::string> seen;
  for (Photo& photo : photos) {
    try {
      (void)scene.camera(photo.camera);
    } catch (const UnknownName& error) {
      add(error.what());
      continue;
    }
    std::string problem = problem_of(photo);
    if (problem.empty() && !seen.insert(photo.camera).second)
      problem =
          "Camera '" + photo.camera + "' has two photos; give each photo a camera of its own";
    if (problem.empty()) continue;
    add(problem);
    only_names = false;
  }
  if (problems.empty()) return;
  if (only_names) throw UnknownName(problems);
  throw InvalidArgument(problems);
}

}  // namespace selenite

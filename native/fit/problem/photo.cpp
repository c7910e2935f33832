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

/// Empty when the capture is good; mends what is to be mended.
std::string problem_of(Capture& capture) {
  const std::string who = "Photo of camera '" + capture.camera + "': ";
  const std::string size =
      std::to_string(capture.width) + " x " + std::to_string(capture.height) + " pixels";
  if (capture.width < 1 || capture.height < 1)
    return who + "its size is " + size + "; both must be at least 1";
  const std::size_t count = static_cast<std::size_t>(capture.width) * capture.height;
  if (capture.reference.size() != count)
    return who + "it holds " + std::to_string(capture.reference.size()) + " pixels, not " + size;
  if (capture.weight.empty()) capture.weight.assign(count, 1.f);
  if (capture.weight.size() != count)
    return who + "its mask holds " + std::to_string(capture.weight.size()) + " pixels, not " +
           size + "; make them the same size";
  std::size_t not_finite = 0;
  double total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float weight = capture.weight[i];
    if (!(weight >= 0) || !std::isfinite(weight))
      return who + "its mask has the value " + std::to_string(weight) +
             "; every value must be >= 0";
    total += weight;
    if (weight == 0)
      capture.reference[i] = Colorf(0.f);
    else if (!finite(capture.reference[i]))
      ++not_finite;
  }
  if (not_finite > 0)
    return who + std::to_string(not_finite) +
           " pixels are not finite; give them weight 0 in the mask";
  if (total == 0) return who + "its mask leaves no pixel; enlarge it or leave the photo out";
  try {
    capture.frame.check();
  } catch (const InvalidArgument& error) {
    return who + error.what();
  }
  capture.total_weight = total;
  return {};
}

}  // namespace

void check_captures(const Scene& scene, std::vector<Capture>& captures) {
  std::string problems;
  bool only_names = true;
  const auto add = [&](const std::string& line) {
    problems += (problems.empty() ? "" : "\n") + line;
  };
  if (captures.empty()) {
    add("No photo to fit to: pair at least one camera with a photo");
    only_names = false;
  }
  std::set<std::string> seen;
  for (Capture& capture : captures) {
    try {
      (void)scene.camera(capture.camera);
    } catch (const UnknownName& error) {
      add(error.what());
      continue;
    }
    std::string problem = problem_of(capture);
    if (problem.empty() && !seen.insert(capture.camera).second)
      problem =
          "Camera '" + capture.camera + "' has two photos; give each photo a camera of its own";
    if (problem.empty()) continue;
    add(problem);
    only_names = false;
  }
  if (problems.empty()) return;
  if (only_names) throw UnknownName(problems);
  throw InvalidArgument(problems);
}

}  // namespace selenite

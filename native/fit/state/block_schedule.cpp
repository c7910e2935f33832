// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/block_schedule.h"

#include <algorithm>
#include <cstdint>

namespace selenite {

bool BlockSchedule::is_scalar_block(int iteration) const {
  const std::int64_t all = iterations_;
  if (!kind_.after_multi_start && !kind_.joint) {
    const std::int64_t scalars = std::clamp<std::int64_t>(all / 2, 1, options_.scalars);
    return iteration % (scalars + std::clamp<std::int64_t>(all - scalars, 1, options_.fields)) <
           scalars;
  }
  if (kind_.joint) {
    const std::int64_t first = std::min<std::int64_t>(
        kind_.has_environment ? options_.first_lights : options_.first_fields, all / 5);
    const std::int64_t scalars = (options_.cycle * options_.scalar_tenths + 5) / 10;
    return iteration >= all - scalars ||
           (iteration >= first && (iteration - first) % options_.cycle < scalars);
  }
  const std::int64_t cycles =
      std::max<std::int64_t>(1, (all + options_.cycle / 2) / options_.cycle);
  const std::int64_t cycle = ((iteration + 1) * cycles - 1) / all;
  const std::int64_t begin = cycle * all / cycles, end = (cycle + 1) * all / cycles;
  return iteration >=
         end - std::max<std::int64_t>(1, (options_.scalar_tenths * (end - begin) + 5) / 10);
}

Block BlockSchedule::block(int iteration) const {
  if (!kind_.alternates) return {true, kind_.has_fields, false};
  if (!kind_.has_scalars) return {false, true, iteration == 0};
  if (kind_.texels_alone) return {false, true, iteration == 0};
  if (kind_.together) {
    const bool scalars = iteration >= options_.first_texels;
    return {scalars, true,
            !scalars ? iteration == 0 : (iteration - options_.first_texels) % options_.cycle == 0};
  }
  const bool scalars = is_scalar_block(iteration);
  return {scalars, !scalars, iteration == 0 || is_scalar_block(iteration - 1) != scalars};
}

int BlockSchedule::count(bool Block::*member, int iterations) const {
  int count = 0;
  for (int i = 0; i < iterations; ++i) count += block(i).*member;
  return count;
}

}  // namespace selenite

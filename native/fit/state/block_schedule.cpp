// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/block_schedule.h"

#include <algorithm>
#include <cstdint>

namespace selenite {

int BlockSchedule::first_lights() const {
  return kind_.lights ? std::min(options_.first_lights, iterations_ / 5) : 0;
}

bool BlockSchedule::is_scalar_block(int iteration) const {
  iteration -= first_lights();
  const std::int64_t all = iterations_ - first_lights();
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

/// Without `first`.
Block BlockSchedule::moved(int iteration) const {
  if (!kind_.alternates) return {true, kind_.has_fields, false, false};
  if (iteration < first_lights()) return {false, false, true, false};
  const bool scalars = is_scalar_block(iteration);
  return {scalars, !scalars, false, false};
}

Block BlockSchedule::block(int iteration) const {
  Block block = moved(iteration);
  block.first = kind_.alternates && (iteration == 0 || !block.moves_as(moved(iteration - 1)));
  return block;
}

int BlockSchedule::count(bool Block::*member, int iterations) const {
  int count = 0;
  for (int i = 0; i < iterations; ++i) count += block(i).*member;
  return count;
}

}  // namespace selenite

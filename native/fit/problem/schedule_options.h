// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

namespace selenite {

// Numbers of the phases that say what a fit renders and that no phase's Options hold. `schedule` and the
// phases read them here. Sources: docs/measurements/constants.md, "MultiStartOptions",
// "RefinementOptions", "FieldRefinementOptions", "AlternativeMinimaOptions".

struct MultiStartRenders {
  int size = 40;    ///< pixels of the longer side
  int points = 64;  ///< beside the start
  int first_spp = 8, step_spp = 8, final_spp = 48;
  /// After all points: so many go on, by so many steps each; beside them the start as it is and, where
  /// it is not among them, stepped like them.
  struct Round {
    int count, steps;
  };
  std::array<Round, 3> rounds{{{8, 4}, {4, 5}, {3, 6}}};
};

struct FieldRefinementRenders {
  std::array<int, 3> shares{4, 2, 1};  ///< of the samples that the passes take
  /// Of the samples of a refinement without fields that the last pass takes: the others are for the
  /// informative pixels.
  int share_of_samples = 5;
};

struct ComparisonRenders {
  int first_share = 16;     ///< of the samples, in the first round
  int least_of_round = 16;  ///< samples, where there are as many
};

/// What only a fit that has run could tell, as most do.
struct ExpectedCourse {
  /// Iterations after which the values of most fits that are refined have settled.
  /// Measured: docs/measurements/trade.md.
  int converged_after = 15;
  double informative_pixels = 0.5;  ///< share of the pixels that tell something
  /// Share of the candidates of a multi-start that stay apart where parameters are fewer than so many:
  /// the others end in the same basin. Measured: 6 sets of them on three scenes, 0.6 to 0.9.
  double distinct = 0.75;
  int few_parameters = 4;
  /// Candidates that a multi-start ends with, the untouched start among them; and those of them that it
  /// leaves for a comparison with the answer.
  double last_candidates = 4, alternatives = 2;
  double line_search_renders = 4;  ///< by which each IOR is found
  /// Candidates of a comparison before a block of scalars where a roughness is unknown: one where it is
  /// low already, else two.
  double restart_candidates = 1.5;
  double passes = 3;  ///< of a refinement
};

}  // namespace selenite

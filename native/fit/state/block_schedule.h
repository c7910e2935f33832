// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// Lengths of blocks, in iterations. Measured: docs/measurements/fields.md.
struct BlockOptions {
  int scalars = 5, fields = 5;  ///< without a multi-start; fewer in a short fit
  int cycle = 10;               ///< after one: iterations of a block of fields and one of scalars
  int scalar_tenths = 3;        ///< tenths of a cycle that step scalars
  int first_fields = 2;  ///< of voxels stepped together with scalars: Jacobians are needed to begin
  int first_texels = 6;  ///< the same of texels; then each iteration is of both
  int first_lights = 8;  ///< the same of the world's image: scalars go astray beside a wrong light
};

/// What an iteration moves: scalars and fields together, or one of them (block coordinate descent).
struct Block {
  bool scalars, fields;
  bool first;  ///< of its kind since the others moved
};

/// Which block an iteration belongs to.
///
/// Without a multi-start scalars come first: a field starts best at the one value that suits the whole
/// object. After one they are as good as they get while the voxels are alike: the fields come first,
/// and the scalars have the last block, as they are fitted to the voxels that are found. Where both are
/// stepped together, scalars that are still wrong lead voxels astray: theirs is the first whole block.
/// Texels follow scalars that move only by what a render says of both: each iteration is of both, or of
/// texels alone where a refinement follows, whose passes have the samples that scalars need beside texels.
class BlockSchedule {
 public:
  /// after_multi_start: with one colour for each field. joint: voxels are stepped together with scalars.
  struct Kind {
    bool alternates, has_fields, after_multi_start, joint, has_environment = false;
    bool has_scalars = true;
    bool together = false;      ///< of `joint`: every iteration differentiates by both
    bool texels_alone = false;  ///< of `joint`: scalars are left to the refinement
  };
  BlockSchedule(Kind kind, int iterations, BlockOptions options = {})
      : kind_(kind), iterations_(iterations), options_(options) {}

  int iterations() const { return iterations_; }
  Block block(int iteration) const;
  /// How many of the first `iterations` move what `member` says.
  int count(bool Block::*member, int iterations) const;

 private:
  bool is_scalar_block(int iteration) const;

  Kind kind_;
  int iterations_;
  BlockOptions options_;
};

}  // namespace selenite

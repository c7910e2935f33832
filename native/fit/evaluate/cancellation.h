// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/error.h"
#include "render/driver/progress.h"

namespace selenite {

/// Throws Cancelled where that has been asked for; null: nobody can. For long work between renders.
inline void throw_if_cancelled(const Progress* progress) {
  if (progress && progress->cancelled) throw Cancelled("The work was cancelled");
}

}  // namespace selenite

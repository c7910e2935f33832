// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// CPU time of all threads of this process until now. Only differences mean something.
double cpu_seconds();

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "render/film/film.h"
#include "render/film/slots.h"

namespace selenite {

struct Scene;

/// (owner, parameter)
using ParameterName = std::pair<std::string, std::string>;

/// A film with what is needed to name its derivatives.
struct NamedFilm {
  Film film;
  SlotLayout layout;
  std::vector<std::tuple<std::string, std::string, int>> unknowns;
};

/// An empty film of these derivatives. UnknownName: no such parameter.
NamedFilm film_of(const Scene& scene, const std::vector<ParameterName>& parameters);

}  // namespace selenite

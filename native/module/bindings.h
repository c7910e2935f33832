// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace selenite {

void bind_parameters(pybind11::module_& m);
void bind_scene(pybind11::module_& m);
void bind_render(pybind11::module_& m);
void bind_fit(pybind11::module_& m);
void bind_look(pybind11::module_& m);
void bind_probe(pybind11::module_& m);

}  // namespace selenite

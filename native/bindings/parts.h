// The parts of the bindings beside module.cpp.
#pragma once
#include <nanobind/nanobind.h>

void bind_fit(nanobind::module_& m);
void bind_geometry(nanobind::module_& m);
void bind_motion(nanobind::module_& m);
void bind_restore(nanobind::module_& m);

# SPDX-License-Identifier: GPL-3.0-or-later
#
# Embree as static libraries, for the packages. The headers are those of the system's Embree, so
# that the same objects are linked either way; the versions have to be the same for that.

set(static_embree_version 3.13.5)  # as in devtools/static_libraries.py
if(NOT embree_VERSION VERSION_EQUAL static_embree_version)
  message(FATAL_ERROR "The headers of Embree ${embree_VERSION} do not belong to the static library, "
    "which is ${static_embree_version}: install libembree-dev ${static_embree_version}")
endif()

add_library(selenite_static_embree INTERFACE)
get_target_property(embree_headers embree INTERFACE_INCLUDE_DIRECTORIES)
target_include_directories(selenite_static_embree SYSTEM INTERFACE "${embree_headers}")
# Each uses those behind it, and the code of an instruction set uses the first one again.
set(instruction_sets embree_sse42 embree_avx embree_avx2)
if(CMAKE_SYSTEM_NAME STREQUAL "Darwin")  # embree3 has NEON's code
  set(instruction_sets)
elseif(CMAKE_CROSSCOMPILING)  # of other platforms' processors the least one
  set(instruction_sets embree_sse42)
endif()
foreach(name IN ITEMS embree3 ${instruction_sets} embree3 lexers simd math tasking sys)
  find_library(library_${name} NAMES lib${name}.a PATHS "${SELENITE_STATIC_LIBRARIES}/lib" NO_DEFAULT_PATH REQUIRED)
  target_link_libraries(selenite_static_embree INTERFACE "${library_${name}}")
endforeach()
target_link_libraries(selenite_static_embree INTERFACE Threads::Threads ${CMAKE_DL_LIBS})

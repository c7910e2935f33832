# SPDX-License-Identifier: GPL-3.0-or-later
#
# SELENITE_ALBEDO_SOURCE: the source with the values of AlbedoTables. A program of this system writes it, whatever
# system Selenite is built for. Its sources are no part of native_sources.

set(quadrature "${PROJECT_SOURCE_DIR}/native/model/tables/quadrature")
set(writer_sources "${quadrature}/write_albedos.cpp" "${quadrature}/albedo_tables.cpp" "${quadrature}/albedo_view.cpp")
list(FILTER native_sources EXCLUDE REGEX "^${quadrature}/")
set(SELENITE_ALBEDO_SOURCE "${PROJECT_BINARY_DIR}/albedo_tables.cpp")

if(CMAKE_CROSSCOMPILING)
  find_program(SELENITE_HOST_COMPILER NAMES c++ g++ clang++ REQUIRED DOC "Compiler of programs that run here")
  set(writer "${PROJECT_BINARY_DIR}/write_albedos")
  file(GLOB_RECURSE writer_headers CONFIGURE_DEPENDS native/math/*.h native/model/*.h)
  add_custom_command(OUTPUT "${SELENITE_ALBEDO_SOURCE}"
    COMMAND "${SELENITE_HOST_COMPILER}" -std=c++20 -O2 -pthread -I "${PROJECT_SOURCE_DIR}/native"
      ${writer_sources} -o "${writer}"
    COMMAND "${writer}" "${SELENITE_ALBEDO_SOURCE}"
    DEPENDS ${writer_sources} ${writer_headers} VERBATIM)
else()
  add_executable(write_albedos ${writer_sources})
  selenite_compile_rules(write_albedos)
  target_include_directories(write_albedos PRIVATE native)
  target_link_libraries(write_albedos PRIVATE Threads::Threads)
  add_custom_command(OUTPUT "${SELENITE_ALBEDO_SOURCE}"
    COMMAND write_albedos "${SELENITE_ALBEDO_SOURCE}" DEPENDS write_albedos VERBATIM)
endif()

# SPDX-License-Identifier: GPL-3.0-or-later
#
# pybind11 modules. pybind11 comes from PyPI: the build requirement of pyproject.toml, or the
# environment of the Python that is asked for.

set(PYBIND11_FINDPYTHON ON)
find_package(Python 3.11 REQUIRED COMPONENTS Interpreter Development.Module)
if(CMAKE_CROSSCOMPILING AND WIN32)
  # An import library is taken for a static one, which would need the libraries of this system's Python.
  set_property(TARGET Python::Module PROPERTY INTERFACE_LINK_LIBRARIES "")
endif()
if(CMAKE_CROSSCOMPILING AND APPLE)
  # Its linker makes no bundles. A library of Python's is loaded as well.
  set(CMAKE_SHARED_MODULE_CREATE_CXX_FLAGS -shared)
endif()
if(NOT pybind11_DIR)
  execute_process(COMMAND "${Python_EXECUTABLE}" -m pybind11 --cmakedir
    OUTPUT_VARIABLE pybind11_DIR OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
find_package(pybind11 3 CONFIG REQUIRED)

if(SELENITE_STATIC_LIBRARIES AND CMAKE_SYSTEM_NAME STREQUAL "Linux")
  include(cmake/oldest_glibc.cmake)
endif()

# selenite_python_module(NAME LIBRARY SOURCE...): the Python module selenite.NAME over LIBRARY.
function(selenite_python_module name library)
  if(NOT ARGN)
    message(WARNING "no sources for ${name}")
    return()
  endif()
  pybind11_add_module(${name} MODULE NO_EXTRAS ${ARGN})  # no link-time optimisation: no arithmetic here
  selenite_compile_rules(${name})
  if(CMAKE_CROSSCOMPILING)  # for each Python from the start; most of the time is pybind11's headers
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
  target_link_libraries(${name} PRIVATE ${library})
  if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    # Blender's process holds other copies of these libraries: export nothing but the module's entry.
    target_link_options(${name} PRIVATE -Wl,--exclude-libs,ALL)
    if(SELENITE_STATIC_LIBRARIES)
      # The compiler's own library is inside too. Templates of it would be seen from outside.
      set(exports "${PROJECT_BINARY_DIR}/${name}.exports")
      file(WRITE "${exports}" "{ global: PyInit_${name}; local: *; };\n")
      target_link_options(${name} PRIVATE -Wl,--gc-sections -static-libstdc++ "-Wl,--version-script=${exports}")
      if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
        selenite_oldest_glibc(${name})
      endif()
    endif()
  elseif(WIN32)
    target_link_options(${name} PRIVATE -s)  # no table of symbols; the entry alone is exported, as it says so itself
  elseif(CMAKE_CROSSCOMPILING AND APPLE)
    # The C++ library's operators new and delete would be seen from outside: the module has its own.
    target_sources(${name} PRIVATE "${PROJECT_SOURCE_DIR}/cmake/own_allocation.cpp")
    target_compile_options(${name} PRIVATE -fvisibility-global-new-delete=force-hidden)
    target_link_options(${name} PRIVATE -Wl,-dead_strip)
  endif()
  install(TARGETS ${name} DESTINATION selenite COMPONENT python)
endfunction()

# SPDX-License-Identifier: GPL-3.0-or-later
#
# Compiler rules shared by all targets.

include(CheckCXXCompilerFlag)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

if(SELENITE_SANITIZE)
  # Applies to everything that is linked, GoogleTest's main included.
  add_compile_options(-fsanitize=${SELENITE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SELENITE_SANITIZE})
endif()

# Settings of every target of ours (never of a third party's).
function(selenite_compile_rules target)
  set_target_properties(${target} PROPERTIES
    LINKER_LANGUAGE CXX  # a room may hold headers only
    POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON)
  if(MSVC)
    target_compile_options(${target} PRIVATE /W4 /permissive- /utf-8 $<$<BOOL:${SELENITE_WERROR}>:/WX>)
    target_compile_definitions(${target} PRIVATE _USE_MATH_DEFINES NOMINMAX)
  else()
    # No fast-math. errno and floating-point traps are never read here; giving them up changes no value
    # and lets the compiler inline sqrt and turn selects into vector blends.
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -fno-math-errno -fno-trapping-math
      $<$<BOOL:${SELENITE_WERROR}>:-Werror>)
    if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
      # "and" of two conditions is & where eight are one mask; and what a branch for some types alone uses is captured.
      target_compile_options(${target} PRIVATE -Wno-bitwise-instead-of-logical -Wno-unused-lambda-capture)
    endif()
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
      # GCC bugs 105329 and 105651: false alarms on "text" + std::string
      target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow)
    endif()
  endif()
endfunction()

# Sources made of a template, NAME.cpp.in: NAME_SLOTS.cpp in the build tree, for each number of local derivative slots.
function(selenite_kernels result template)
  cmake_path(GET template STEM name)
  set(made)
  foreach(slots IN LISTS ARGN)
    set(source "${PROJECT_BINARY_DIR}/kernels/${name}_${slots}.cpp")
    configure_file("${template}" "${source}" @ONLY)
    list(APPEND made "${source}")
  endforeach()
  set(${result} ${made} PARENT_SCOPE)
endfunction()

# For Windows: an archive of the objects of a library `lanes`, made by the target LANES_isolated. What they define has
# names of its own there, but for those with the text `keep`.
function(selenite_isolate lanes keep result)
  find_package(Python COMPONENTS Interpreter REQUIRED)
  set(isolated "${CMAKE_CURRENT_BINARY_DIR}/lib${lanes}.a")
  add_custom_command(OUTPUT "${isolated}"
    COMMAND "${Python_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/devtools/isolate.py" --prefix avx2_
      --keep ${keep} --archive "${isolated}" $<TARGET_OBJECTS:${lanes}>
    DEPENDS ${lanes} $<TARGET_OBJECTS:${lanes}> "${PROJECT_SOURCE_DIR}/devtools/isolate.py"
    COMMAND_EXPAND_LISTS VERBATIM)
  add_custom_target(${lanes}_isolated DEPENDS "${isolated}")
  set(${result} "${isolated}" PARENT_SCOPE)
endfunction()

# The kernel that traces eight paths in lockstep, for AVX2 and FMA. It is chosen when a render starts, on
# processors that have both. Functions of headers that it shares with the rest are compiled in it as well, for AVX2, under
# the same names; the linker would keep one copy for all, and on an older processor that may be the
# wrong one. So its objects are joined to one of which nothing but the entry points is seen from outside. Windows'
# objects cannot be joined: there all that they define but the entry points is renamed (devtools/isolate.py).
# Elsewhere than with GNU's or LLVM's tools on x86-64 there are no lanes, and every path is traced alone.
function(selenite_add_lanes target)
  if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$" OR NOT CMAKE_SYSTEM_NAME MATCHES "^(Linux|Windows)$"
     OR NOT CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang" OR MSVC)
    return()
  endif()
  set(lanes ${target}_lanes)
  add_library(${lanes} OBJECT ${ARGN})
  selenite_compile_rules(${lanes})
  target_compile_options(${lanes} PRIVATE -mavx2 -mfma -mbmi2 -Wno-psabi)
  # GCC 12 and later: eight numbers are moved as such. Measured: without it a bsdf takes twice the time.
  foreach(option IN ITEMS -mmove-max=256 -mstore-max=256)
    string(MAKE_C_IDENTIFIER "SELENITE${option}" known)
    check_cxx_compiler_flag(${option} ${known})
    if(${known})
      target_compile_options(${lanes} PRIVATE ${option})
    endif()
  endforeach()
  target_include_directories(${lanes} PRIVATE $<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>)
  target_compile_definitions(${lanes} PRIVATE $<TARGET_PROPERTY:${target},COMPILE_DEFINITIONS>)
  target_compile_definitions(${target} PRIVATE SELENITE_LANES)
  if(WIN32)
    selenite_isolate(${lanes} render_tile_by_lanes isolated)
    add_dependencies(${target} ${lanes}_isolated)
    target_link_libraries(${target} INTERFACE "${isolated}")
    return()
  endif()
  set(joined "${CMAKE_CURRENT_BINARY_DIR}/${lanes}.o")
  add_custom_command(OUTPUT "${joined}"
    COMMAND "${CMAKE_LINKER}" -r --force-group-allocation -o "${joined}" $<TARGET_OBJECTS:${lanes}>
    COMMAND "${CMAKE_OBJCOPY}" --wildcard --keep-global-symbol=*render_tile_by_lanes* "${joined}"
    DEPENDS ${lanes} $<TARGET_OBJECTS:${lanes}> COMMAND_EXPAND_LISTS VERBATIM)
  set_source_files_properties("${joined}" PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  target_sources(${target} PRIVATE "${joined}")
endfunction()

# Options of the sources of model and render, and of the kernels.
# A path's functions are many and small, called once or twice each. Measured: a render takes a tenth less time if
# GCC puts them into each other beyond its limits, which are meant for code that is larger as a whole.
# All users of the model get them: the linker keeps one copy of what several have not put into its callers.
function(selenite_inline_kernels)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR SELENITE_SANITIZE)
    return()
  endif()
  foreach(source IN LISTS ARGN)
    set_property(SOURCE "${source}" APPEND PROPERTY COMPILE_OPTIONS
      --param=inline-unit-growth=1000 --param=large-function-growth=5000 --param=large-stack-frame-growth=10000
      --param=large-unit-insns=100000 --param=max-inline-insns-auto=120 --param=max-inline-insns-single=1000)
  endforeach()
endfunction()

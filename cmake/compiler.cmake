# SPDX-License-Identifier: GPL-3.0-or-later
#
# Compiler rules shared by all targets.

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
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
      # GCC bugs 105329 and 105651: false alarms on "text" + std::string
      target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow)
    endif()
  endif()
endfunction()

# A kernel file is compiled once per instruction set under its own name: kernel_avx2.cpp gets AVX2 and FMA,
# any other file the baseline. Such a file holds no STL container and keeps all it defines in a namespace named
# for the instruction set, so that the linker cannot hand its code to an older CPU (see CONTRIBUTING.md).
function(selenite_instruction_sets)
  if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    return()
  endif()
  foreach(source IN LISTS ARGN)
    if(source MATCHES "_avx2\\.cpp$")
      set_source_files_properties("${source}" PROPERTIES
        COMPILE_OPTIONS "$<IF:$<BOOL:${MSVC}>,/arch:AVX2,-mavx2;-mfma;-mbmi2>")
    endif()
  endforeach()
endfunction()

# A path's functions are many and small, called once or twice each. Measured: a render takes a tenth less time if
# GCC puts them into each other beyond its limits, which are meant for code that is larger as a whole.
# All users of the model get them: the linker keeps one copy of what several have not put into its callers.
function(selenite_inline_kernels)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR SELENITE_SANITIZE)
    return()
  endif()
  foreach(source IN LISTS ARGN)
    if(source MATCHES "/(model|render)/[^/]*\\.cpp$")
      set_property(SOURCE "${source}" APPEND PROPERTY COMPILE_OPTIONS
        --param=inline-unit-growth=1000 --param=large-function-growth=5000 --param=large-stack-frame-growth=10000
        --param=large-unit-insns=100000 --param=max-inline-insns-auto=120 --param=max-inline-insns-single=1000)
    endif()
  endforeach()
endfunction()

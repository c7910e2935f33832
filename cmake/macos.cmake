# SPDX-License-Identifier: GPL-3.0-or-later
#
# Toolchain: macOS 11 and later on Apple's processors, by the clang of ziglang. SELENITE_TOOLS is the folder of its
# programs that devtools/cross.py makes.

set(CMAKE_SYSTEM_NAME Darwin)
set(CMAKE_SYSTEM_PROCESSOR arm64)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SELENITE_TOOLS)
set(tool "${SELENITE_TOOLS}/aarch64-macos.11.0-none")
set(CMAKE_C_COMPILER "${tool}-clang")
set(CMAKE_CXX_COMPILER "${tool}-clang++")
set(CMAKE_AR "${tool}-ar" CACHE FILEPATH "")
set(CMAKE_RANLIB "${tool}-ranlib" CACHE FILEPATH "")

# There is no SDK: the compiler brings the C library's headers and names along.
set(CMAKE_OSX_SYSROOT "" CACHE PATH "")
set(CMAKE_OSX_DEPLOYMENT_TARGET "" CACHE STRING "")
set(CMAKE_SKIP_RPATH ON CACHE BOOL "")

# Libraries and headers come from the prefix of this target alone, programs from this system.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

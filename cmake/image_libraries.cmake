# SPDX-License-Identifier: GPL-3.0-or-later
#
# OpenImageIO, OpenEXR, Little CMS and zlib as one target, selenite::image_libraries.
#
# OpenImageIO's own CMake files are not used: Debian's refuse to load unless its viewer and its tools
# (and with them Qt) are installed too.

set(CMAKE_MESSAGE_LOG_LEVEL WARNING)  # Debian's Imath reports at length that PyImath is not installed
find_package(OpenEXR 3.1 REQUIRED)
unset(CMAKE_MESSAGE_LOG_LEVEL)
find_path(OPENIMAGEIO_INCLUDE_DIR OpenImageIO/imageio.h REQUIRED)
find_library(OPENIMAGEIO_LIBRARY OpenImageIO REQUIRED)
find_library(OPENIMAGEIO_UTIL_LIBRARY OpenImageIO_Util REQUIRED)
find_package(ZLIB REQUIRED)
find_path(LCMS2_INCLUDE_DIR lcms2.h REQUIRED)
find_library(LCMS2_LIBRARY lcms2 REQUIRED)

add_library(selenite_image_libraries INTERFACE)
add_library(selenite::image_libraries ALIAS selenite_image_libraries)
target_include_directories(selenite_image_libraries SYSTEM INTERFACE "${OPENIMAGEIO_INCLUDE_DIR}" "${LCMS2_INCLUDE_DIR}")
target_link_libraries(selenite_image_libraries INTERFACE
  "${OPENIMAGEIO_LIBRARY}" "${OPENIMAGEIO_UTIL_LIBRARY}" "${LCMS2_LIBRARY}" ZLIB::ZLIB OpenEXR::OpenEXR)

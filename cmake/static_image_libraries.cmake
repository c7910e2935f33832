# SPDX-License-Identifier: GPL-3.0-or-later
#
# selenite::image_libraries of static libraries, for the packages: OpenImageIO, OpenEXR, LibTIFF and
# Little CMS of ./dev package; libpng, libjpeg, zlib and Boost's thread library of the distribution. Other platforms have
# them from ./dev package too, and do without Boost's.

set(ZLIB_USE_STATIC_LIBS ON)
find_package(ZLIB REQUIRED)
foreach(package IN ITEMS Imath OpenEXR)
  find_package(${package} 3.1 CONFIG REQUIRED PATHS "${SELENITE_STATIC_LIBRARIES}" NO_DEFAULT_PATH)
endforeach()
find_path(OPENIMAGEIO_INCLUDE_DIR OpenImageIO/imageio.h
  PATHS "${SELENITE_STATIC_LIBRARIES}/include" NO_DEFAULT_PATH REQUIRED)

add_library(selenite_image_libraries INTERFACE)
add_library(selenite::image_libraries ALIAS selenite_image_libraries)
target_include_directories(selenite_image_libraries SYSTEM INTERFACE "${OPENIMAGEIO_INCLUDE_DIR}")
target_compile_definitions(selenite_image_libraries INTERFACE OIIO_STATIC_DEFINE=1)
foreach(name IN ITEMS OpenImageIO OpenImageIO_Util tiff lcms2 jpeg png16)
  find_library(library_${name} NAMES lib${name}.a PATHS "${SELENITE_STATIC_LIBRARIES}/lib" NO_DEFAULT_PATH REQUIRED)
  target_link_libraries(selenite_image_libraries INTERFACE "${library_${name}}")
endforeach()
if(CMAKE_CROSSCOMPILING)
  add_library(selenite_uncalled STATIC cmake/uncalled_by_image_files.cpp)
  target_include_directories(selenite_uncalled SYSTEM PRIVATE
    "${OPENIMAGEIO_INCLUDE_DIR}" $<TARGET_PROPERTY:Imath::Imath,INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(selenite_uncalled PRIVATE OIIO_STATIC_DEFINE=1 BOOST_THREAD_NO_LIB BOOST_THREAD_USE_LIB)
  target_compile_features(selenite_uncalled PRIVATE cxx_std_20)
  if(APPLE)  # its names are declared as seen by all, as those of the libraries were
    find_package(Python COMPONENTS Interpreter REQUIRED)
    add_custom_command(TARGET selenite_uncalled POST_BUILD VERBATIM
      COMMAND "${Python_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/devtools/mach_o.py" $<TARGET_FILE:selenite_uncalled>)
  endif()
  target_link_libraries(selenite_image_libraries INTERFACE selenite_uncalled $<$<BOOL:${WIN32}>:psapi>)
else()
  find_library(library_boost_thread NAMES libboost_thread.a REQUIRED)
  target_link_libraries(selenite_image_libraries INTERFACE "${library_boost_thread}")
endif()
target_link_libraries(selenite_image_libraries INTERFACE
  OpenEXR::OpenEXR OpenEXR::OpenEXRCore ZLIB::ZLIB Threads::Threads ${CMAKE_DL_LIBS})

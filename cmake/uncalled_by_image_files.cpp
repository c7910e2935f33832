// SPDX-License-Identifier: GPL-3.0-or-later
//
// For platforms whose linker asks for all that a library's members name, called or not: the image algorithms and
// textures that devtools/static_libraries.py leaves out of OpenImageIO, which no reader or writer of files calls, and
// Boost's data of threads, which its cache of images has.

#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/texture.h>

#include <boost/thread/tss.hpp>
#include <cstdio>
#include <cstdlib>
#include <map>

namespace {

[[noreturn]] void left_out(const char* name) {
  std::fprintf(stderr, "selenite: OpenImageIO's %s is left out of this build\n", name);
  std::abort();
}

struct ThreadDatum {
  boost::detail::thread::cleanup_caller_t caller;
  boost::detail::thread::cleanup_func_t cleanup;
  void* data;

  void end() const {
    if (cleanup && data) caller(cleanup, data);
  }
};

/// By the address of the object that it belongs to.
class ThreadData {
 public:
  ~ThreadData() {
    for (const auto& [key, datum] : data_) datum.end();
  }
  void* get(const void* key) const {
    const auto found = data_.find(key);
    return found == data_.end() ? nullptr : found->second.data;
  }
  void set(const void* key, const ThreadDatum& datum, bool end_former) {
    const auto former = data_.find(key);
    if (former != data_.end()) {
      const ThreadDatum old = former->second;
      data_.erase(former);
      if (end_former) old.end();
    }
    if (datum.data) data_.emplace(key, datum);
  }

 private:
  std::map<const void*, ThreadDatum> data_;
};

ThreadData& of_this_thread() {
  thread_local ThreadData data;
  return data;
}

}  // namespace

namespace boost::detail {

void* get_tss_data(const void* key) { return of_this_thread().get(key); }

void set_tss_data(const void* key, thread::cleanup_caller_t caller, thread::cleanup_func_t cleanup, void* data,
                  bool end_former) {
  of_this_thread().set(key, {caller, cleanup, data}, end_former);
}

}  // namespace boost::detail

OIIO_NAMESPACE_BEGIN

namespace ImageBufAlgo {

bool add(ImageBuf&, Image_or_Const, Image_or_Const, ROI, int) { left_out("add"); }
bool sub(ImageBuf&, Image_or_Const, Image_or_Const, ROI, int) { left_out("sub"); }
bool mul(ImageBuf&, Image_or_Const, Image_or_Const, ROI, int) { left_out("mul"); }
bool over(ImageBuf&, const ImageBuf&, const ImageBuf&, ROI, int) { left_out("over"); }
bool transpose(ImageBuf&, const ImageBuf&, ROI, int) { left_out("transpose"); }
bool resize(ImageBuf&, const ImageBuf&, string_view, float, ROI, int) { left_out("resize"); }

}  // namespace ImageBufAlgo

namespace pvt {

const char* texture_format_name(TexFormat) { left_out("texture_format_name"); }
const char* texture_type_name(TexFormat) { left_out("texture_type_name"); }

}  // namespace pvt

OIIO_NAMESPACE_END

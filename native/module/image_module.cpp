// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "image/file_error.h"
#include "image/limits.h"
#include "image/read.h"
#include "image/resize.h"
#include "image/working/working_size.h"
#include "image/write.h"
#include "math/fault.h"
#include "math/srgb.h"
#include "module/file_path.h"
#include "module/float_array.h"
#include "module/one_of.h"
#include "module/problem_binding.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// Text that may hold bytes of a file: what is no UTF-8 is replaced.
py::object text_of(const std::string& text) {
  PyObject* decoded =
      PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(decoded);
}

py::dict info_dict(const PictureInfo& info) {
  py::list warnings;
  for (const std::string& text : info.warnings) warnings.append(text_of(text));
  return py::dict("width"_a = info.width, "height"_a = info.height, "channels"_a = info.channels,
                  "format"_a = format_name(info.format), "bit_depth"_a = info.bit_depth,
                  "float"_a = info.is_float, "orientation"_a = info.orientation,
                  "grey"_a = info.grey, "cmyk"_a = info.cmyk, "color"_a = text_of(info.color),
                  "warnings"_a = warnings);
}

py::dict counts_dict(const PixelCounts& counts) {
  py::dict result;
  for (std::size_t i = 0; i < kPixelUses; ++i)
    result[kPixelUseNames[i]] = counts[static_cast<PixelUse>(i)];
  return result;
}

py::dict probe(const FilePath& path, bool as_linear) {
  PictureInfo info;
  {
    py::gil_scoped_release release;
    info = probe_photo(path.text, as_linear);
  }
  return info_dict(info);
}

py::tuple read_file(const FilePath& path, bool as_linear) {
  Photo photo;
  {
    py::gil_scoped_release release;
    photo = read_photo(path.text, as_linear);
  }
  const py::ssize_t w = photo.info.width, h = photo.info.height;
  py::dict info = info_dict(photo.info);
  info["counts"] = counts_dict(photo.counts);
  py::array_t<bool> usable({h, w});
  std::transform(photo.use.begin(), photo.use.end(), usable.mutable_data(),
                 [](PixelUse use) { return use == PixelUse::kCounts; });
  info["usable"] = usable;
  const py::object alpha = photo.alpha.empty()
                               ? py::object(py::none())
                               : py::object(to_array(std::move(photo.alpha), {h, w}));
  return py::make_tuple(to_array(std::move(photo.pixels), {h, w, 3}), alpha, info);
}

/// "srgb", "linear", the exponent of a power, or the rows of a table.
using ResponseArgument = std::variant<std::string, double, std::vector<std::array<double, 4>>>;

Response response_of(const ResponseArgument& argument) {
  if (const auto* rows = std::get_if<std::vector<std::array<double, 4>>>(&argument))
    return table_response(*rows);
  TransferCurve curve;
  if (const auto* exponent = std::get_if<double>(&argument)) {
    if (!(*exponent > 0) || !std::isfinite(*exponent))
      throw Refused("response", "the exponent " + std::to_string(*exponent) + " is not permitted",
                    "give a finite number above 0");
    curve = power_curve(*exponent);
  } else if (const std::string& name = std::get<std::string>(argument); name == "srgb") {
    curve = srgb_curve();
  } else if (name != "linear") {
    throw Refused("response", "'" + name + "' is not known", "give srgb or linear");
  }
  Response response;
  response.curves.assign(3, curve);
  return response;
}

/// Nothing is looked for besides where the code values that count are given.
void limit(Response& response, const std::array<double, 2>& counted) {
  const auto [lowest, highest] = counted;
  if (!(lowest < highest))
    throw Refused(
        "counted",
        "(" + std::to_string(lowest) + ", " + std::to_string(highest) + ") is not permitted",
        "give the lower code value first");
  for (CodeRange& range : response.counted)
    range = {std::max(range.lowest, lowest), std::min(range.highest, highest)};
  response.finds_clipping = false;
}

py::tuple read_small(const FilePath& path, int width, int height,
                     const std::vector<std::pair<FilePath, std::string>>& masks,
                     const std::optional<ResponseArgument>& response,
                     const std::optional<std::array<double, 2>>& counted,
                     const std::optional<py::array_t<double, py::array::c_style>>& corners,
                     const std::optional<py::array_t<bool, py::array::c_style>>& within) {
  Reading reading;
  if (within) {
    if (within->ndim() != 2 || within->shape(0) != height || within->shape(1) != width)
      throw py::value_error("within has shape " + shape_text(*within) +
                            "; it must be (height, width)");
    reading.within.assign(within->data(), within->data() + within->size());
  }
  for (const auto& [file, left_out] : masks)
    reading.masks.push_back({file.text, one_of<MaskKind>("left_out", left_out,
                                                         {{"black", MaskKind::kInclude},
                                                          {"white", MaskKind::kExclude}})});
  if (response) reading.response = response_of(*response);
  if (counted) limit(reading.response, *counted);
  if (corners) {
    if (corners->ndim() != 3 || corners->shape(0) != height + 1 || corners->shape(1) != width + 1 ||
        corners->shape(2) != 2)
      throw py::value_error("corners have shape " + shape_text(*corners) +
                            "; it must be (height + 1, width + 1, 2)");
    reading.corners.assign(corners->data(), corners->data() + corners->size());
  }
  WorkingPhoto photo;
  {
    py::gil_scoped_release release;
    photo = read_at_size(path.text, width, height, reading);
  }
  py::dict info = info_dict(photo.info);
  info["counts"] = counts_dict(photo.counts);
  info["isolated"] = photo.isolated;
  py::list mask_infos;
  for (const MaskInfo& mask : photo.masks) {
    py::dict known = info_dict(mask.info);
    known["counts"] = counts_dict(mask.counts);
    mask_infos.append(known);
  }
  return py::make_tuple(to_array(std::move(photo.reference), {height, width, 3}),
                        to_array(std::move(photo.weight), {height, width}),
                        to_array(std::move(photo.inside), {height, width}), info, mask_infos);
}

struct Shape {
  int height, width, channels;
};

Shape picture_shape(const py::array& pixels) {
  const auto n = pixels.ndim();
  if ((n != 2 && n != 3) || pixels.size() == 0)
    throw py::value_error("pixels have shape " + shape_text(pixels) +
                          "; it must be (height, width) or (height, width, channels), not empty");
  return {static_cast<int>(pixels.shape(0)), static_cast<int>(pixels.shape(1)),
          n == 3 ? static_cast<int>(pixels.shape(2)) : 1};
}

py::array resized(const py::object& object, int width, int height) {
  const FloatArray pixels = float_array(object, "pixels");
  const Shape shape = picture_shape(pixels);
  const float* data = pixels.data();
  std::vector<float> result;
  {
    py::gil_scoped_release release;
    result = resize(data, shape.width, shape.height, shape.channels, width, height);
  }
  std::vector<py::ssize_t> size{height, width};
  if (pixels.ndim() == 3) size.push_back(shape.channels);
  return to_array(std::move(result), std::move(size));
}

void save_exr(const FilePath& path, const py::object& object,
              const std::optional<std::vector<std::string>>& names) {
  const FloatArray pixels = float_array(object, "pixels");
  const Shape shape = picture_shape(pixels);
  const float* data = pixels.data();
  py::gil_scoped_release release;
  write_exr(path.text, data, shape.width, shape.height, shape.channels,
            names.value_or(std::vector<std::string>{}));
}

void save_png(const FilePath& path, const py::object& object, int bit_depth) {
  const FloatArray pixels = float_array(object, "pixels");
  const Shape shape = picture_shape(pixels);
  const float* data = pixels.data();
  py::gil_scoped_release release;
  write_png(path.text, data, shape.width, shape.height, shape.channels, bit_depth);
}

/// Applies a curve to every element; the shape stays.
template <float (*Curve)(float)>
py::array_t<float> mapped(const py::object& object) {
  const FloatArray in = float_array(object, "x");
  py::array_t<float> out(std::vector<py::ssize_t>(in.shape(), in.shape() + in.ndim()));
  const float* begin = in.data();
  const float* end = begin + in.size();
  float* to = out.mutable_data();
  {
    py::gil_scoped_release release;
    std::transform(begin, end, to, Curve);
  }
  return out;
}

}  // namespace
}  // namespace selenite

PYBIND11_MODULE(_image, m) {
  using namespace selenite;
  m.doc() =
      "Reads, resizes and writes pictures. Arrays are float32, row 0 at the top, linear light.";
  m.attr("__version__") = SELENITE_VERSION;
  m.attr("largest_picture") = kLargestPicture;  // pixels
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 fixes the signature
  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const FileError& error) {
      set_error(PyExc_OSError, error.what(), {*error.fault});
    } catch (const Refused& error) {
      set_error(PyExc_ValueError, error.what(), error.faults());
    }
  });

  bind_problem(m);
  m.def("probe", &probe, "path"_a, py::kw_only(), "as_linear"_a = true,
        R"(What the header of a picture says, without reading its pixels.

Returns:
    dict: width, height, channels (of the file, alpha included), format ("png", "jpeg", "tiff",
    "openexr", "hdr"), bit_depth, float, orientation (Exif, 1 = upright; reported, never applied),
    grey, cmyk, color (what its numbers mean), warnings (list of clauses about "it").
Raises:
    OSError: missing, none of these formats (judged by content), beyond the limits of size, camera
    raw, palette or fewer than 8 bits, Lab, deep, multilayer, colours that are not converted.)");
  m.def("read", &read_file, "path"_a, py::kw_only(), "as_linear"_a = true, R"(Reads a picture.

Colours are converted to linear Rec. 709 as the file says: colour profile (matrix and curves), Exif,
PNG's cICP, sRGB, gAMA and cHRM, OpenEXR's chromaticities, Radiance's header. Where it says nothing,
integers are sRGB and floats are linear. as_linear=False: stored values, integers divided by their
top.

Returns:
    pixels (h, w, 3) float32, linear Rec. 709, row 0 at the top, colour not multiplied by alpha;
    alpha (h, w) float32 or None; info: the dict of `probe` and usable (h, w) bool, and counts, the
    number of pixels that are used, not_finite, negative (both 0 in `pixels`), clipped,
    outside_gamut, outside_file and too_dark (see `counted` of `read_at_size`).
Raises:
    OSError: as `probe`, and for a truncated or damaged file.)");
  m.def("read_at_size", &read_small, "path"_a, "width"_a, "height"_a, py::kw_only(),
        "masks"_a = py::list(), "response"_a = py::none(), "counted"_a = py::none(),
        "corners"_a = py::none(), "within"_a = py::none(),
        R"(Reads a photo through an area filter.

Args:
    width, height: of the result, at most those of the photo.
    masks: (path, left_out) of pictures of the photo's shape and any size. left_out "black": the mean
        of its channels in [0, 1] is a weight, and a pixel of the photo has weight 0 where one below
        of the mask is 0. "white": what is at least half white does not count.
    response: how code values became of light, in place of what the file says: "srgb", "linear", the
        exponent of a power, or rows (code value, red, green, blue), linear between them.
    counted: (lowest, highest) code value that counts, 1 at the top of integers. Given, clipping is
        not looked for besides.
    corners: (height + 1, width + 1, 2) where the corners of the pixels lie in the photo, x and y in
        its pixels from its top left corner, NaN for nowhere; left out, evenly over all of it.
    within: (height, width) bool, of which pixels the warnings of clipping are; left out: of all
        that the masks leave.
Returns:
    reference (height, width, 3) float32, linear Rec. 709; weight (height, width) float32, alpha
    times masks, 0 where a photo pixel below is not usable or none is; inside (height, width) float32:
    share of the pixel where alpha and masks are not 0, 1 only where they nowhere are; info, and a list with one for each mask: dicts of `probe`
    with counts as in `read`.
Raises:
    OSError: as `read`, for photo or mask. ValueError: an argument out of range.)");
  m.def(
      "resize", &resized, "pixels"_a, "width"_a, "height"_a,
      R"(Area filter in linear light: each new pixel is the exact mean over the rectangle it covers.

Args:
    pixels: (h, w, c) or (h, w) float32.
Returns:
    (height, width, c) or (height, width) float32; its mean is that of `pixels`.
Raises:
    ValueError: empty, wrong type, or a size below 1 or above 100 megapixels.)");
  m.def("write_exr", &save_exr, "path"_a, "pixels"_a, "channel_names"_a = py::none(),
        R"(Writes float32 OpenEXR under a temporary name, then renames.

Args:
    pixels: (h, w, c) or (h, w) float32, linear.
    channel_names: c different names; left out: R G B, R G B A, or Y.
Raises:
    OSError: the file cannot be written. ValueError: shape or names.)");
  m.def("write_png", &save_png, "path"_a, "pixels"_a, "bit_depth"_a = 8,
        R"(Writes PNG with the sRGB curve and no metadata under a temporary name, then renames.

Args:
    pixels: (h, w, 3) or (h, w) float32, linear; cut to [0, 1], NaN becomes 0.
    bit_depth: 8 or 16.
Raises:
    OSError: the file cannot be written. ValueError: shape or bit depth.)");
  m.def("srgb_encode", &mapped<srgb_encode>, "x"_a,
        "Linear light to display value (IEC 61966-2-1), float32 array of any shape.");
  m.def("srgb_decode", &mapped<srgb_decode>, "x"_a,
        "Display value to linear light (IEC 61966-2-1), float32 array of any shape.");
}

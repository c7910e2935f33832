// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/color/icc_profile.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string_view>

#include "image/file_error.h"
#include "image/header/file_view.h"
#include "math/fault.h"

namespace selenite {
namespace {

constexpr const char* kCure = "convert the picture to sRGB when you export it";

struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct DeleteContext {
  void operator()(cmsContext context) const { cmsDeleteContext(context); }
};

std::string name_of(cmsHPROFILE profile) {
  std::array<char, 256> text{};
  cmsGetProfileInfoASCII(profile, cmsInfoDescription, "en", "US", text.data(),
                         static_cast<cmsUInt32Number>(text.size() - 1));
  std::string name = text.data();
  // The name ends in messages: no control characters, nothing that is not ASCII.
  std::erase_if(name, [](char c) { return c < ' ' || c > '~' || c == '\''; });
  return name.empty() ? "without a name" : name;
}

/// "Lab ", "CMYK": the four characters of a signature.
std::string signature(cmsUInt32Number value) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) {
    const char c = static_cast<char>(value >> shift & 255);
    if (c > ' ' && c <= '~') text += c;
  }
  return text;
}

TransferCurve curve_of(cmsHPROFILE profile, cmsTagSignature tag) {
  const auto* found = static_cast<const cmsToneCurve*>(cmsReadTag(profile, tag));
  if (found == nullptr) throw Refused("", "lacks the curve " + signature(tag));
  if (cmsIsToneCurveLinear(found)) return {};
  const std::shared_ptr<cmsToneCurve> kept(cmsDupToneCurve(found), cmsFreeToneCurve);
  if (!kept) throw Refused("", "has a curve that cannot be read");
  TransferCurve curve{[kept](double value) {
    return static_cast<double>(cmsEvalToneCurveFloat(kept.get(), static_cast<float>(value)));
  }};
  if (cmsGetToneCurveParametricType(found) == 0) curve.highest = 1;  // a table
  return curve;
}

Matrix3 matrix_of(cmsHPROFILE profile) {
  Matrix3 to_connection{};
  const std::array tags{cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto* xyz = static_cast<const cmsCIEXYZ*>(cmsReadTag(profile, tags[c]));
    if (xyz == nullptr) throw Refused("", "lacks the colour " + signature(tags[c]));
    to_connection[0][c] = xyz->X;
    to_connection[1][c] = xyz->Y;
    to_connection[2][c] = xyz->Z;
  }
  inverse(to_connection);  // throws where colours would collapse
  return product(rec709_of_connection_space(), to_connection);
}

/// Why the profile is not converted; empty if it is.
std::string obstacle(cmsHPROFILE profile) {
  const cmsColorSpaceSignature colors = cmsGetColorSpace(profile);
  if (colors != cmsSigRgbData && colors != cmsSigGrayData)
    return "is for " + signature(colors) + " pictures";
  if (cmsGetPCS(profile) != cmsSigXYZData)
    return "connects by " + signature(cmsGetPCS(profile)) + " instead of a matrix";
  for (const cmsTagSignature tag : {cmsSigAToB0Tag, cmsSigAToB1Tag, cmsSigAToB2Tag, cmsSigDToB0Tag,
                                    cmsSigDToB1Tag, cmsSigDToB2Tag, cmsSigDToB3Tag})
    if (cmsIsTag(profile, tag)) return "maps colours by a table (" + signature(tag) + ")";
  constexpr auto kCodePoints = static_cast<cmsTagSignature>(0x63696370);  // 'cicp' of ICC 4.4
  std::array<unsigned char, 12> code{};
  constexpr unsigned char kPq = 16, kHlg = 18;  // ITU-T H.273
  if (cmsReadRawTag(profile, kCodePoints, code.data(), code.size()) == code.size() &&
      (code[9] == kPq || code[9] == kHlg))
    return code[9] == kPq ? "is for HDR video (PQ)" : "is for HDR video (HLG)";
  return {};
}

/// Big-endian number; nothing behind the end.
std::optional<std::uint64_t> number_at(std::string_view bytes, std::uint64_t at, int size) {
  if (at > bytes.size() || bytes.size() - at < static_cast<std::uint64_t>(size))
    return std::nullopt;
  return whole_number(bytes.data() + at, size, true);
}

/// Whether texts lie inside their tag. Source: ICC.1:2022, 10.15 (mluc), 10.24 (text).
bool is_sound(std::string_view tag) {
  const std::string_view type = tag.substr(0, 4);
  constexpr std::size_t kText = 8, kDescription = 12;
  if (type == "text") return tag.size() >= kText;
  if (type == "desc") return tag.size() >= kDescription;
  if (type != "mluc") return true;
  constexpr std::uint64_t kFirst = 16, kRecord = 12;
  const auto count = number_at(tag, 8, 4), size = number_at(tag, 12, 4);
  if (!count || size != kRecord || *count > tag.size()) return false;
  for (std::uint64_t i = 0; i < *count; ++i) {
    const auto length = number_at(tag, kFirst + i * kRecord + 4, 4);
    const auto offset = number_at(tag, kFirst + i * kRecord + 8, 4);
    if (!length || !offset || *offset + *length > tag.size()) return false;
  }
  return true;
}

}  // namespace

void check_icc_layout(const std::string& path, const std::string& bytes) {
  constexpr std::uint64_t kHeader = 128, kEntry = 12, kSmallestTag = 4;
  const std::string_view all = bytes;
  const auto count = number_at(all, kHeader, 4);
  bool sound = count && *count <= all.size();
  for (std::uint64_t i = 0; sound && i < *count; ++i) {
    const std::uint64_t entry = kHeader + 4 + i * kEntry;
    const auto offset = number_at(all, entry + 4, 4), size = number_at(all, entry + 8, 4);
    sound = offset && size && *size >= kSmallestTag && *offset + *size <= all.size() &&
            is_sound(all.substr(*offset, *size));
  }
  if (!sound) refuse(path, "has a colour profile that is damaged", kCure);
}

IccProfile read_icc_profile(const std::string& path, const std::string& bytes) {
  // A context of its own: what other libraries in this process set is theirs.
  const std::unique_ptr<std::remove_pointer_t<cmsContext>, DeleteContext> context(
      cmsCreateContext(nullptr, nullptr));
  const std::unique_ptr<void, CloseProfile> profile(cmsOpenProfileFromMemTHR(
      context.get(), bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
  if (!profile) refuse(path, "has a colour profile that is damaged", kCure);
  IccProfile result;
  result.name = name_of(profile.get());
  const std::string has = "has the colour profile '" + result.name + "', which ";
  if (const std::string why = obstacle(profile.get()); !why.empty())
    refuse(path, has + why + "; such profiles are not converted", kCure);
  try {
    result.grey = cmsGetColorSpace(profile.get()) == cmsSigGrayData;
    if (result.grey) {
      result.curves.fill(curve_of(profile.get(), cmsSigGrayTRCTag));
    } else {
      result.curves = {curve_of(profile.get(), cmsSigRedTRCTag),
                       curve_of(profile.get(), cmsSigGreenTRCTag),
                       curve_of(profile.get(), cmsSigBlueTRCTag)};
      result.to_rec709 = matrix_of(profile.get());
    }
  } catch (const InvalidArgument& error) {
    refuse(path, has + error.what(), kCure);
  }
  return result;
}

}  // namespace selenite

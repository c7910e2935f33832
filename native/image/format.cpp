// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/format.h"

#include <array>
#include <fstream>
#include <string_view>

#include "image/file_error.h"

namespace selenite {
namespace {

using namespace std::string_view_literals;

struct Magic {
  std::string_view bytes;
  FileFormat format;
};

constexpr std::array kMagic{
    Magic{"\x89PNG\r\n\x1a\n"sv, FileFormat::kPng},
    Magic{"\xff\xd8\xff"sv, FileFormat::kJpeg},
    Magic{"II*\0"sv, FileFormat::kTiff},
    Magic{"MM\0*"sv, FileFormat::kTiff},
    Magic{"II+\0"sv, FileFormat::kTiff},
    Magic{"MM\0+"sv, FileFormat::kTiff},
    Magic{"v/1\x01"sv, FileFormat::kExr},
    Magic{"#?RADIANCE"sv, FileFormat::kHdr},
    Magic{"#?RGBE"sv, FileFormat::kHdr},
};
constexpr std::size_t kSecondAt = 8;  // where a second signature stands

struct Reason {
  const char *cause, *cure;
};
/// Files that begin in a known way and are not read, with their name and how to read them.
struct Refused {
  std::string_view bytes, second;
  const Reason& why;
};
constexpr Reason kRaw{
    "is a camera raw file",
    "develop it in a raw developer, without a tone curve, to a 16-bit TIFF or an EXR"};
constexpr Reason kHeif{"is a HEIF or AVIF picture", "convert it to a 16-bit TIFF or PNG"};
constexpr std::array kRefused{
    Refused{"II*\0"sv, "CR"sv, kRaw},
    Refused{"MM\0*"sv, "CR"sv, kRaw},
    Refused{"IIRO"sv, ""sv, kRaw},
    Refused{"IIRS"sv, ""sv, kRaw},
    Refused{"MMOR"sv, ""sv, kRaw},
    Refused{"IIU\0"sv, ""sv, kRaw},
    Refused{"FUJIFILMCCD-RAW"sv, ""sv, kRaw},
    Refused{"FOVb"sv, ""sv, kRaw},
    Refused{"\0MRM"sv, ""sv, kRaw},
};
constexpr std::string_view kIsoMedia = "ftyp";  // behind the size of the first box
constexpr std::size_t kIsoMediaAt = 4;

/// Why a file with this beginning is not read; nothing if it may be.
const Reason* refusal(std::string_view head) {
  for (const Refused& item : kRefused)
    if (head.starts_with(item.bytes) &&
        (item.second.empty() ||
         (head.size() > kSecondAt && head.substr(kSecondAt).starts_with(item.second))))
      return &item.why;
  if (head.size() > kSecondAt && head.substr(kIsoMediaAt).starts_with(kIsoMedia))
    return head.substr(kSecondAt).starts_with("crx") ? &kRaw : &kHeif;
  return nullptr;
}

}  // namespace

const char* format_name(FileFormat format) {
  switch (format) {
    case FileFormat::kPng:
      return "png";
    case FileFormat::kJpeg:
      return "jpeg";
    case FileFormat::kTiff:
      return "tiff";
    case FileFormat::kExr:
      return "openexr";
    default:
      return "hdr";
  }
}

FileFormat recognise(const std::string& path) {
  const std::filesystem::path file = path_from_utf8(path);
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) refuse(path, "does not exist", "choose the photo again");
  if (!std::filesystem::is_regular_file(status))  // a pipe would hang, a folder has no bytes
    refuse(path, "is not a file", "choose a photo");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) refuse(path, "cannot be opened", "check its permissions");
  std::array<char, 32> bytes{};
  stream.read(bytes.data(), bytes.size());
  const std::string_view head(bytes.data(), static_cast<std::size_t>(stream.gcount()));
  if (head.empty()) refuse(path, "is empty", "copy the photo again");
  if (const Reason* why = refusal(head)) refuse(path, why->cause, why->cure);
  for (const Magic& magic : kMagic)
    if (head.starts_with(magic.bytes)) return magic.format;
  refuse(path,
         "holds no PNG, JPEG, TIFF, OpenEXR or Radiance HDR picture (judged by its content, not by "
         "its name)",
         "convert it to one of these");
}

}  // namespace selenite

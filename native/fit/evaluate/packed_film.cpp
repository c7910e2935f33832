// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/packed_film.h"

#include <algorithm>
#include <cstring>

#include "fit/evaluate/headed_bytes.h"
#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

/// Sparse: black pixels take a bit, as those of derivatives beside the object.
enum class Packing : std::uint8_t {
  kEmpty,
  kConstant,
  kMasked,
  kMaskedSparse,
  kWhole,
  kWholeSparse
};

constexpr std::size_t kSparse = 16;  ///< from a black pixel in so many on

[[noreturn]] void damaged() {
  throw Refused("", "A message between a fit and its workers is damaged or of another version", "");
}

bool same_bits(const Colorf& a, const Colorf& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// What a film has beside its pictures.
struct Header {
  int width = 0, height = 0, spp = 0, lanes = 1;
  std::int64_t dropped = 0, truncated = 0, vertices = 0, exits = 0, slots = 0;
  std::string first_dropped;
  double seconds = 0, cpu_seconds = 0;
  std::vector<Packing> packings;
  std::vector<Colorf> others;      ///< what pixels hold that are not packed, of each picture
  std::vector<std::string> black;  ///< which are, of each sparse picture: eight in a byte

  void members(SavedState& state) {
    state(width, height, spp, lanes, dropped, truncated, vertices, exits, slots, first_dropped,
          seconds, cpu_seconds, packings, others, black);
  }
};

template <class FilmType, class Visit>
void visit_pictures(FilmType& film, const Visit& visit) {
  visit(film.mean);
  visit(film.half_a);
  visit(film.variance);
  visit(film.aim_excess);
  for (auto& slot : film.slots) {
    visit(slot.mean);
    visit(slot.half_a);
    visit(slot.variance);
    visit(slot.covariance);
    visit(slot.aim_excess);
    visit(slot.direct);
    visit(slot.direct_half_a);
  }
}

bool is_black(const Colorf& pixel) { return same_bits(pixel, Colorf(0.f)); }

bool is_masked(Packing packing) {
  return packing == Packing::kMasked || packing == Packing::kMaskedSparse;
}

bool is_sparse(Packing packing) {
  return packing == Packing::kMaskedSparse || packing == Packing::kWholeSparse;
}

/// How a picture is packed; `other`: what it holds outside the mask.
Packing packing_of(const Picture& picture, const PixelMask* pixels, Colorf& other) {
  if (picture.empty()) return Packing::kEmpty;
  bool constant = true, masked = pixels != nullptr && pixels->size() == picture.size();
  const Colorf* outside = nullptr;
  std::size_t black = 0, black_inside = 0, inside = 0;
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const bool is = is_black(picture[i]);
    constant = constant && same_bits(picture[i], picture[0]);
    black += is;
    if (!masked) continue;
    if ((*pixels)[i]) {
      ++inside;
      black_inside += is;
      continue;
    }
    if (outside == nullptr) outside = &picture[i];
    masked = same_bits(picture[i], *outside);
  }
  other = constant || outside == nullptr ? picture[0] : *outside;
  if (constant) return Packing::kConstant;
  if (masked) return kSparse * black_inside > inside ? Packing::kMaskedSparse : Packing::kMasked;
  return kSparse * black > picture.size() ? Packing::kWholeSparse : Packing::kWhole;
}

/// Calls visit(pixel) for those that are packed.
template <class PictureType, class Visit>
void visit_pixels(PictureType& picture, const PixelMask* mask, const Visit& visit) {
  for (std::size_t i = 0; i < picture.size(); ++i)
    if (mask == nullptr || (*mask)[i]) visit(picture[i]);
}

void append(const void* data, std::size_t size, std::string& to) {
  to.append(static_cast<const char*>(data), size);
}

}  // namespace

std::string bits_of(const PixelMask& mask) {
  std::string bits((mask.size() + 7) / 8, '\0');
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i]) bits[i / 8] = static_cast<char>(bits[i / 8] | (1 << (i % 8)));
  return bits;
}

PixelMask mask_of(const std::string& bits, std::size_t count) {
  if (bits.size() != (count + 7) / 8) damaged();
  PixelMask mask(count);
  for (std::size_t i = 0; i < count; ++i) mask[i] = (bits[i / 8] >> (i % 8)) & 1;
  return mask;
}

std::string packed(const Film& film, const PixelMask* pixels) {
  Header header{film.width,
                film.height,
                film.spp,
                film.lanes,
                film.dropped,
                film.truncated,
                film.vertices,
                film.exits,
                std::ssize(film.slots),
                film.first_dropped,
                film.seconds,
                film.cpu_seconds,
                {},
                {},
                {}};
  std::string body;
  visit_pictures(film, [&](const Picture& picture) {
    Colorf other(0.f);
    const Packing packing = packing_of(picture, pixels, other);
    header.packings.push_back(packing);
    header.others.push_back(other);
    if (packing == Packing::kEmpty || packing == Packing::kConstant) return;
    if (packing == Packing::kWhole) {
      append(picture.data(), picture.size() * sizeof(Colorf), body);
      return;
    }
    const PixelMask* mask = is_masked(packing) ? pixels : nullptr;
    PixelMask black;
    visit_pixels(picture, mask, [&](const Colorf& pixel) {
      const bool omitted = is_sparse(packing) && is_black(pixel);
      black.push_back(omitted ? 1 : 0);
      if (!omitted) append(&pixel, sizeof pixel, body);
    });
    if (is_sparse(packing)) header.black.push_back(bits_of(black));
  });
  SavedState state;
  state(header);
  return headed(state.sealed(), body);
}

Film unpacked_film(std::string_view bytes, const PixelMask* pixels) {
  SavedState state(take_head(bytes));
  Header header;
  state(header);
  state.expect_end();
  if (header.width < 1 || header.height < 1 || header.slots < 0) damaged();
  const std::size_t count = static_cast<std::size_t>(header.width) * header.height;
  if (pixels != nullptr && pixels->size() != count) damaged();
  Film film;
  film.width = header.width;
  film.height = header.height;
  film.spp = header.spp;
  film.lanes = header.lanes;
  film.dropped = header.dropped;
  film.truncated = header.truncated;
  film.vertices = header.vertices;
  film.exits = header.exits;
  film.first_dropped = std::move(header.first_dropped);
  film.seconds = header.seconds;
  film.cpu_seconds = header.cpu_seconds;
  if (header.packings.size() < static_cast<std::size_t>(header.slots)) damaged();
  film.slots.resize(static_cast<std::size_t>(header.slots));
  const auto take = [&](Colorf* to, std::size_t pixel_count) {
    const std::size_t wanted = pixel_count * sizeof(Colorf);
    if (wanted > bytes.size()) damaged();
    std::memcpy(static_cast<void*>(to), bytes.data(), wanted);
    bytes.remove_prefix(wanted);
  };
  std::size_t next = 0, next_sparse = 0;
  visit_pictures(film, [&](Picture& picture) {
    if (next >= header.packings.size() || next >= header.others.size()) damaged();
    const Packing packing = header.packings[next];
    const Colorf other = header.others[next++];
    if (packing == Packing::kEmpty) return;
    picture.assign(count, other);
    if (packing == Packing::kConstant) return;
    if (packing == Packing::kWhole) {
      take(picture.data(), count);
      return;
    }
    if (is_masked(packing) && pixels == nullptr) damaged();
    const PixelMask* mask = is_masked(packing) ? pixels : nullptr;
    PixelMask black;
    if (is_sparse(packing)) {
      if (next_sparse == header.black.size()) damaged();
      const auto listed = mask ? std::ranges::count_if(*mask, [](auto one) { return one != 0; })
                               : static_cast<std::ptrdiff_t>(count);
      black = mask_of(header.black[next_sparse++], static_cast<std::size_t>(listed));
    }
    std::size_t pixel_number = 0;
    visit_pixels(picture, mask, [&](Colorf& pixel) {
      if (is_sparse(packing) && black[pixel_number++] != 0)
        pixel = Colorf(0.f);
      else
        take(&pixel, 1);
    });
  });
  if (next != header.packings.size() || next_sparse != header.black.size() || !bytes.empty())
    damaged();
  return film;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/packed_film.h"

#include <cstring>

#include "fit/evaluate/headed_bytes.h"
#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

enum class Packing : std::uint8_t { kEmpty, kConstant, kMasked, kWhole };

[[noreturn]] void damaged() {
  throw Refused("", "The picture of a worker is damaged or of another version", "");
}

bool same_bits(const Colorf& a, const Colorf& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// What a film has beside its pictures.
struct Header {
  int width = 0, height = 0, spp = 0, lanes = 1;
  std::int64_t dropped = 0, truncated = 0, vertices = 0, exits = 0, slots = 0;
  std::string first_dropped;
  double seconds = 0, cpu_seconds = 0;
  std::vector<Packing> packings;
  std::vector<Colorf> others;  ///< what pixels hold that are not packed, of each picture

  void members(SavedState& state) {
    state(width, height, spp, lanes, dropped, truncated, vertices, exits, slots, first_dropped,
          seconds, cpu_seconds, packings, others);
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

/// How a picture is packed; `other`: what it holds outside the mask.
Packing packing_of(const Picture& picture, const PixelMask* pixels, Colorf& other) {
  if (picture.empty()) return Packing::kEmpty;
  bool constant = true, masked = pixels != nullptr && pixels->size() == picture.size();
  const Colorf* outside = nullptr;
  for (std::size_t i = 0; i < picture.size() && (constant || masked); ++i) {
    constant = constant && same_bits(picture[i], picture[0]);
    if (!masked || (*pixels)[i]) continue;
    if (outside == nullptr) outside = &picture[i];
    masked = same_bits(picture[i], *outside);
  }
  other = constant || outside == nullptr ? picture[0] : *outside;
  return constant ? Packing::kConstant : masked ? Packing::kMasked : Packing::kWhole;
}

void append(const void* data, std::size_t size, std::string& to) {
  to.append(static_cast<const char*>(data), size);
}

}  // namespace

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
                {}};
  std::string body;
  visit_pictures(film, [&](const Picture& picture) {
    Colorf other(0.f);
    const Packing packing = packing_of(picture, pixels, other);
    header.packings.push_back(packing);
    header.others.push_back(other);
    if (packing == Packing::kWhole) append(picture.data(), picture.size() * sizeof(Colorf), body);
    if (packing != Packing::kMasked) return;
    for (std::size_t i = 0; i < picture.size(); ++i)
      if ((*pixels)[i]) append(&picture[i], sizeof(Colorf), body);
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
  std::size_t next = 0;
  visit_pictures(film, [&](Picture& picture) {
    if (next >= header.packings.size() || next >= header.others.size()) damaged();
    const Packing packing = header.packings[next];
    const Colorf other = header.others[next++];
    if (packing == Packing::kEmpty) return;
    picture.assign(count, other);
    if (packing == Packing::kWhole) take(picture.data(), count);
    if (packing != Packing::kMasked) return;
    if (pixels == nullptr) damaged();
    for (std::size_t i = 0; i < count; ++i)
      if ((*pixels)[i]) take(&picture[i], 1);
  });
  if (next != header.packings.size() || !bytes.empty()) damaged();
  return film;
}

}  // namespace selenite

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/photo_question.h"

#include <utility>

#include "fit/evaluate/headed_bytes.h"
#include "fit/evaluate/packed_film.h"
#include "fit/evaluate/rendered_pixels.h"

namespace selenite {
namespace {

constexpr double kTooManyDropped = 1e-3;  ///< share of the samples

/// Member by member: the gaps between them hold anything, and equal questions have equal bytes.
void members_of(Evaluation& how, SavedState& state) {
  bool derivatives = how.derivatives.has_value();
  state(how.spp, how.seed, how.purpose, how.halves, how.all_pictures, derivatives);
  if (!derivatives) return;
  if (state.reading()) how.derivatives.emplace();
  Differences& which = *how.derivatives;
  state(which.side, which.of_roughness, which.first, which.every, which.roughnesses,
        which.refractions, which.picture, which.direct);
}

}  // namespace

void RenderCounts::add(const Film& film, const Photo& photo) {
  samples += static_cast<std::int64_t>(rendered_count(photo)) * film.spp;
  dropped += film.dropped;
  cpu_seconds += film.cpu_seconds;
  if (film.dropped > 0 && first_dropped.empty()) first_dropped = film.first_dropped;
}

void RenderCounts::add(const RenderCounts& other) {
  samples += other.samples;
  dropped += other.dropped;
  cpu_seconds += other.cpu_seconds;
  if (first_dropped.empty()) first_dropped = other.first_dropped;
}

bool RenderCounts::too_many_dropped() const {
  return static_cast<double>(dropped) > kTooManyDropped * static_cast<double>(samples);
}

std::string RenderCounts::dropped_text() const {
  return std::to_string(dropped) + " of " + std::to_string(samples) +
         " samples were not finite and left out; first: " + first_dropped +
         ". Check the scene for extreme values";
}

void PhotoQuestion::members(SavedState& state) {
  state(point, photo, width, height, frame, alignment, aims);
  members_of(how, state);
  std::string bits = pixels ? bits_of(*pixels) : std::string();
  state(bits);
  if (!state.reading()) return;
  if (width < 1 || height < 1) throw Refused("", "A question asks for a picture of no size", "");
  if (!bits.empty())
    pixels = std::make_shared<const PixelMask>(
        mask_of(bits, static_cast<std::size_t>(width) * static_cast<std::size_t>(height)));
}

std::string PhotoQuestion::bytes() {
  SavedState state;
  members(state);
  return state.sealed();
}

PhotoQuestion PhotoQuestion::of(std::string_view bytes) {
  SavedState state(bytes);
  PhotoQuestion question;
  question.members(state);
  state.expect_end();
  return question;
}

std::string PhotoAnswer::bytes(const PixelMask* pixels) {
  SavedState state;
  state(counts);
  return headed(state.sealed(), packed(film, pixels));
}

PhotoAnswer PhotoAnswer::of(std::string_view bytes, const PixelMask* pixels) {
  SavedState state(take_head(bytes));
  PhotoAnswer answer;
  state(answer.counts);
  state.expect_end();
  answer.film = unpacked_film(bytes, pixels);
  return answer;
}

}  // namespace selenite

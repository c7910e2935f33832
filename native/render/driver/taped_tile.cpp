// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/taped_tile.h"

#include "render/film/pixel_sums.h"
#include "render/path/camera_samples.h"
#include "render/path/path_tracer.h"

namespace selenite {
namespace {

/// The weight of sample i in the derivative of a pixel's loss; see `render_field_gradient`.
Colorf sample_weight(const PixelSlope& pixel, const Colorf& sample, const Colorf& mean, int n) {
  const auto count = static_cast<float>(n);
  Colorf weight = pixel.slope / count;
  if (n > 1) weight = weight - pixel.curvature * (sample - mean) / (count * (count - 1));
  return weight;
}

template <class Sink>
void spread(const PlacedGrid& grid, const Vec3f& position, const Colorf& derivative, Sink&& sink) {
  grid.spread(position, derivative, sink);
}
template <class Sink>
void spread(const Texture& image, const Vec3f& position, const Colorf& derivative, Sink&& sink) {
  image.spread({position.x, position.y}, derivative, sink);
}

template <class Sink>
void spread(const EnvironmentMap& image, const Vec3f& direction, const Colorf& derivative,
            Sink&& sink) {
  image.spread(direction, derivative, sink);
}

/// Adds the derivative by what was looked up in a field at a position.
void add(const Field& field, const Vec3f& position, const Colorf& derivative, SparseGradient& to) {
  const auto sink = [&](std::uint32_t place, const Colorf& part) { to.add(place, part); };
  std::visit([&](const auto* one) { spread(*one, position, derivative, sink); }, field);
}

bool is_zero(const Colorf& c) { return c.r == 0 && c.g == 0 && c.b == 0; }

}  // namespace

TileReport render_taped_tile(const Prepared<kTaped>& prepared, const PixelCamera& camera,
                             const RenderSettings& settings, const Tile& tile,
                             const TapedWork& work, Film& film,
                             std::vector<SparseGradient>& gradients) {
  TileReport report;
  PathTracer<kTaped> tracer(prepared, settings.depth, camera);
  const int n = settings.spp;
  std::vector<Tape> tapes(n);
  std::vector<Colorf> samples(n);

  for (int y = tile.y0; y < tile.y1; ++y) {
    CameraSamples camera_samples(prepared, camera, settings, y, tile.x0, tile.x1);
    for (int x = tile.x0; x < tile.x1; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * settings.width + x;
      if (!settings.has(pixel)) continue;
      PixelSums image;
      SlotSums shift;
      for (int i = 0; i < n; ++i) {
        auto& [random, ray, hit] = camera_samples.next();
        const Radiance<kTaped> radiance = tracer.trace(ray, hit, random);
        report.truncated += tracer.truncated;
        std::swap(tapes[i], tracer.tape);
        samples[i] = radiance.value;
        Colorf slope = radiance.slope[0];
        if (!is_finite(radiance.value) || !is_finite(radiance.slope[0])) {
          // Counted as a sample of zero: the pixel stays finite and the report says so.
          samples[i] = slope = Colorf();
          tapes[i].clear();
          if (report.dropped++ == 0)
            report.first_dropped = "pixel (" + std::to_string(x) + ", " + std::to_string(y) +
                                   "), sample " + std::to_string(i) + ", derivative by a field";
        }
        image.add(samples[i], i % 2 == 0);
        shift.add(slope, samples[i], i % 2 == 0);
      }
      image.write(film, pixel, n);
      if (!film.slots.empty()) shift.write(film.slots[0], pixel, n, image.sum);
      if (!work.loss) continue;
      const PixelSlope slope = work.loss(pixel, film);
      if (is_zero(slope.slope) && is_zero(slope.curvature)) continue;
      const int cell =
          (y - tile.y0) / work.cell * cells_across(work.cell) + (x - tile.x0) / work.cell;
      SparseGradient* const of_cell =
          &gradients[static_cast<std::size_t>(cell) * work.fields.size()];
      for (int i = 0; i < n; ++i) {
        if (tapes[i].empty()) continue;
        tapes[i].sweep(sample_weight(slope, samples[i], film.mean[pixel], n),
                       [&](int field, const Vec3f& position, const Colorf& derivative) {
                         add(work.fields[field], position, derivative, of_cell[field]);
                       });
      }
    }
  }
  return report;
}

}  // namespace selenite

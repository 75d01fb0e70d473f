#include "worker/surface/texture_lookup.h"

#include <algorithm>
#include <cmath>

#include "worker/surface/texel_kernels.h"

namespace baton {
namespace {

/// Images in one call of the kernel.
constexpr std::size_t kMostTogether = 8;

float length2(const std::array<float, 2>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1]); }

/// As many probes along the longer side of a footprint as are as wide as the shorter one.
ProbeLine probe_line(const Texture& image, std::array<float, 2> uv, const Footprint& footprint) {
  const std::span<const TextureLevel> levels = image.levels();
  // The footprint in texels.
  const auto w = static_cast<float>(image.width()), h = static_cast<float>(image.height());
  const float size_a = length2({footprint.a[0] * w, footprint.a[1] * h});
  const float size_b = length2({footprint.b[0] * w, footprint.b[1] * h});
  const bool along_a = !(size_b > size_a);
  const float longer = along_a ? size_a : size_b, shorter = along_a ? size_b : size_a;

  ProbeLine line{.middle = uv, .fine = levels.front(), .coarse = levels.front()};
  if (!(longer > 1)) return line;
  line.is_smaller = true;
  if (!std::isfinite(longer)) {
    line.fine = line.coarse = levels.back();
    return line;
  }
  const float probes =
      std::ceil(std::min(longer / std::max(shorter, 1.0f), static_cast<float>(kMostProbes)));
  const float last = static_cast<float>(image.num_levels() - 1);
  const float level = std::min(std::log2(std::max(longer / probes, std::max(shorter, 1.0f))), last);
  const float below = std::floor(level);
  const auto fine = static_cast<std::size_t>(below);
  line.along = along_a ? footprint.a : footprint.b;
  line.num_probes = static_cast<int>(probes);
  line.fine = levels[fine];
  line.coarse = levels[std::min(fine + 1, levels.size() - 1)];
  line.blend = level - below;
  return line;
}

}  // namespace

std::array<float, 4> look_up(const Texture& image, std::array<float, 2> uv,
                             const Footprint& footprint, const TextureSampling& sampling) {
  std::array<float, 4> mean;
  const Texture* const only = &image;
  look_up_together({&only, 1}, uv, footprint, sampling, {&mean, 1});
  return mean;
}

void look_up_together(std::span<const Texture* const> images, std::array<float, 2> uv,
                      const Footprint& footprint, const TextureSampling& sampling,
                      std::span<std::array<float, 4>> means) {
  std::array<TexelArray, kMostTogether> texels;
  for (std::size_t first = 0, end = 0; first < images.size(); first = end) {
    while (end < images.size() && end - first < kMostTogether &&
           images[end]->has_size_of(*images[first])) {
      texels[end - first] = images[end]->texels();
      ++end;
    }
    kernels::blend_texels(probe_line(*images[first], uv, footprint), sampling,
                          std::span(texels).first(end - first), means.subspan(first, end - first));
  }
}

}  // namespace baton

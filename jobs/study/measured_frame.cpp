#include "jobs/study/measured_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/image/contact_sheet.h"
#include "common/image/noise.h"
#include "jobs/study/flip.h"

namespace baton {
namespace {

/// A plane by its name; empty when there is none.
std::vector<float> plane(const FilmTile& film, const std::string& name) {
  const float* const begin = film.find(name);
  if (begin == nullptr) return {};
  return {begin, begin + film.num_pixels()};
}

/// The mean of its channels R, G and B; empty when there are none.
std::vector<float> mean_plane(const FilmTile& film, const std::string& layer) {
  std::vector<float> mean = plane(film, layer + ".R");
  const std::vector<float> g = plane(film, layer + ".G"), b = plane(film, layer + ".B");
  if (g.size() != mean.size() || b.size() != mean.size()) return {};
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = (mean[i] + g[i] + b[i]) / 3;
  return mean;
}

}  // namespace

RgbImage image_of(const FilmTile& film, const std::array<const char*, 3>& channels) {
  RgbImage image{film.rect.width(), film.rect.height(), {}};
  image.rgb.resize(3 * film.num_pixels());
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float> values = plane(film, channels[c]);
    for (std::size_t i = 0; i < values.size(); ++i) image.rgb[3 * i + c] = values[i];
  }
  return image;
}

Result<MeasuredFrame> read_measured_frame(const std::filesystem::path& path) {
  BATON_ASSIGN(const FilmTile film, read_exr(path, ExrWindow::seen));
  for (const char* const channel : {"R", "G", "B"}) {
    if (film.find(channel) == nullptr)
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: expected a channel {}", path.string(), channel)};
  }
  MeasuredFrame frame;
  frame.image = image_of(film);
  frame.coverage = plane(film, "A");
  frame.lns = plane(film, "lns");
  frame.ess = plane(film, "ess");
  frame.acceptance = plane(film, "acceptance");
  frame.variance = mean_plane(film, "variance");
  if (frame.coverage.empty() || frame.lns.empty())
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: expected channels A and lns", path.string())};
  return frame;
}

std::optional<std::string> reference_fault(const Reference& reference) {
  constexpr std::size_t kFewestPixels = 64;
  constexpr double kTwice = 2;
  const double halves = std::sqrt(reference.mse), told = std::sqrt(reference.reported_mse);
  if (reference.lit_pixels.size() < kFewestPixels || halves <= kTwice * told) return std::nullopt;
  return fmt::format(
      "the two halves of the reference differ by an RMSE of {:.3g}, {:.2g} times the {:.3g} that "
      "it "
      "reports of itself: it is wrong somewhere, so that nothing can be judged by it",
      halves, told > 0 ? halves / told : 0.0, told);
}

Reference make_reference(MeasuredFrame a, MeasuredFrame b) {
  Reference reference;
  const std::size_t num_pixels = a.coverage.size();
  reference.mean = a.image;
  const NoiseBlocks blocks({0, 0, a.image.width, a.image.height});
  double sum = 0, sum_squares = 0, sum_relative = 0, sum_variance = 0, sum_lns = 0;
  for (std::size_t i = 0; i < num_pixels; ++i) {
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
      reference.mean.rgb[k] = 0.5f * (a.image.rgb[k] + b.image.rgb[k]);
    if (!(a.coverage[i] > 0)) continue;
    reference.lit_pixels.push_back(i);
    reference.block.push_back(blocks.of(i));
    sum_lns += 0.5 * (a.lns[i] + b.lns[i]);
    sum_variance += 0.25 * (a.variance[i] + b.variance[i]);
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
      const double half_difference = 0.5 * (double{a.image.rgb[k]} - b.image.rgb[k]);
      sum += reference.mean.rgb[k];
      sum_squares += half_difference * half_difference;
      const double relative = half_difference / (reference.mean.rgb[k] + kRelativeFloor);
      sum_relative += relative * relative;
    }
  }
  reference.num_blocks = blocks.count();
  const auto count = static_cast<double>(std::max<std::size_t>(reference.lit_pixels.size(), 1));
  reference.mean_radiance = sum / (3 * count);
  reference.mse = sum_squares / (3 * count);
  reference.rel_mse = sum_relative / (3 * count);
  reference.reported_mse = sum_variance / count;
  reference.lns_mean = sum_lns / count;
  reference.exposure = auto_exposure(reference.mean);
  reference.displayed = tone_map(reference.mean, reference.exposure);
  const std::vector<float> flip =
      flip_difference(reference.displayed, tone_map(a.image, reference.exposure));
  for (const std::size_t i : reference.lit_pixels) reference.flip += flip[i] / count;
  reference.shown = ReferenceAsShown(a.image, b.image, a.coverage);
  reference.half = {std::move(a), std::move(b)};
  return reference;
}

}  // namespace baton

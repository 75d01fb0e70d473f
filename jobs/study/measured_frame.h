#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "jobs/study/as_shown.h"

namespace baton {

/// One frame of a rendering as the measures use it.
struct MeasuredFrame {
  RgbImage image;
  std::vector<float> coverage;    ///< (pixels) alpha: where there is a surface
  std::vector<float> lns;         ///< (pixels)
  std::vector<float> ess;         ///< (pixels) ESS / N; empty for references
  std::vector<float> acceptance;  ///< (pixels) of moves; empty for references
  /// (pixels) mean over R, G, B; empty but for references.
  std::vector<float> variance;
};

/// Three planes of a film as an image; one that it has not is 0.
RgbImage image_of(const FilmTile& film,
                  const std::array<const char*, 3>& channels = {"R", "G", "B"});

/// Reads a frame. Errors name the file: missing, not an EXR, without R, G, B, A or lns.
Result<MeasuredFrame> read_measured_frame(const std::filesystem::path& path);

/// Brute force in two independent halves A and B; R is their mean.
struct Reference {
  std::array<MeasuredFrame, 2> half;
  RgbImage mean;
  /// Exposure of all images that are compared with it.
  float exposure = 1;
  RgbImage displayed;  ///< tone-mapped mean
  ReferenceAsShown shown;

  /// Pixels with a surface, as indices.
  std::vector<std::size_t> lit_pixels;
  /// By lit pixel: the square in which its error counts.
  std::vector<std::size_t> block;
  std::size_t num_blocks = 0;
  double mean_radiance = 0;  ///< over lit pixels and R, G, B
  /// Mean squared error of R by its halves, mean (A - B)^2 / 4: what R cannot resolve.
  double mse = 0;
  double rel_mse = 0;  ///< squared error over (R + .01)^2
  /// Mean FLIP between R and A, which is as far from R as R from the truth.
  double flip = 0;
  /// `mse` by the variance that brute force reports of itself.
  double reported_mse = 0;
  double lns_mean = 0;  ///< over lit pixels
};

/// (R + this)^2 divides squared errors in relMSE, so that black pixels count finitely.
inline constexpr double kRelativeFloor = 0.01;

Reference make_reference(MeasuredFrame a, MeasuredFrame b);

/// Why a reference is not what it says: its halves differ by more than twice the error that it
/// reports. nullopt: it may be trusted. Some 60 pixels are needed to say so.
std::optional<std::string> reference_fault(const Reference& reference);

}  // namespace baton

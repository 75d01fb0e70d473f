#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace baton {

struct SamplingSpec;

/// How pixels are sampled. automatic: settled by a pilot before the job is submitted; never part of
/// a job document.
enum class Method : std::uint8_t {
  reference,
  environment,
  brdf,
  mis,
  bidirectional,
  sequential,
  pool,
  ratio,
  restir,
  automatic
};

/// What a method hands from frame to frame.
enum class Carried : std::uint8_t {
  nothing,
  samples,  ///< the pixel's weighted samples
  /// Weighted samples with the confidence that they are weighed by.
  weighed_samples,
  /// What the pixel's rays found, and how noisy its light was.
  memory,
};

/// How a method reads the directions that are drawn from the environment once a frame.
struct LightUse {
  std::int32_t num_taken = 1;  ///< by most pixels
  bool one_run = false;        ///< pixels differ in how many they take
  /// The light of samples in the frame before is needed as well.
  bool with_before = false;
};

/// All that sets a method apart outside the code that samples, which make_pixel_method() finds, and
/// the unit costs of `auto`. No other code switches on Method.
struct MethodTraits {
  std::string_view name;  ///< in a job
  Carried carried = Carried::nothing;
  /// A pixel's state in a file before packing takes at most this beside its source, Lns and
  /// samples.
  std::int32_t most_bytes_beside_samples = 0;
  /// A block of pixels (PixelBlocks) takes at most this in a file before packing: what it
  /// remembers, and the marks of the bins that it does so of. In memory it takes less.
  std::int32_t most_block_bytes = 0;
  /// Its rays are N weighted samples, which are in its states; else rays are chosen apart from
  /// them.
  bool keeps_samples = false;
  /// All samples are drawn anew in each frame, so that it may start `sequential` and serve a single
  /// material.
  bool draws_anew = false;
  /// Its samples weigh the same when they are drawn: they are resampled from candidates.
  bool equal_weights = false;
  /// Pixels may weigh the samples of SamplingSpec::num_neighbors others.
  bool asks_neighbors = false;
  /// Markov chains move and resample its samples.
  bool moves_samples = false;
  /// Share of the candidates of the environment that goes by capped radiance (EnvironmentMap): for
  /// those who learn that a lamp is hidden.
  float capped_light = 0;
  /// SamplingSpec::mis_compensation may leave dim light to the BRDF's samples.
  bool compensates = false;
  /// It tells the variance of each pixel.
  bool tells_variance = false;
  /// Why the second pass can't follow; empty: it can.
  std::string_view no_second_pass = {};
  LightUse (*light)(const SamplingSpec&) = nullptr;
  /// Shadow rays of a pixel at most.
  std::int64_t (*most_rays)(const SamplingSpec&) = nullptr;

  bool carries() const { return carried != Carried::nothing; }
};

/// The row of a method.
const MethodTraits& traits(Method method);

/// Names of all methods in a job, in the order of the enumeration.
std::span<const std::string_view> method_names();

/// name: one of method_names().
Method method_of(std::string_view name);

/// How many of `total` samples are from the BRDF, rounded.
std::int32_t num_from_brdf(std::int32_t total, float brdf_fraction);

}  // namespace baton

#include "worker/run/frame_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/build.h"
#include "common/base/files.h"
#include "common/base/patiently.h"
#include "common/base/trace.h"
#include "common/base/version.h"
#include "common/image/cryptomatte.h"
#include "common/image/exr_threads.h"
#include "common/image/frame_seal.h"
#include "common/image/noise.h"
#include "common/image/shadow.h"
#include "common/job/aov.h"
#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "common/scene/camera.h"
#include "worker/pass/tile_renderer.h"
#include "worker/run/frame_quality.h"
#include "worker/run/renderer.h"

namespace baton {
namespace {

/// True when `stored` is `value` after the rounding of a half float (11 bits), or exact.
bool same_after_rounding(float value, float stored) {
  constexpr float kHalfMax = 65504.0f;
  constexpr float kHalfStep = 1.0f / 2048, kHalfSmallest = 6.0e-8f;
  if (value == stored || (std::isnan(value) && std::isnan(stored))) return true;
  if (std::fabs(value) >= kHalfMax)
    return std::fabs(stored) >= kHalfMax && (value > 0) == (stored > 0);
  return std::fabs(value - stored) <= std::fabs(value) * kHalfStep + kHalfSmallest;
}

ChannelNaming naming_of(const JobSpec& job) {
  return job.output.naming == FrameNaming::blender ? ChannelNaming::blender : ChannelNaming::plain;
}

/// Channels with 32 bits whatever output.pixelType says: colours that half floats cannot say, and
/// AOVs whose use needs them.
std::vector<std::string> whole_channels(const JobSpec& job, const FrameQuality& quality) {
  std::vector<std::string> whole;
  if (quality.pixels_beyond_half > 0) whole = {"R", "G", "B"};
  for (const Aov aov : job.output.aovs) {
    const AovTraits& row = traits(aov);
    if (row.is_float) whole.insert(whole.end(), row.channels.begin(), row.channels.end());
  }
  return whole;
}

void drop_channel(FilmTile& image, std::string_view name) {
  const auto found = std::find(image.channels.begin(), image.channels.end(), name);
  if (found == image.channels.end()) return;
  const float* const plane = image.plane(static_cast<std::size_t>(found - image.channels.begin()));
  const auto first = image.values.begin() + (plane - image.values.data());
  image.values.erase(first, first + static_cast<std::ptrdiff_t>(image.num_pixels()));
  image.channels.erase(found);
}

/// Each name where it comes first.
std::vector<std::string> without_repeats(const std::vector<std::string>& names) {
  std::set<std::string> seen;
  std::vector<std::string> result;
  for (const std::string& name : names) {
    if (seen.insert(name).second) result.push_back(name);
  }
  return result;
}

}  // namespace

Status verify_frame(const std::filesystem::path& path, const FilmTile& image, std::int32_t block) {
  const std::int32_t num_blocks = (image.rect.height() + kRowsVerified - 1) / kRowsVerified;
  const std::int32_t y0 = image.rect.y0 + block % num_blocks * kRowsVerified;
  const std::int32_t y1 = std::min(y0 + kRowsVerified, image.rect.y1);
  BATON_ASSIGN(const FilmTile stored, read_exr_rows(path, y0, y1));
  if (stored.rect != PixelRect{image.rect.x0, y0, image.rect.x1, y1} ||
      stored.channels.size() != image.channels.size()) {
    return Error{
        ErrorKind::corrupt,
        fmt::format("{}: rows {} to {} are {}x{} pixels of {} channels, wrote {}x{} of {}",
                    path.string(), y0, y1 - 1, stored.rect.width(), stored.rect.height(),
                    stored.channels.size(), image.rect.width(), y1 - y0, image.channels.size())};
  }

  // Channels may come in any order.
  const std::size_t offset = static_cast<std::size_t>(y0 - image.rect.y0) * image.rect.width();
  for (std::size_t channel = 0; channel < image.channels.size(); ++channel) {
    const std::string& name = image.channels[channel];
    const float* const read = stored.find(name);
    if (read == nullptr) {
      return Error{ErrorKind::corrupt,
                   fmt::format("{}: channel {} is missing", path.string(), name)};
    }
    const float* const wrote = image.plane(channel) + offset;
    for (std::size_t pixel = 0; pixel < stored.num_pixels(); ++pixel) {
      if (same_after_rounding(wrote[pixel], read[pixel])) continue;
      const auto width = static_cast<std::int64_t>(image.rect.width());
      const auto place = static_cast<std::int64_t>(offset + pixel);
      return Error{ErrorKind::corrupt,
                   fmt::format("{}: channel {} pixel {},{}: read back {}, wrote {}", path.string(),
                               name, image.rect.x0 + place % width, image.rect.y0 + place / width,
                               read[pixel], wrote[pixel])};
    }
  }
  return {};
}

ImageMetadata frame_metadata(const JobSpec& job, const Digest& job_digest, FrameNumber frame,
                             const FrameQuality& quality) {
  ImageMetadata metadata{{"baton:version", kVersion},
                         {"baton:jobName", job.name},
                         {"baton:jobDigest", job_digest.hex()},
                         {kSealAttribute, blank_seal()},
                         {"baton:renderer", describe_renderer() + ", " + build_identity()},
                         {"baton:frame", std::to_string(frame.value())},
                         {"baton:method", std::string(traits(job.sampling.method).name)}};
  const SamplingSpec& sampling = job.sampling;
  const auto add = [&](const char* key, const auto& value) {
    metadata.emplace_back(key, fmt::format("{}", value));
  };
  add("baton:numParticles", sampling.num_particles);
  add("baton:numCandidates", sampling.num_candidates);
  add("baton:seed", job.seed);
  add("baton:sites", job.image.sites);
  if (has_fine_sites(job)) add("baton:maxSites", job.image.max_sites);
  add("baton:rounds", std::int64_t{job.quality.rounds} * job.quality.sweeps);
  if (job.quality.adaptive_threshold)
    add("baton:adaptiveThreshold", *job.quality.adaptive_threshold);
  const EnvironmentSpec& environment = job.environment;
  const EnvironmentFrame light = environment_at(environment, frame);
  add("baton:map", environment.keys.at(static_cast<std::size_t>(light.map_a)).map);
  if (light.mix > 0) {
    add("baton:mapMixedIn", environment.keys.at(static_cast<std::size_t>(light.map_b)).map);
    add("baton:mapMix", light.mix);
  }
  add("baton:mapScale", environment.scale * light.scale);
  if (!environment.camera_map.file.empty()) add("baton:cameraMap", environment.camera_map.file);
  if (has_plate(job.output)) add("baton:plate", file_at(*job.output.plate, frame));
  add("baton:rotationDeg", rotation_deg_at(environment, frame));
  if (quality.noise_source != NoiseSource::none) {
    metadata.emplace_back("baton:noise", fmt::format("{:.4g}", quality.noise));
    metadata.emplace_back("baton:noiseShown", fmt::format("{:.4g}", quality.noise_shown));
    add("baton:noiseFrom", noise_source_name(quality.noise_source));
  }
  if (quality.cycles_noise > 0)
    metadata.emplace_back("baton:cyclesNoise", fmt::format("{:.4g}", quality.cycles_noise));
  add("baton:pixelsBelowZero", quality.pixels_below_zero);
  add("baton:clampNegative", quality.clamped);
  if (quality.pixels_not_finite > 0) add("baton:pixelsNotFinite", quality.pixels_not_finite);
  for (const Aov aov : job.output.aovs) {
    ImageMetadata ids;
    const std::string in(naming_of(job) == ChannelNaming::blender ? kBlenderLayer : "");
    if (aov == Aov::crypto_object)
      ids = cryptomatte_metadata(in + kCryptoObject, without_repeats(object_names(job)));
    if (aov == Aov::crypto_material)
      ids = cryptomatte_metadata(in + kCryptoMaterial, material_names(job));
    metadata.insert(metadata.end(), ids.begin(), ids.end());
  }
  for (const auto& [name, text] : job.metadata)
    metadata.emplace_back("baton:metadata:" + name, text);
  return metadata;
}

Result<WrittenFrame> write_frame(const JobSpec& job, const Digest& job_digest, FrameIndex frame,
                                 FilmTile image, const std::optional<RgbImage>& plate,
                                 const std::function<Result<bool>(const Digest& made)>& may_replace,
                                 const std::stop_token& stop, const Roots& roots,
                                 const Lend& lend) {
  FrameQuality quality = judge_frame(image, lend);
  if (job.output.clamp_negative) clamp_negative(image);
  if (plate) {
    lay_over_plate(image, *plate);
    quality = judge_composite(image, quality, lend);
  }
  quality.clamped = job.output.clamp_negative;
  drop_channel(image, kErrorChannel);
  if (hides_indirect(job)) {
    for (const std::string& name : traits(Aov::indirect).channels) drop_channel(image, name);
  }
  if (job.output.shadows == ShadowForm::alpha) {
    put_shadows_in_alpha(image);
    for (const char* const name : kShadowChannels) drop_channel(image, name);
  } else {
    finish_shadows(image);
  }
  drop_channel(image, kCatcherChannel);

  const std::filesystem::path path = frame_path(job, frame);
  const FrameNumber number = job.frames.at(frame.index());
  const Camera camera(camera_at(job, number.value()), job.image.width, job.image.height);
  std::optional<EncodingSpan> encoding(std::in_place, fmt::format("encoding frame {}", number));
  BATON_ASSIGN(Bytes bytes,
               encode_exr(path.string(), image,
                          {.half_float = job.output.pixel_type == PixelType::half_float,
                           .whole = whole_channels(job, quality),
                           .compression = job.output.compression,
                           .metadata = frame_metadata(job, job_digest, number, quality),
                           .world_to_camera = camera.world_to_camera(),
                           .world_to_ndc = camera.world_to_ndc(job.image.whole()),
                           .frames_per_second = job.output.frames_per_second,
                           .frame_number = number.value(),
                           .naming = naming_of(job),
                           .display_window = job.image.whole()}));
  seal_frame(path.filename().string(), bytes);
  const Digest made = digest_of(bytes);
  encoding.reset();
  const Span span(SpanKind::write, "file, read back");
  const auto check = [&](const std::filesystem::path& temporary) -> Result<bool> {
    BATON_TRY(verify_frame(temporary, image, frame.value()));
    return may_replace ? may_replace(made) : true;
  };
  Patience patience(stop);
  for (bool is_written = false; !is_written;) {
    const Result<bool> written = write_file_verified(path, bytes, check, roots);
    is_written = written && *written;
    if (is_written) continue;
    const Error error =
        written ? Error{ErrorKind::io,
                        path.string() + ": something is there that this machine does not see"}
                : written.error();
    if (patience.wait_after(error)) continue;
    return written ? Error{ErrorKind::timeout, error.message} : error;
  }
  return WrittenFrame{{BlobKind::image, frame.value(), 0, made, bytes.size()}, quality};
}

}  // namespace baton

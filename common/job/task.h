#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/job/time.h"

namespace baton {

/// The words that scheduler, journal, messages and workers share: which piece of work, which
/// attempt at it, which bytes it needs or made. Plain data, written member by member
/// (common/base/archive.h): their order is stored and sent.

/// What a task does. Stored and sent; values are for ever.
enum class TaskKind : std::uint8_t {
  render = 0,       ///< one TileRun
  assemble = 1,     ///< the EXR of one frame from its tile films
  second_pass = 2,  ///< one tile of one step
};
constexpr TaskKind last_of(TaskKind) { return TaskKind::second_pass; }
/// "render", "assemble", "second pass".
std::string_view task_name(TaskKind kind);

/// A task of a job. Made by the three functions below, read by run(), frame() and step().
struct TaskKey {
  TaskKind kind = TaskKind::render;
  /// A Run, a FrameIndex or a Step, as `kind` says.
  std::int32_t position = 0;
  std::int32_t tile = 0;  ///< 0 for an assembly

  auto operator<=>(const TaskKey&) const = default;
  /// The run of a render task.
  Run run() const;
  /// The frame of an assembly.
  FrameIndex frame() const;
  /// The step of a second pass.
  Step step() const;
};
TaskKey render_task(Run run, std::int32_t tile);
TaskKey assemble_task(FrameIndex frame);
TaskKey second_pass_task(Step step, std::int32_t tile);
/// "run 3 of tile 7", "assembly of frame index 5": the task in words, steps and tiles 0-based.
std::string describe_task(const TaskKey& task);

/// What a blob is. Stored and sent; values are for ever.
enum class BlobKind : std::uint8_t { state = 0, film = 1, image = 2, first_pass = 3 };
constexpr BlobKind last_of(BlobKind) { return BlobKind::first_pass; }
/// "state", "film", "image", "first-pass samples".
std::string_view blob_kind_name(BlobKind kind);

/// A blob that a task needs or made.
struct BlobRef {
  BlobKind kind = BlobKind::state;
  /// An image has its FrameIndex here, all else its Step.
  std::int32_t position = 0;
  std::int32_t tile = 0;
  /// For `image`: digest of the EXR file in the output folder.
  Digest digest;
  std::uint64_t size_bytes = 0;

  /// A state without bytes in the store: it is in the memory of the worker that made it, where
  /// `digest` names it (held_state_name).
  bool is_held() const { return kind == BlobKind::state && size_bytes == 0; }
  /// An image that counts as made whatever its bytes are: that of a locked frame.
  static BlobRef any_image(FrameIndex frame) { return {BlobKind::image, frame.value(), 0, {}, 0}; }
  bool is_any_image() const { return kind == BlobKind::image && digest == Digest(); }
  /// Whether `digest` says nothing of any bytes: two placeholders, or one and a blob, cannot be
  /// compared.
  bool is_placeholder() const { return is_held() || is_any_image(); }
  /// The frame of an image.
  FrameIndex frame() const;
  /// The step of a state, a film or first-pass samples.
  Step step() const;

  auto operator<=>(const BlobRef&) const = default;
};

/// A held state that its worker has packed and put into the store.
struct PublishedState {
  BlobRef held, published;

  bool operator==(const PublishedState&) const = default;
};

/// Names the state of a tile and step of a job that is held: nothing of it is packed, so it has no
/// digest of bytes.
Digest held_state_name(const Digest& job, Step step, std::int32_t tile);

/// Those of the blobs that lie in the store: neither frames nor held states.
std::vector<Digest> stored_blobs(const std::vector<BlobRef>& blobs);

/// Where a job stands. Stored and sent; values are for ever. Of a paused job no task is handed out.
enum class JobStatus : std::uint8_t {
  running = 0,
  done = 1,
  failed = 2,
  cancelled = 3,
  paused = 4
};
constexpr JobStatus last_of(JobStatus) { return JobStatus::paused; }
/// "running" ... "paused".
std::string_view job_status_name(JobStatus status);
/// Whether the job has not ended.
constexpr bool is_open(JobStatus status) {
  return status == JobStatus::running || status == JobStatus::paused;
}

/// Names one attempt of one task; the fence against late reports. epoch: the coordinator's start
/// count.
struct LeaseId {
  Digest job;
  TaskKey task;
  std::uint32_t attempt = 0;
  std::uint32_t epoch = 0;

  auto operator<=>(const LeaseId&) const = default;
};

/// A task that is given to a worker, with all that it needs for it. Sent: the order of the members
/// is that of the bytes.
struct Grant {
  LeaseId lease;
  std::vector<BlobRef> inputs;
  /// What a render task renders. Empty: nothing; the state of step `last` is cut from the inputs.
  /// A second pass: its step. An assembly: of no meaning.
  StepSpan steps{};
  bool may_hold = false;  ///< the worker may hold the task's state
  Step states_from{};     ///< no task needs states of earlier steps
  /// CPU time, as the longest of late; 0: not known.
  double expected_seconds = 0;
  /// Digests of pictures that an assembly may replace (as far as the coordinator knows that some
  /// are there).
  std::vector<Digest> may_replace = {};
};

/// What the sampler did with the pixels that see a surface; merging is addition.
struct SamplingStats {
  static constexpr std::size_t kEssBins = 8;

  std::uint64_t pixels_fresh = 0, pixels_carried = 0, pixels_restarted = 0;
  std::uint64_t pixels_refreshed = 0;           ///< on schedule or by ratio
  std::uint64_t pixels_refreshed_by_ratio = 0;  ///< those whose Lns had moved too far
  std::uint64_t pixels_resampled = 0;
  std::uint64_t local_proposed = 0, local_accepted = 0;  ///< moves
  std::uint64_t independent_proposed = 0, independent_accepted = 0;
  /// Pixels by ESS / N before resampling: bin b is for [b, b + 1) / kEssBins, the last one 1 as
  /// well; dark pixels are in bin 0.
  std::array<std::uint64_t, kEssBins> ess_histogram{};

  bool operator==(const SamplingStats&) const = default;
  std::uint64_t pixels() const {
    return pixels_fresh + pixels_carried + pixels_restarted + pixels_refreshed;
  }
  /// ess_ratio: ESS / N, [0, 1].
  void count_ess(float ess_ratio);
  void merge(const SamplingStats& b);
};

/// What the noise of a frame was told from. Stored and sent; values are for ever. probes: pixels
/// that were sampled twice, at the same sites. scatter: that of rounds or sweeps in all pixels,
/// sites included. halves, neighbors: other measures, of frames of earlier programs.
enum class NoiseSource : std::uint8_t {
  none = 0,
  halves = 1,
  neighbors = 2,
  probes = 3,
  scatter = 4
};
constexpr NoiseSource last_of(NoiseSource) { return NoiseSource::scatter; }
/// "none", "halves", "neighbors", "probes", "scatter".
std::string_view noise_source_name(NoiseSource source);

/// What was seen of a whole frame when it was written, of R, G and B, before anything was set to 0.
struct FrameQuality {
  std::uint64_t pixels = 0;              ///< 0: the frame is not written
  std::uint64_t pixels_below_zero = 0;   ///< in one of the three at least
  std::uint64_t pixels_beyond_half = 0;  ///< past what a half float can say
  /// NaN or infinite; in none of the other numbers.
  std::uint64_t pixels_not_finite = 0;
  NoiseSource noise_source = NoiseSource::none;
  /// FrameNoise::relative() (common/image/noise.h).
  float noise = 0;
  float noise_error = 0;  ///< standard error of `noise`, as a share
  float noise_shown = 0;  ///< noise_as_shown(), [0, .5]
  /// In the measure of quality.noiseThreshold (common/image/noise.h); 0: not told.
  float cycles_noise = 0;
  float mean = 0;    ///< radiance, over pixels and the three
  float lowest = 0;  ///< the least value, at most 0
  /// What lies below zero over all light, [0, ...).
  float light_below_zero = 0;
  bool clamped = false;  ///< what lay below zero was set to 0

  bool operator==(const FrameQuality&) const = default;
};

/// The sampling of one tile in one step, or what was seen of the whole frame when it was written.
struct FrameStats {
  /// The Step of a render task, the FrameIndex of an assembly.
  std::int32_t position = 0;
  std::int32_t tile = 0;
  SamplingStats sampling;
  FrameQuality quality = {};

  bool operator==(const FrameStats&) const = default;
  Step step() const { return Step(position); }
  FrameIndex frame() const { return FrameIndex(position); }
  /// Adds another tile's sampling, or takes the frame's quality. Position and tile stay.
  void merge(const FrameStats& b);
};

/// All tiles of a frame together, as people are told.
struct FrameReport {
  FrameNumber frame{};
  std::int32_t tile = -1;  ///< none
  SamplingStats sampling;
  FrameQuality quality = {};

  bool operator==(const FrameReport&) const = default;
};

/// Luminance of what pixels show of surfaces, where there is light between these: sums over pixels
/// and rounds.
struct LightSums {
  double direct = 0, indirect = 0;  ///< the second by way of other surfaces

  bool operator==(const LightSums&) const = default;
};

/// Counters that workers add up and `baton job show` prints; merging is addition.
struct RenderStats {
  std::uint64_t pixels = 0, rays_primary = 0, rays_shadow = 0, target_evaluations = 0;
  std::uint64_t pixels_background = 0;
  SamplingStats sampling;
  double cpu_seconds = 0;
  /// CPU seconds of the stages; light is shared by all tiles of a frame and counted where it was
  /// prepared.
  double seconds_light = 0, seconds_primary = 0, seconds_sample = 0, seconds_visibility = 0,
         seconds_shade = 0;
  /// Encoding, writing, reading and decoding sample states.
  double seconds_state = 0;
  std::uint64_t pixels_masked = 0;     ///< pixels that the second pass did again
  std::uint64_t rays_second_pass = 0;  ///< not in rays_shadow
  double seconds_second_pass = 0;      ///< all of the second pass
  double seconds_second_rays = 0;      ///< occlusion rays of the second pass
  LightSums light;

  bool operator==(const RenderStats&) const = default;
  void merge(const RenderStats& b);
};

/// What a task has made. Sent and kept: the order of the members is that of the bytes.
struct TaskOutput {
  std::vector<BlobRef> outputs;
  RenderStats stats = {};
  /// A render task: one for each step, in their order; an assembly: one.
  std::vector<FrameStats> frames = {};

  bool operator==(const TaskOutput&) const = default;
};

}  // namespace baton

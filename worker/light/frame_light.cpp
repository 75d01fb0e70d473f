#include "worker/light/frame_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/advice/known_limits.h"
#include "common/base/trace.h"
#include "common/math/octahedral.h"
#include "common/scene/map/map_report.h"

namespace baton {
namespace {

/// The presampled light as most pixels read it.
PresampledLightLayout presampled_layout(const JobSpec& job) {
  LightUse use = traits(job.sampling.method).light(job.sampling);
  for (const auto& [name, own] : job.sampling.by_material)
    use.num_taken = std::max(use.num_taken, traits(own.method).light(as_sampling(own)).num_taken);
  return {
      .num_taken = static_cast<std::uint32_t>(std::max(use.num_taken / num_populations(job), 1)),
      .one_run = use.one_run,
      .with_before = use.with_before};
}

/// Frames that tasks in hand may need: those of a run and of the one before it that somebody has
/// not ended yet, and some more in motion, where runs are short.
std::size_t frames_in_hand(const JobSpec& job) {
  return 2 * static_cast<std::size_t>(frames_per_run(job)) + 6;
}

}  // namespace

std::optional<Mat3> turn_between(const Environment& before, const Environment& now) {
  constexpr double kMinTurn = 15 * kOctahedralError;
  if (now.map->filter() == MapFilter::nearest) return std::nullopt;
  const Mat3 turn = now.rotation * before.rotation.transposed();

  // |turn - 1|^2 = 8 sin^2(angle / 2), exact for small angles, too.
  double squares = 0;
  for (std::size_t i = 0; i < turn.m.size(); ++i) {
    const double difference = double{turn.m[i]} - Mat3{}.m[i];
    squares += difference * difference;
  }
  if (std::sqrt(squares / 2) < kMinTurn) return std::nullopt;
  return turn;
}

LightSequence::LightSequence(const JobSpec& job, std::shared_ptr<MapCache> maps,
                             const MemorySharePtr& share, std::shared_ptr<const HiddenLight> hidden)
    : job_(job),
      maps_(std::move(maps)),
      hidden_(std::move(hidden)),
      cones_(static_cast<std::size_t>(num_steps(job))),
      frames_(expand_sequence(job)),
      num_sets_(num_presampled_sets(std::int64_t{job.image.width} * job.image.height,
                                    job.quality.rounds)),
      capped_share_(traits(job.sampling.method).capped_light),
      mixed_maps_(
          share, [](const EnvironmentMap& map) { return map.size_bytes(); }, frames_in_hand(job)),
      presampled_(
          share, [](const PresampledSets& light) { return light.size_bytes(); },
          frames_in_hand(job) * (static_cast<std::size_t>(job.quality.rounds) + 1)),
      irradiances_(
          share, [](const Irradiance& irradiance) { return irradiance.size_bytes(); },
          frames_in_hand(job)) {}

Result<std::shared_ptr<const EnvironmentMap>> LightSequence::key_map(std::int32_t key,
                                                                     const HiddenCone& hidden,
                                                                     const DoParts& do_parts) {
  return maps_->get(job_.environment.keys[static_cast<std::size_t>(key)].map, job_.environment,
                    job_.sampling.mis_compensation, hidden, capped_share_, do_parts);
}

Step LightSequence::first_with_texels_of(const EnvironmentFrame& frame) const {
  const auto first = std::find_if(frames_.begin(), frames_.end(), [&](const FrameSpec& f) {
    return f.environment.same_texels(frame);
  });
  return Step(static_cast<std::int32_t>(first - frames_.begin()));
}

Result<std::shared_ptr<const EnvironmentMap>> LightSequence::mixed_map(
    const EnvironmentFrame& frame, const HiddenCone& hidden, const DoParts& do_parts) {
  if (frame.mix <= 0 && frame.scale == 1) return key_map(frame.map_a, hidden, do_parts);
  const std::pair name(first_with_texels_of(frame), hidden);
  if (auto found = mixed_maps_.find(name)) return found;
  BATON_ASSIGN(const auto a, key_map(frame.map_a, hidden, do_parts));
  BATON_ASSIGN(const auto b, key_map(frame.map_b, hidden, do_parts));
  if (a->width() != b->width() || a->height() != b->height()) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("{}: {} x {} texels, expected {} x {} as in {} to interpolate between them",
                    job_.environment.keys[static_cast<std::size_t>(frame.map_b)].map, b->width(),
                    b->height(), a->width(), a->height(),
                    job_.environment.keys[static_cast<std::size_t>(frame.map_a)].map)};
  }
  return mixed_maps_.insert(name, std::make_shared<const EnvironmentMap>(
                                      *a, *b, frame.mix, frame.scale,
                                      job_.sampling.mis_compensation, capped_share_, do_parts));
}

HiddenCone LightSequence::hidden_in(const FrameSpec& frame) {
  if (hidden_ == nullptr) return {};
  std::optional<HiddenCone>& cone = cones_[frame.step.index()];
  if (!cone) cone = hidden_->at(frame.number);
  return *cone;
}

Result<Environment> LightSequence::environment(const FrameSpec& frame, const DoParts& do_parts) {
  BATON_ASSIGN(auto map, mixed_map(frame.environment, hidden_in(frame), do_parts));
  return Environment{std::move(map), frame.environment.rotation};
}

Result<Environment> LightSequence::seen_environment(const Environment& now) {
  const CameraMapSpec& camera_map = job_.environment.camera_map;
  if (camera_map.file.empty()) return now;
  const EnvironmentSpec as_is{
      .keys = {}, .filter = job_.environment.filter, .scale = camera_map.scale};
  BATON_ASSIGN(auto map, maps_->get(camera_map.file, as_is, false, {}));
  return Environment{std::move(map), now.rotation};
}

std::shared_ptr<const FrameLight> LightSequence::known(Step step, Round round) {
  const std::lock_guard lock(known_mutex_);
  const auto found = known_.find({step, round});
  return found == known_.end() ? nullptr : found->second.lock();
}

Result<std::shared_ptr<const FrameLight>> LightSequence::at(Step step, Round round) {
  if (auto light = known(step, round)) return light;
  const FrameSpec& frame = frames_[step.index()];
  const std::string what =
      round == kProbeRound
          ? fmt::format("light of the probes of frame {}", frame.number)
          : fmt::format("light of frame {}, round {}", frame.number, frame.round_of_frame(round));
  Team::Turn turn(team_, what);
  if (auto light = known(step, round)) return light;
  const DoParts do_parts = [&turn](std::size_t parts,
                                   const std::function<void(std::size_t)>& part) {
    turn.share(parts, part);
  };
  std::optional<Span> span;
  if (presampled_.find({step, round}) == nullptr) span.emplace(SpanKind::make, what);
  BATON_ASSIGN(auto light, make(step, round, do_parts));
  const std::lock_guard lock(known_mutex_);
  std::erase_if(known_, [](const auto& entry) { return entry.second.expired(); });
  known_[{step, round}] = light;
  return light;
}

/// While this thread has the turn.
Result<std::shared_ptr<const FrameLight>> LightSequence::make(Step step, Round round,
                                                              const DoParts& do_parts) {
  const FrameSpec& frame = frames_[step.index()];
  const bool is_first = round == Round(0);
  const Step step_before = is_first ? std::max(step - 1, Step(0)) : step;
  const FrameSpec& frame_before = frames_[step_before.index()];
  auto light = std::make_shared<FrameLight>();
  BATON_ASSIGN(light->now, environment(frame, do_parts));
  BATON_ASSIGN(light->before, environment(frame_before, do_parts));
  BATON_ASSIGN(light->seen, seen_environment(light->now));
  light->still = is_first && frame.environment == frame_before.environment &&
                 hidden_in(frame) == hidden_in(frame_before);
  if (has_catcher(job_)) {
    light->irradiance = irradiance(frame.environment, light->now);
    if (carries_state(job_) && traits(job_.sampling.method).keeps_samples)
      light->irradiance_before = irradiance(frame_before.environment, light->before);
  }
  if (frame.environment.same_texels(frame_before.environment))
    light->turn = turn_between(light->before, light->now);
  if (is_first) note(frame);
  const bool is_seen = round >= Round(0) && round != kProbeRound;
  light->presampled = presampled_.find({step, round});
  if (light->presampled == nullptr) {
    light->presampled = presampled_.insert(
        {step, round},
        std::make_shared<const PresampledSets>(presample_sets(
            light->now, light->before, job_.seed, static_cast<std::uint32_t>(frame.number.value()),
            presampled_layout(job_), frame.round_of_frame(round), is_seen ? num_sets_ : 1,
            do_parts)));
  }
  return std::shared_ptr<const FrameLight>(std::move(light));
}

std::shared_ptr<const Irradiance> LightSequence::irradiance(const EnvironmentFrame& frame,
                                                            const Environment& environment) {
  const Step name = first_with_texels_of(frame);
  if (auto found = irradiances_.find(name)) return found;
  return irradiances_.insert(name, std::make_shared<const Irradiance>(*environment.map));
}

/// What is odd about the maps of a frame that are not known yet, and about the step to it.
void LightSequence::note(const FrameSpec& frame) {
  const std::lock_guard lock(notes_mutex_);
  if (!noted_.insert(frame.step).second) return;
  const auto add = [&](const std::vector<std::string>& lines) {
    for (const std::string& line : lines)
      if (std::ranges::find(notes_, line) == notes_.end()) notes_.push_back(line);
  };
  const EnvironmentSpec& environment = job_.environment;
  const auto report = [&](std::int32_t key) {
    return maps_->report(environment.keys[static_cast<std::size_t>(key)].map, environment.scale);
  };
  for (const std::int32_t key : {frame.environment.map_a, frame.environment.map_b}) {
    const MapReport map = report(key);
    if (map.path.empty() || !noted_keys_.insert(key).second) continue;
    add(texel_warnings(map));
    add(light_warnings(map));
  }
  if (const CameraMapSpec& camera = environment.camera_map; !camera.file.empty())
    add(texel_warnings(maps_->report(camera.file, camera.scale)));
  if (frame.step == Step(0) || num_jumps_ == kMostJumps) return;
  const FrameNumber before = frames_[(frame.step - 1).index()].number;
  const auto jump = light_jump(environment, before, frame.number,
                               [&](std::int32_t key) { return report(key).mean; });
  if (!jump) return;
  ++num_jumps_;
  add({*jump});
  add(limit_warnings(job_, true));
}

std::vector<std::string> LightSequence::notes() const {
  const std::lock_guard lock(notes_mutex_);
  return notes_;
}

}  // namespace baton

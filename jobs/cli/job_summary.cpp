#include "jobs/cli/job_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "common/job/plan/frame_judgement.h"
#include "jobs/cli/text.h"

namespace baton {

using nlohmann::ordered_json;

namespace {

constexpr std::size_t kMostOdd = 5;

/// Appends the counters to an object.
void add_sampling(const SamplingStats& s, ordered_json& object) {
  object["pixelsFresh"] = s.pixels_fresh;
  object["pixelsCarried"] = s.pixels_carried;
  object["pixelsRestarted"] = s.pixels_restarted;
  object["pixelsRefreshed"] = s.pixels_refreshed;
  object["pixelsRefreshedByRatio"] = s.pixels_refreshed_by_ratio;
  object["pixelsResampled"] = s.pixels_resampled;
  object["localMovesProposed"] = s.local_proposed;
  object["localMovesAccepted"] = s.local_accepted;
  object["independentMovesProposed"] = s.independent_proposed;
  object["independentMovesAccepted"] = s.independent_accepted;
  object["essHistogram"] = s.ess_histogram;
}

/// As numbers a reader of JSON may compare with: null where nothing tells the noise.
void add_quality(const FrameQuality& q, ordered_json& row) {
  if (q.pixels == 0) return;
  if (q.noise_source != NoiseSource::none) {
    row["noise"] = q.noise;
    row["noiseError"] = q.noise_error;
    row["noiseShown"] = q.noise_shown;
    row["noiseFrom"] = noise_source_name(q.noise_source);
  }
  if (q.cycles_noise > 0) row["cyclesNoise"] = q.cycles_noise;
  row["mean"] = q.mean;
  row["pixelsBelowZero"] = q.pixels_below_zero;
  row["lowest"] = q.lowest;
  row["lightBelowZero"] = q.light_below_zero;
  row["clamped"] = q.clamped;
  row["pixelsBeyondHalf"] = q.pixels_beyond_half;
  row["pixelsNotFinite"] = q.pixels_not_finite;
}

ordered_json judgement_json(std::span<const FrameReport> frames) {
  const Judgement j = judge_frames(frames);
  ordered_json odd = ordered_json::array();
  for (const OddFrame& frame : j.odd) {
    odd.push_back({{"frame", frame.frame.value()},
                   {"by", frame.by_noise ? "noise" : "mean"},
                   {"ratio", frame.ratio}});
  }
  ordered_json result = {{"frames", j.frames},
                         {"noise", nullptr},
                         {"noiseFrom", noise_source_name(j.noise_source)},
                         {"framesThatStandOut", odd},
                         {"pixelsBelowZero", j.pixels_below_zero},
                         {"lowest", j.lowest},
                         {"lightBelowZero", j.light_below_zero},
                         {"clamped", j.clamped},
                         {"pixelsBeyondHalf", j.pixels_beyond_half},
                         {"pixelsNotFinite", j.pixels_not_finite},
                         {"pixelsAfresh", j.carries ? j.pixels_afresh : 0}};
  if (j.noise_source != NoiseSource::none) {
    result["noise"] = j.noise;
    result["noiseShown"] = j.noise_shown;
  }
  return result;
}

/// Failures have more, such as how to replay them.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

ExitCode exit_code_of_stopped(JobStatus status) {
  return is_open(status) ? ExitCode::io : exit_code_of(status);
}

ExitCode exit_code_of(JobStatus status) {
  if (status == JobStatus::failed) return ExitCode::failed;
  return status == JobStatus::cancelled ? ExitCode::cancelled : ExitCode::ok;
}

ExitCode exit_code_of(const JobDetail& detail) {
  const JobStatus status = detail.summary.status;
  const bool has_strange_frames = status == JobStatus::failed && !detail.waits.empty();
  return has_strange_frames ? ExitCode::io : exit_code_of(status);
}

std::string eta_text(const Eta& eta) {
  if (!eta.is_known()) return "ETA not known yet";
  return fmt::format("ETA {} ({} to {})", duration_text(eta.likely_s), duration_text(eta.early_s),
                     duration_text(eta.late_s));
}

std::string job_line(const ListedJob& listed) {
  const JobSummary& job = listed.summary;
  const bool has_eta = listed.now.activity == JobActivity::rendering || listed.now.eta.is_known();
  return fmt::format("{}  {:<9}  {:>11} frames  {:>15} tasks  {}{}{}",
                     listed.identity.id.short_hex(), job_activity_name(listed.now.activity),
                     fmt::format("{}/{}", job.frames_done, job.frames_total),
                     fmt::format("{}/{}", job.tasks_done, job.tasks_total), job.name,
                     has_eta ? "  " + eta_text(listed.now.eta) : "",
                     listed.now.reason.empty() ? "" : "  [" + first_line(listed.now.reason) + "]");
}

std::string long_job_line(const ListedJob& listed) {
  const JobTimes& times = listed.identity.times;
  return fmt::format(
      "{}\n          {:<12} priority {:>4}  submitted {}  started {}  ended {}", job_line(listed),
      listed.summary.owner.empty() ? "nobody's" : listed.summary.owner, listed.summary.priority,
      utc_text(times.submitted_ms), utc_text(times.started_ms), utc_text(times.ended_ms));
}

std::string times_text(const JobTimes& times) {
  std::string text;
  if (times.submitted_ms > 0) text += fmt::format("submitted  {}\n", utc_text(times.submitted_ms));
  if (times.started_ms > 0) text += fmt::format("started    {}\n", utc_text(times.started_ms));
  if (times.ended_ms > 0) text += fmt::format("ended      {}\n", utc_text(times.ended_ms));
  return text;
}

std::string job_statistics(const JobSummary& job) {
  const RenderStats& s = job.stats;
  const SamplingStats& did = s.sampling;
  const std::uint64_t lit = did.pixels();
  std::string text = fmt::format(
      "pixels     {}: {} carried, {} fresh, {} refreshed, {} restarted of those with a surface\n",
      count_text(s.pixels), percent_text(did.pixels_carried, lit),
      percent_text(did.pixels_fresh, lit), percent_text(did.pixels_refreshed, lit),
      percent_text(did.pixels_restarted, lit));
  text += fmt::format("rays       {} primary, {} shadow; {} target evaluations\n",
                      count_text(s.rays_primary), count_text(s.rays_shadow),
                      count_text(s.target_evaluations));
  if (did.local_proposed + did.independent_proposed > 0) {
    text += fmt::format("moves      {} local, {} of them accepted; {} independent, {} accepted\n",
                        count_text(did.local_proposed),
                        percent_text(did.local_accepted, did.local_proposed),
                        count_text(did.independent_proposed),
                        percent_text(did.independent_accepted, did.independent_proposed));
    text += fmt::format("resampled  {} of the pixels with a surface\n",
                        percent_text(did.pixels_resampled, lit));
  }
  if (s.light.direct > 0)
    text += fmt::format("bounces    light between surfaces adds {}\n",
                        share_text(s.light.indirect / s.light.direct));
  if (job.state_pixels > 0) {
    text +=
        fmt::format("state      {:.1f} bytes a pixel, {} in all; {:.1f} % of the CPU time\n",
                    static_cast<double>(job.state_bytes) / static_cast<double>(job.state_pixels),
                    bytes_text(job.state_bytes), 100 * s.seconds_state / s.cpu_seconds);
  }
  if (job.states_held > 0)
    text += fmt::format(
        "held       {} states in the memory of workers; a lost worker costs at most {} frames\n",
        job.states_held, job.checkpoint_every);
  text += s.cpu_seconds < 10 ? fmt::format("cpu        {:.1f} s\n", s.cpu_seconds)
                             : fmt::format("cpu        {}\n", duration_text(s.cpu_seconds));
  if (job.attempts_lost > 0)
    text += fmt::format("attempts   {} lost or failed\n", job.attempts_lost);
  return text;
}

std::string judgement_text(const JobDetail& detail) {
  const Judgement j = judge_frames(detail.frames);
  if (j.frames == 0) return "";
  std::string text;
  if (j.noise_source != NoiseSource::none) {
    text += fmt::format("noise      {} of the radiance", share_text(j.noise));
    if (j.frames_told > 1) {
      text += fmt::format(", by frame {} to {} (frame {})", share_text(j.noise_least),
                          share_text(j.noise_most), j.noisiest);
    }
    text += fmt::format("; as shown {}; told from {}\n", share_text(j.noise_shown),
                        j.noise_source == NoiseSource::scatter
                            ? "the scatter of rounds"
                            : "pixels that were sampled twice, without that of edges");
  }
  for (std::size_t i = 0; i < j.odd.size() && i < kMostOdd; ++i) {
    text +=
        fmt::format("stands out frame {}: {} {:.3g} times that of the frames around it\n",
                    j.odd[i].frame, j.odd[i].by_noise ? "noise" : "mean radiance", j.odd[i].ratio);
  }
  if (j.odd.size() > kMostOdd)
    text += fmt::format("           and {} more, in --json\n", j.odd.size() - kMostOdd);
  if (j.carries && j.pixels_afresh > 0) {
    text +=
        fmt::format("afresh     {} of the pixels after the first frame had nothing to go on from\n",
                    percent_text(j.pixels_afresh, j.pixels_after_first));
  }
  if (j.pixels_below_zero > 0) {
    text += fmt::format(
        "below zero {} pixels in {} frames, the lowest {:.3g}; {} {:.2g} % of the light\n",
        j.pixels_below_zero, j.frames_below_zero, j.lowest,
        j.clamped ? "set to 0, which adds" : "kept; to set them to 0 would add",
        100 * j.light_below_zero);
  }
  if (j.pixels_beyond_half > 0) {
    text += fmt::format(
        "very bright {} pixels in {} frames are above 65504: R, G and B of these frames have 32 "
        "bits\n",
        j.pixels_beyond_half, j.frames_beyond_half);
  }
  if (j.pixels_not_finite > 0)
    text += fmt::format("WRONG      {} pixels are NaN or infinite: please report this\n",
                        j.pixels_not_finite);
  return text;
}

ordered_json utc_json(std::int64_t time_ms) {
  return time_ms == 0 ? ordered_json() : ordered_json(utc_iso(time_ms));
}

ordered_json place_json(const TaskPlace& place) {
  ordered_json row = {{"task", task_name(place.kind)},
                      {"firstFrame", place.first.value()},
                      {"lastFrame", place.last.value()}};
  if (place.kind != TaskKind::assemble) row["tile"] = place.tile;
  row["attempt"] = place.attempt;
  return row;
}

std::vector<std::string> fresh_growth(const ShownJob& job, std::size_t& num_told) {
  const std::size_t num_all = job.growth.size();
  const std::size_t first = std::min(std::exchange(num_told, num_all), num_all);
  return {job.growth.begin() + static_cast<std::ptrdiff_t>(first), job.growth.end()};
}

namespace {

/// Seconds from now; null: not known.
ordered_json eta_json(const Eta& eta) {
  if (!eta.is_known()) return nullptr;
  return {{"early", eta.early_s}, {"likely", eta.likely_s}, {"late", eta.late_s}};
}

}  // namespace

ordered_json summary_json(const ListedJob& listed) {
  const JobSummary& job = listed.summary;
  const JobIdentity& who = listed.identity;
  const RenderStats& s = job.stats;
  ordered_json result = {{"id", who.id.hex()},
                         {"version", who.version},
                         {"document", job.version.hex()},
                         {"submitted", utc_json(who.times.submitted_ms)},
                         {"started", utc_json(who.times.started_ms)},
                         {"ended", utc_json(who.times.ended_ms)},
                         {"name", job.name},
                         {"owner", job.owner},
                         {"status", job_status_name(job.status)},
                         {"activity", job_activity_name(listed.now.activity)},
                         {"reason", listed.now.reason},
                         {"eta", eta_json(listed.now.eta)},
                         {"priority", job.priority},
                         {"outputDirectory", job.output_directory},
                         {"framesTotal", job.frames_total},
                         {"framesDone", job.frames_done},
                         {"tasksTotal", job.tasks_total},
                         {"tasksDone", job.tasks_done},
                         {"tasksLeased", job.tasks_leased},
                         {"tasksFailed", job.tasks_failed},
                         {"attemptsLost", job.attempts_lost},
                         {"stateBytes", job.state_bytes},
                         {"statePixels", job.state_pixels},
                         {"statesHeld", job.states_held},
                         {"stats",
                          {{"pixels", s.pixels},
                           {"raysPrimary", s.rays_primary},
                           {"raysShadow", s.rays_shadow},
                           {"targetEvaluations", s.target_evaluations},
                           {"pixelsBackground", s.pixels_background},
                           {"lightDirect", s.light.direct},
                           {"lightIndirect", s.light.indirect},
                           {"stateSeconds", s.seconds_state},
                           {"cpuSeconds", s.cpu_seconds}}}};
  add_sampling(s.sampling, result["stats"]);
  return result;
}

ordered_json detail_json(const ShownJob& job) {
  const JobDetail& detail = job.detail;
  ordered_json result = summary_json({job.identity, detail.summary, job.now});
  result["framesDoneNumbers"] = ordered_json::array();
  for (const FrameNumber frame : detail.frames_done)
    result["framesDoneNumbers"].push_back(frame.value());
  result["locked"] = ordered_json::array();
  for (const FrameNumber frame : job.locked) result["locked"].push_back(frame.value());
  if (!detail.waits.empty()) result["waits"] = detail.waits;
  result["judgement"] = judgement_json(detail.frames);
  result["frames"] = ordered_json::array();
  for (const FrameReport& frame : detail.frames) {
    ordered_json row = {{"frame", frame.frame.value()}};
    add_sampling(frame.sampling, row);
    add_quality(frame.quality, row);
    result["frames"].push_back(std::move(row));
  }
  if (!job.growth.empty()) result["growth"] = job.growth;
  result["failures"] = detail.failures;
  result["warnings"] = detail.notes;
  return result;
}

}  // namespace baton

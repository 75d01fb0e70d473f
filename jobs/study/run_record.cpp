#include "jobs/study/run_record.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

using nlohmann::json;

/// Visits every count with its name; Counts is RunCounts or const RunCounts.
template <class Counts, class F>
void visit_counts(Counts& c, F visit) {
  visit("pixels", c.pixels);
  visit("pixelsBackground", c.pixels_background);
  visit("raysShadow", c.rays_shadow);
  visit("targetEvaluations", c.target_evaluations);
  visit("movesProposed", c.moves_proposed);
  visit("pixelsResampled", c.pixels_resampled);
  visit("pixelsRestarted", c.pixels_restarted);
  visit("cpuSeconds", c.cpu_seconds);
  visit("secondsLight", c.seconds_light);
  visit("secondsPrimary", c.seconds_primary);
  visit("secondsSample", c.seconds_sample);
  visit("secondsVisibility", c.seconds_visibility);
  visit("secondsShade", c.seconds_shade);
  visit("secondsSecondPass", c.seconds_second_pass);
}

template <class Frame, class F>
void visit_frame(Frame& m, F visit) {
  visit("frame", m.frame);
  visit("mse", m.mse);
  visit("relMse", m.rel_mse);
  visit("flip", m.flip);
  visit("percentile999", m.percentile_99_9);
  visit("shownMse", m.shown.mse);
  visit("shownDarkestMse", m.shown.darkest_mse);
  visit("shownWorstBlockMse", m.shown.worst_block_mse);
  visit("shownPercentile999", m.shown.percentile_99_9);
  visit("black", m.shown.black);
  visit("bias", m.bias);
  visit("lnsMean", m.lns_mean);
  visit("lnsMedian", m.lns_median);
  visit("ess", m.ess);
  visit("acceptance", m.acceptance);
  visit("flicker", m.flicker);
  visit("blockMse", m.block_mse);
}

/// JSON has no NaN: null stands for it.
struct Write {
  json& out;
  void operator()(const char* name, const auto& value) const { out[name] = value; }
  void operator()(const char* name, FrameNumber value) const { out[name] = value.value(); }
};
struct Read {
  const json& in;
  void operator()(const char* name, auto& value) const { in.at(name).get_to(value); }
  void operator()(const char* name, FrameNumber& value) const {
    value = FrameNumber(in.at(name).get<std::int32_t>());
  }
  void operator()(const char* name, double& value) const {
    value = in.at(name).is_null() ? kNotMeasured : in.at(name).get<double>();
  }
};

RunRecord record_of(const json& root) {
  RunRecord record;
  root.at("key").get_to(record.key);
  root.at("stateBytes").get_to(record.state_bytes);
  root.at("statePixels").get_to(record.state_pixels);
  root.at("framesRendered").get_to(record.frames_rendered);
  visit_counts(record.counts, Read{root.at("stats")});
  for (const json& item : root.at("frames")) {
    record.frames.emplace_back();
    visit_frame(record.frames.back(), Read{item});
  }
  return record;
}

}  // namespace

RunCounts counts_of(const RenderStats& stats) {
  return {.pixels = stats.pixels,
          .pixels_background = stats.pixels_background,
          .rays_shadow = stats.rays_shadow + stats.rays_second_pass,
          .target_evaluations = stats.target_evaluations,
          .moves_proposed = stats.sampling.local_proposed + stats.sampling.independent_proposed,
          .pixels_resampled = stats.sampling.pixels_resampled,
          .pixels_restarted = stats.sampling.pixels_restarted,
          .cpu_seconds = stats.cpu_seconds,
          .seconds_light = stats.seconds_light,
          .seconds_primary = stats.seconds_primary,
          .seconds_sample = stats.seconds_sample,
          .seconds_visibility = stats.seconds_visibility,
          .seconds_shade = stats.seconds_shade,
          .seconds_second_pass = stats.seconds_second_pass};
}

Status write_record(const std::filesystem::path& path, const RunRecord& record) {
  json root = {{"key", record.key},
               {"stateBytes", record.state_bytes},
               {"statePixels", record.state_pixels},
               {"framesRendered", record.frames_rendered},
               {"stats", json::object()},
               {"frames", json::array()}};
  visit_counts(record.counts, Write{root["stats"]});
  for (const FrameMeasures& frame : record.frames) {
    json item = json::object();
    visit_frame(frame, Write{item});
    root["frames"].push_back(std::move(item));
  }
  const std::string text = root.dump(1, ' ', false, json::error_handler_t::replace);
  return write_file_unsynced(path, as_bytes_view(text));
}

std::optional<RunRecord> read_record(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, limits::kMaxJobFileBytes);
  if (!text) return std::nullopt;
  try {
    return record_of(json::parse(*text));
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace baton

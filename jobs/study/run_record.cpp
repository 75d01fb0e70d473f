#include "jobs/study/run_record.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

using nlohmann::json;

/// Visits every number of a record with its name; T is RunRecord or const RunRecord.
template <class Stats, class F>
void visit_stats(Stats& s, F visit) {
  visit("pixels", s.pixels);
  visit("raysPrimary", s.rays_primary);
  visit("raysShadow", s.rays_shadow);
  visit("targetEvaluations", s.target_evaluations);
  visit("pixelsBackground", s.pixels_background);
  visit("pixelsFresh", s.sampling.pixels_fresh);
  visit("pixelsCarried", s.sampling.pixels_carried);
  visit("pixelsRestarted", s.sampling.pixels_restarted);
  visit("pixelsRefreshed", s.sampling.pixels_refreshed);
  visit("pixelsResampled", s.sampling.pixels_resampled);
  visit("localMovesProposed", s.sampling.local_proposed);
  visit("localMovesAccepted", s.sampling.local_accepted);
  visit("independentMovesProposed", s.sampling.independent_proposed);
  visit("independentMovesAccepted", s.sampling.independent_accepted);
  visit("cpuSeconds", s.cpu_seconds);
  visit("secondsLight", s.seconds_light);
  visit("secondsPrimary", s.seconds_primary);
  visit("secondsSample", s.seconds_sample);
  visit("secondsVisibility", s.seconds_visibility);
  visit("secondsShade", s.seconds_shade);
}

template <class Frame, class F>
void visit_frame(Frame& m, F visit) {
  visit("frame", m.frame);
  visit("mse", m.mse);
  visit("relMse", m.rel_mse);
  visit("flip", m.flip);
  visit("percentile999", m.percentile_99_9);
  visit("bias", m.bias);
  visit("lnsMean", m.lns_mean);
  visit("lnsMedian", m.lns_median);
  visit("ess", m.ess);
  visit("acceptance", m.acceptance);
  visit("flicker", m.flicker);
}

/// JSON has no NaN: null stands for it.
struct Write {
  json& out;
  void operator()(const char* name, const auto& value) const { out[name] = value; }
};
struct Read {
  const json& in;
  void operator()(const char* name, auto& value) const { in.at(name).get_to(value); }
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
  visit_stats(record.stats, Read{root.at("stats")});
  for (const json& item : root.at("frames")) {
    record.frames.emplace_back();
    visit_frame(record.frames.back(), Read{item});
  }
  return record;
}

}  // namespace

Status write_record(const std::filesystem::path& path, const RunRecord& record) {
  json root = {{"key", record.key},
               {"stateBytes", record.state_bytes},
               {"statePixels", record.state_pixels},
               {"framesRendered", record.frames_rendered},
               {"stats", json::object()},
               {"frames", json::array()}};
  visit_stats(record.stats, Write{root["stats"]});
  for (const FrameMeasures& frame : record.frames) {
    json item = json::object();
    visit_frame(frame, Write{item});
    root["frames"].push_back(std::move(item));
  }
  const std::string text = root.dump(1);
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

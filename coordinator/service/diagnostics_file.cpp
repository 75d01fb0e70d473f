#include "coordinator/service/diagnostics_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <tuple>

#include "common/base/files.h"
#include "common/job/plan/timeline.h"

namespace baton {
namespace {

constexpr std::string_view kFirstColumns = "frame,tile,pixels,";
constexpr std::uint64_t kMaxDiagnosticsBytes = 1ull << 30;

/// quality: of a frame that is written; else its columns stay empty.
std::string line(FrameNumber frame_number, const std::string& tile, const SamplingStats& s,
                 const FrameQuality& quality = {}) {
  std::string text =
      fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}", frame_number, tile, s.pixels(),
                  s.pixels_carried, s.pixels_fresh, s.pixels_refreshed, s.pixels_refreshed_by_ratio,
                  s.pixels_restarted, s.pixels_resampled, s.local_proposed, s.local_accepted,
                  s.independent_proposed, s.independent_accepted);
  for (const std::uint64_t count : s.ess_histogram) text += fmt::format(",{}", count);
  if (quality.pixels == 0) return text + ",,,,,,,,\n";
  return text + fmt::format(",{:.6g},{},{:.6g},{},{:.6g},{:.3g},{},{}\n", quality.noise,
                            noise_source_name(quality.noise_source), quality.mean,
                            quality.pixels_below_zero, quality.lowest, quality.light_below_zero,
                            quality.pixels_beyond_half, quality.pixels_not_finite);
}

}  // namespace

std::string diagnostics_header() {
  std::string text =
      std::string(kFirstColumns) +
      "carried,fresh,refreshed,refreshedByRatio,restarted,resampled,"
      "localMovesProposed,localMovesAccepted,independentMovesProposed,independentMovesAccepted";
  for (std::size_t bin = 0; bin < SamplingStats::kEssBins; ++bin) {
    text += fmt::format(",essRatioFrom{:.3f}",
                        static_cast<double>(bin) / static_cast<double>(SamplingStats::kEssBins));
  }
  return text +
         ",noise,noiseFrom,mean,pixelsBelowZero,lowest,lightBelowZero,pixelsBeyondHalf,"
         "pixelsNotFinite\n";
}

std::string diagnostics_lines(std::vector<TileDiagnostics> tiles,
                              const std::map<FrameIndex, FrameQuality>& qualities,
                              const std::vector<FrameNumber>& frames) {
  using Tile = TileDiagnostics;
  std::sort(tiles.begin(), tiles.end(), [](const Tile& a, const Tile& b) {
    return std::tie(a.frame, a.tile) < std::tie(b.frame, b.tile);
  });
  std::string text;
  for (auto first = tiles.begin(); first != tiles.end();) {
    const auto last = std::find_if(first, tiles.end(),
                                   [&](const Tile& tile) { return tile.frame != first->frame; });
    const FrameNumber number = frames.at(first->frame.index());

    SamplingStats sum;
    std::for_each(first, last, [&](const Tile& tile) { sum.merge(tile.sampling); });
    const auto quality = qualities.find(first->frame);
    text += line(number, "all", sum, quality != qualities.end() ? quality->second : FrameQuality{});
    for (; first != last; ++first)
      text += line(number, std::to_string(first->tile), first->sampling);
  }
  return text;
}

namespace {

/// What the tiles did in the frames of a run of the first sweep, over all sweeps.
Result<std::vector<TileDiagnostics>> tiles_of(Journal& journal, const Digest& digest,
                                              const Timeline& timeline, const StepSpan& run) {
  std::map<std::pair<FrameIndex, std::int32_t>, SamplingStats> sums;  // by frame and tile
  for (StepSpan steps = run; steps.first < Step(timeline.num_steps());
       steps = {steps.first + timeline.num_frames(), steps.last + timeline.num_frames()}) {
    const Run end = timeline.run_of(steps.last) + 1;
    for (Run of_sweep = timeline.run_of(steps.first); of_sweep < end; ++of_sweep) {
      BATON_ASSIGN(const std::vector<FrameStats> all, journal.run_stats(digest, of_sweep));
      for (const FrameStats& stats : all) {
        if (!steps.contains(stats.step())) continue;
        sums[{timeline.frame_of(stats.step()), stats.tile}].merge(stats.sampling);
      }
    }
  }
  std::vector<TileDiagnostics> result;
  for (const auto& [place, sum] : sums) result.push_back({place.first, place.second, sum});
  return result;
}

/// Error (io): the file is there and is somebody's table.
Status expect_replaceable(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::symlink_status(path, error))) return {};
  BATON_ASSIGN(const std::string before, read_text_file(path, kMaxDiagnosticsBytes));
  if (before.starts_with(kFirstColumns)) return {};
  return Error{ErrorKind::io, path.string() + ": is not by Baton and is kept"};
}

}  // namespace

Status write_diagnostics(Journal& journal, const Digest& digest, const JobSpec& job,
                         const Roots& roots) {
  // Run by run: the rows of all tiles of a long job need not be in memory at once, their text may.
  std::string text;
  const Timeline timeline(job);
  for (Run run{0}; run < Run(timeline.num_runs()); ++run) {
    const StepSpan steps = timeline.steps_of(run);
    if (timeline.sweep_of(steps.first) > Sweep(0)) break;
    BATON_ASSIGN(std::vector<TileDiagnostics> tiles, tiles_of(journal, digest, timeline, steps));
    std::map<FrameIndex, FrameQuality> qualities;
    for (const TileDiagnostics& tile : tiles) {
      if (qualities.contains(tile.frame)) continue;
      BATON_ASSIGN(const std::optional<FrameStats> whole, journal.frame_stats(digest, tile.frame));
      qualities[tile.frame] = whole ? whole->quality : FrameQuality{};
    }
    text += diagnostics_lines(std::move(tiles), qualities, job.frames);
  }
  if (text.empty()) return {};
  text.insert(0, diagnostics_header());
  const auto path = std::filesystem::path(job.output.directory) / "diagnostics.csv";
  BATON_TRY(expect_replaceable(path));
  return write_file_atomic(path, std::as_bytes(std::span(text)), roots);
}

}  // namespace baton

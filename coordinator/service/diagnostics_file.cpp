#include "coordinator/service/diagnostics_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <tuple>

#include "common/base/files.h"
#include "common/job/sequence.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {
namespace {

/// quality: of a frame that is written; else its columns stay empty.
std::string line(int frame_number, const std::string& tile, const SamplingStats& s,
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
      "frame,tile,pixels,carried,fresh,refreshed,refreshedByRatio,restarted,resampled,"
      "localMovesProposed,localMovesAccepted,independentMovesProposed,independentMovesAccepted";
  for (std::size_t bin = 0; bin < SamplingStats::kEssBins; ++bin) {
    text += fmt::format(",essRatioFrom{:.3f}",
                        static_cast<double>(bin) / static_cast<double>(SamplingStats::kEssBins));
  }
  return text +
         ",noise,noiseFrom,mean,pixelsBelowZero,lowest,lightBelowZero,pixelsBeyondHalf,"
         "pixelsNotFinite\n";
}

std::string diagnostics_lines(std::vector<FrameStats> stats,
                              const std::map<std::int32_t, FrameQuality>& qualities,
                              const std::vector<int>& frame_numbers) {
  std::sort(stats.begin(), stats.end(), [](const FrameStats& a, const FrameStats& b) {
    return std::tie(a.frame, a.tile) < std::tie(b.frame, b.tile);
  });
  std::string text;
  for (auto first = stats.begin(); first != stats.end();) {
    const auto last = std::find_if(first, stats.end(),
                                   [&](const FrameStats& s) { return s.frame != first->frame; });
    const int number = frame_numbers.at(static_cast<std::size_t>(first->frame));

    SamplingStats sum;
    std::for_each(first, last, [&](const FrameStats& s) { sum.merge(s.sampling); });
    const auto quality = qualities.find(first->frame);
    text += line(number, "all", sum, quality != qualities.end() ? quality->second : FrameQuality{});
    for (; first != last; ++first)
      text += line(number, std::to_string(first->tile), first->sampling);
  }
  return text;
}

namespace {

/// What the tiles did in these frames, over all sweeps.
Result<std::vector<FrameStats>> stats_of(Journal& journal, const Digest& digest, const JobSpec& job,
                                         const JobGraph& graph, const FrameSpan& frames) {
  std::map<std::pair<std::int32_t, std::int32_t>, FrameStats> sums;  // by frame and tile
  for (std::int32_t sweep = 0; sweep < job.quality.sweeps; ++sweep) {
    const std::int32_t first = sweep * graph.num_frames() + frames.first;
    const std::int32_t last = sweep * graph.num_frames() + frames.last;
    for (std::int32_t run = graph.run_of(first); run <= graph.run_of(last); ++run) {
      BATON_ASSIGN(const std::vector<FrameStats> all,
                   journal.frame_stats(digest, TaskKind::render, run));
      for (FrameStats stats : all) {
        if (stats.frame < first || stats.frame > last) continue;
        stats.frame = frame_of_step(job, stats.frame);
        const auto [sum, is_new] = sums.try_emplace({stats.frame, stats.tile}, stats);
        if (!is_new) sum->second.merge(stats);
      }
    }
  }
  std::vector<FrameStats> result;
  for (const auto& [place, stats] : sums) result.push_back(stats);
  return result;
}

}  // namespace

Status write_diagnostics(Journal& journal, const Digest& digest, const JobSpec& job) {
  // Run by run: the rows of all tiles of a long job need not be in memory at once, their text may.
  std::string text;
  const JobGraph graph(job);
  for (std::int32_t run = 0; run < graph.num_runs(); ++run) {
    const FrameSpan frames{graph.first_frame(run), graph.last_frame(run)};
    if (frames.first >= graph.num_frames()) break;  // of a later sweep
    BATON_ASSIGN(std::vector<FrameStats> stats, stats_of(journal, digest, job, graph, frames));
    std::map<std::int32_t, FrameQuality> qualities;
    for (const FrameStats& of_tile : stats) {
      if (qualities.contains(of_tile.frame)) continue;
      BATON_ASSIGN(const std::vector<FrameStats> whole,
                   journal.frame_stats(digest, TaskKind::assemble, of_tile.frame));
      qualities[of_tile.frame] = whole.empty() ? FrameQuality{} : whole.front().quality;
    }
    text += diagnostics_lines(std::move(stats), qualities, job.frames);
  }
  if (text.empty()) return {};
  text.insert(0, diagnostics_header());
  const auto path = std::filesystem::path(job.output.directory) / "diagnostics.csv";
  return write_file_atomic(path, std::as_bytes(std::span(text)));
}

}  // namespace baton

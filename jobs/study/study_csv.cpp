#include "jobs/study/study_csv.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace baton {
namespace {

/// Empty when there is no such number.
std::string number(double value) {
  return std::isnan(value) ? std::string() : fmt::format("{:.6g}", value);
}

double per(std::uint64_t count, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(count) / static_cast<double>(whole);
}

/// Calls line(labels, run) for every rendering.
template <class F>
void for_each_run(const Study& study, const StudyResults& results, F line) {
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const StudyCell& cell = study.cells[c];
    for (std::size_t s = 0; s < results.runs[c].size(); ++s) {
      line(fmt::format("{},{},{},{}", study.scenes[cell.scene].name, study.methods[cell.method],
                       cell.budget, s + 1),
           results.runs[c][s]);
    }
  }
}

}  // namespace

std::string measurements_csv(const Study& study, const StudyResults& results) {
  std::string csv =
      "scene,method,budget,seed,frame,mse,relMse,flip,percentile99.9,shownMse,shownDarkestMse,"
      "shownWorstBlockMse,shownPercentile99.9,black,bias,lnsMean,lnsMedian,ess,"
      "acceptance,flicker,raysPerPixel,evaluationsPerPixel,resampledShare,restartedShare\n";
  for_each_run(study, results, [&](const std::string& labels, const RunRecord& run) {
    const RunCounts& s = run.counts;
    const std::uint64_t lit = s.lit_pixels();
    for (const FrameMeasures& m : run.frames) {
      fmt::format_to(std::back_inserter(csv),
                     "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", labels,
                     m.frame, number(m.mse), number(m.rel_mse), number(m.flip),
                     number(m.percentile_99_9), number(m.shown.mse), number(m.shown.darkest_mse),
                     number(m.shown.worst_block_mse), number(m.shown.percentile_99_9),
                     number(m.shown.black), number(m.bias), number(m.lns_mean),
                     number(m.lns_median), number(m.ess), number(m.acceptance), number(m.flicker),
                     number(per(s.rays_shadow, lit)), number(per(s.target_evaluations, lit)),
                     number(per(s.pixels_resampled, lit)), number(per(s.pixels_restarted, lit)));
    }
  });
  return csv;
}

std::string costs_csv(const Study& study, const StudyResults& results) {
  std::string csv =
      "scene,method,budget,seed,frames,litPixels,cpuSeconds,secondsLight,secondsPrimary,"
      "secondsSample,secondsVisibility,secondsShade,secondsSecondPass,stateBytesPerPixel,"
      "raysPerPixel,evaluationsPerPixel,movesPerPixel\n";
  for_each_run(study, results, [&](const std::string& labels, const RunRecord& run) {
    const RunCounts& s = run.counts;
    fmt::format_to(std::back_inserter(csv), "{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", labels,
                   run.frames_rendered, s.lit_pixels(), number(s.cpu_seconds),
                   number(s.seconds_light), number(s.seconds_primary), number(s.seconds_sample),
                   number(s.seconds_visibility), number(s.seconds_shade),
                   number(s.seconds_second_pass), number(per(run.state_bytes, run.state_pixels)),
                   number(per(s.rays_shadow, s.lit_pixels())),
                   number(per(s.target_evaluations, s.lit_pixels())),
                   number(per(s.moves_proposed, s.lit_pixels())));
  });
  return csv;
}

std::string references_csv(const Study& study, const StudyResults& results) {
  std::string csv = "scene,frame,litPixels,meanRadiance,rmseByHalves,rmseReported\n";
  for (std::size_t i = 0; i < study.scenes.size(); ++i) {
    for (std::size_t f = 0; f < study.scenes[i].frames.size(); ++f) {
      const Reference& r = results.references[i][f];
      fmt::format_to(std::back_inserter(csv), "{},{},{},{},{},{}\n", study.scenes[i].name,
                     study.scenes[i].frames[f], r.lit_pixels.size(), number(r.mean_radiance),
                     number(std::sqrt(r.mse)), number(std::sqrt(r.reported_mse)));
    }
  }
  return csv;
}

std::string efficiency_csv(const Study& study, const std::vector<CellSummary>& rows) {
  std::string csv =
      "scene,method,budget,cpuMicrosecondsPerPixel,raysPerPixel,evaluationsPerPixel,"
      "lightMillisecondsPerFrame,stateBytesPerPixel,rmse,rmseLow,rmseHigh,relMse,relMseLow,"
      "relMseHigh,shown,shownLow,shownHigh,shownDarkest,shownWorstBlock,shownPercentile99.9,black,"
      "flip,flipLow,flipHigh,percentile99.9,bias,biasLow,biasHigh,flicker,lag,resolved,"
      "efficiencyOverMis,overMisLow,overMisHigh,efficiencyOverBidirectional,overBidirectionalLow,"
      "overBidirectionalHigh,shownEfficiencyOverMis,shownOverMisLow,shownOverMisHigh,"
      "shownEfficiencyOverBidirectional,shownOverBidirectionalLow,shownOverBidirectionalHigh\n";
  const auto interval = [](const Interval& i) {
    return fmt::format("{},{},{}", number(i.value), number(i.low), number(i.high));
  };
  for (const CellSummary& row : rows) {
    const StudyCell& cell = study.cells[row.cell];
    fmt::format_to(std::back_inserter(csv),
                   "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                   study.scenes[cell.scene].name, study.methods[cell.method], cell.budget,
                   number(row.cost.cpu_us), number(row.cost.rays), number(row.cost.evaluations),
                   number(row.cost.light_ms), number(row.cost.state_bytes), interval(row.rmse),
                   interval(row.rel_mse), interval(row.shown), number(row.shown_darkest),
                   number(row.shown_worst_block), number(row.shown_percentile), number(row.black),
                   interval(row.flip), number(row.percentile_99_9), interval(row.bias),
                   number(row.flicker.value), number(row.lag), row.resolved ? 1 : 0,
                   interval(row.against_mis), interval(row.against_bidirectional),
                   interval(row.shown_against_mis), interval(row.shown_against_bidirectional));
  }
  return csv;
}

}  // namespace baton

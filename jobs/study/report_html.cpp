#include "jobs/study/report_html.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include "common/base/version.h"
#include "jobs/study/auto_table.h"
#include "jobs/study/svg_text.h"
#include "jobs/study/verdict.h"

namespace baton {
namespace {

constexpr int kFewSeeds = 20;
/// Charts of a scene that are shown, over all frames and frame by frame; the others are folded.
constexpr std::size_t kShownOverview = 4, kShownCourses = 2;

constexpr const char* kStyle = R"(
body{font:14px/1.45 Helvetica,Arial,sans-serif;margin:2em auto;max-width:1320px;color:#222}
table{border-collapse:collapse;margin:1em 0}
td,th{padding:2px 9px;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}
td:first-child,td:nth-child(2),th:first-child,th:nth-child(2){text-align:left}
.good{color:#00703c;font-weight:bold}.bad{color:#b02a00}.weak{color:#888}
.charts svg{width:48%;height:auto;min-width:420px}img{max-width:100%;image-rendering:pixelated}
.note{color:#555}
)";

std::string base64(ByteView bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group =
          group << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= bytes.size() - i ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A ratio of efficiencies with its interval; plainly better or worse ones stand out.
std::string ratio_cell(const Interval& ratio) {
  if (std::isnan(ratio.value)) return "<td></td>";
  const char* const kind = ratio.low > 1 ? "good" : ratio.high < 1 ? "bad" : "weak";
  return fmt::format("<td class=\"{}\">{:.2f} [{:.2f}, {:.2f}]</td>", kind, ratio.value, ratio.low,
                     ratio.high);
}

std::string interval_cell(const Interval& i) {
  if (std::isnan(i.value)) return "<td></td>";
  return fmt::format("<td>{:.3g} [{:.3g}, {:.3g}]</td>", i.value, i.low, i.high);
}

std::string summary_table(const Study& study, std::size_t scene,
                          const std::vector<CellSummary>& rows) {
  std::string html =
      "<table><tr><th>method</th><th>budget</th><th>CPU &micro;s/px</th><th>rays/px</th>"
      "<th>light ms/frame</th><th>RMSE</th><th>as shown</th><th>darkest quarter</th><th>worst "
      "block</th><th>black</th>"
      "<th>relMSE</th><th>FLIP</th><th>99.9 %</th>"
      "<th>bias</th><th>flicker</th><th>lag</th><th>state B/px</th><th>efficiency / mis</th>"
      "<th>efficiency / bidirectional</th><th>as shown / mis</th><th>as shown / "
      "bidirectional</th></tr>\n";
  for (const CellSummary& row : rows) {
    const StudyCell& cell = study.cells[row.cell];
    if (cell.scene != scene) continue;
    fmt::format_to(std::back_inserter(html),
                   "<tr><td>{}</td><td>{}</td><td>{:.3g}</td><td>{:.3g}</td><td>{:.3g}</"
                   "td>{}{}<td>{:.3g}</td><td>{:.3g}</td><td>{:.2g} %</td>{}{}"
                   "<td>{:.3g}</td><td{}>{:.2g} [{:.2g}, {:.2g}]</td>{}<td>{}</td><td>{:.3g}</td>",
                   escaped(study.methods[cell.method]), escaped(cell.budget), row.cost.cpu_us,
                   row.cost.rays, row.cost.light_ms, interval_cell(row.rmse),
                   interval_cell(row.shown), row.shown_darkest, row.shown_worst_block,
                   100 * row.black, interval_cell(row.rel_mse), interval_cell(row.flip),
                   row.percentile_99_9, row.biased ? " class=\"bad\"" : "", row.bias.value,
                   row.bias.low, row.bias.high, interval_cell(row.flicker),
                   std::isnan(row.lag) ? "" : fmt::format("{}", row.lag), row.cost.state_bytes);
    html += row.resolved ? ratio_cell(row.against_mis) + ratio_cell(row.against_bidirectional) +
                               ratio_cell(row.shown_against_mis) +
                               ratio_cell(row.shown_against_bidirectional)
                         : "<td class=\"weak\" colspan=\"4\">below the reference's own error</td>";
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string reference_note(const Study& study, const StudyResults& results, std::size_t scene) {
  double mean = 0;
  for (const Reference& r : results.references[scene])
    mean += r.mean_radiance / static_cast<double>(results.references[scene].size());
  return fmt::format(
      "<p class=\"note\">Reference: two halves of {} sample pairs a pixel; mean radiance {:.4g}, "
      "own "
      "RMSE {:.3g}. Frames measured: {}.</p>\n",
      study.scenes[scene].reference[0].sampling.reference_samples, mean,
      reference_error(results.references[scene], ErrorKindOfImage::rmse, {}),
      study.scenes[scene].frames.size());
}

std::string charts_block(std::span<const std::string> svgs) {
  std::string html = "<div class=\"charts\">\n";
  for (const std::string& svg : svgs) html += svg;
  return html + "</div>\n";
}

std::string folded(const char* title, std::span<const std::string> svgs) {
  if (svgs.empty()) return "";
  return fmt::format("<details><summary>{}: {} charts</summary>{}</details>\n", title, svgs.size(),
                     charts_block(svgs));
}

std::string verdict_list(const Study& study, const StudyResults& results,
                         const std::vector<CellSummary>& rows) {
  std::string html = "<ul class=\"verdicts\">\n";
  for (const Verdict& verdict : verdicts(study, results, rows)) {
    html += fmt::format("<li><b>{}</b>: {}</li>\n", escaped(study.scenes[verdict.scene].name),
                        escaped(verdict_text(study, verdict)));
  }
  return html + "</ul>\n";
}

std::string crops_block(const Study& study, const StudyResults& results, std::size_t scene,
                        const ReportCrops& crops) {
  std::string caption = "reference";
  for (const std::size_t cell : crops.cells) {
    caption += fmt::format(" &middot; {} {} ({:.2g} &micro;s/px)", escaped(study.method_of(cell)),
                           escaped(study.cells[cell].budget), cell_cost(results.runs[cell]).cpu_us);
  }
  return fmt::format(
      "<h3>About equal time, frame {}, seed 1</h3><img alt=\"crops\" "
      "src=\"data:image/png;base64,{}\"><p class=\"note\">From left to right: {}. Below: FLIP, "
      "black "
      "0 to pale yellow 1.</p>\n",
      study.scenes[scene].frames.back(), base64(crops.png), caption);
}

}  // namespace

std::string report_html(const Study& study, const StudyResults& results,
                        const std::vector<CellSummary>& rows,
                        const std::vector<ReportScene>& scenes, const std::string& machine) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>"
      "<style>{1}</style></head><body>\n<h1>{0}</h1>\n"
      "<p class=\"note\">baton {2} on {3}. {4} seeds; bands and brackets are 95 % intervals over "
      "seeds (bootstrap), each by itself. Errors are over pixels with a surface; squared errors "
      "are "
      "taken against two independent halves of the reference, so that its noise drops out. CPU "
      "time "
      "is the middle one of the seeds, of primary rays, sampling, visibility, shading and the "
      "second pass; light is apart. Efficiency is 1 / (MSE x time), over that of the baseline with "
      "the same budget, or "
      "its "
      "best; above 1 is better. {5}</p>\n",
      escaped(study.name), kStyle, kVersion, escaped(machine), study.num_seeds,
      study.num_seeds < kFewSeeds ? "<b>Fewer than 20 seeds: the bands are rough.</b>" : "");
  html += verdict_list(study, results, rows);
  html += auto_html(study, results);
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    html += fmt::format("<h2>{}</h2>\n", escaped(study.scenes[i].name));
    html += reference_note(study, results, i);
    const std::span<const std::string> overview(scenes[i].overview), courses(scenes[i].courses);
    const std::size_t overviews = std::min(overview.size(), kShownOverview);
    const std::size_t shown = std::min(courses.size(), kShownCourses);
    html += charts_block(overview.first(overviews));
    html += summary_table(study, i, rows);
    html += crops_block(study, results, i, scenes[i].crops);
    if (shown > 0) html += "<h3>Over the frames</h3>" + charts_block(courses.first(shown));
    html += folded("Against rays instead of time", overview.subspan(overviews));
    html += folded("More over the frames", courses.subspan(shown));
    html += folded("Each frame by itself", scenes[i].frames);
  }
  return html + "</body></html>\n";
}

}  // namespace baton

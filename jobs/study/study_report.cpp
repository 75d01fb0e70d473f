#include "jobs/study/study_report.h"

#include <fmt/format.h>

#include <iterator>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "jobs/study/auto_table.h"
#include "jobs/study/crop_strip.h"
#include "jobs/study/report_html.h"
#include "jobs/study/study_csv.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

Status publish(const fs::path& path, const std::string& text) {
  return write_file_atomic(path, as_bytes_view(text));
}

/// The crops of a scene at its last measured frame, about equal time.
Result<ReportCrops> make_crops(const Study& study, const StudyResults& results,
                               const StudyFolder& folder, const fs::path& output,
                               std::size_t index) {
  const StudyScene& scene = study.scenes[index];
  ReportCrops crops;
  crops.cells = equal_time_cells(study, results, index);
  std::vector<MeasuredFrame> pictures;
  for (const std::size_t cell : crops.cells) {
    const fs::path frames = folder.frames_folder(results.runs[cell].front().key);
    BATON_ASSIGN(MeasuredFrame frame, read_measured_frame(frame_file(frames, scene.frames.back())));
    pictures.push_back(std::move(frame));
  }
  const fs::path path = output / (file_slug(scene.name) + "-crops.png");
  const Reference& reference = results.references[index].back();
  BATON_TRY(write_png(path, crop_strip(reference, pictures, scene.crop)));
  BATON_ASSIGN(crops.png, read_file(path, limits::kMaxAssetFileBytes));
  return crops;
}

Status write_charts(const fs::path& output, const std::vector<NamedChart>& charts,
                    std::vector<std::string>& svgs) {
  for (const NamedChart& named : charts) {
    svgs.push_back(svg_chart(named.chart));
    BATON_TRY(publish(output / named.file, svgs.back()));
  }
  return {};
}

}  // namespace

Result<fs::path> write_report(const Study& study, const StudyResults& results,
                              const StudyFolder& folder, const fs::path& output,
                              const std::string& machine) {
  const std::vector<CellSummary> rows = summarize_study(study, results);
  BATON_TRY(publish(output / "measurements.csv", measurements_csv(study, results)));
  BATON_TRY(publish(output / "costs.csv", costs_csv(study, results)));
  BATON_TRY(publish(output / "references.csv", references_csv(study, results)));
  BATON_TRY(publish(output / "efficiency.csv", efficiency_csv(study, rows)));
  BATON_TRY(publish(output / "auto.csv", auto_csv(study, results)));

  std::vector<ReportScene> scenes(study.scenes.size());
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    ReportScene& scene = scenes[i];
    BATON_TRY(write_charts(output, error_charts(study, results, i, {}), scene.overview));
    BATON_TRY(write_charts(output, temporal_charts(study, results, i), scene.courses));
    for (std::size_t f = 0; f < study.scenes[i].frames.size(); ++f)
      BATON_TRY(write_charts(output, error_charts(study, results, i, f), scene.frames));
    BATON_ASSIGN(scene.crops, make_crops(study, results, folder, output, i));
  }
  const fs::path path = output / "report.html";
  BATON_TRY(publish(path, report_html(study, results, rows, scenes, machine)));
  return path;
}

}  // namespace baton

#include "jobs/lab/stability/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "common/base/files.h"

namespace baton::stability {
namespace {

constexpr std::uint64_t kMaxTableBytes = 1 << 20;
constexpr const char* kHeader = "case,subject,full,quick";

std::string key_of(const std::string& case_name, const std::string& subject) {
  return case_name + "," + subject;
}

Status write_text(const std::filesystem::path& path, const std::string& text) {
  return write_file_atomic(path, std::as_bytes(std::span(text)));
}

}  // namespace

Result<std::vector<Cell>> run_case(const Case& c, const std::vector<Subject>& subjects,
                                   const Effort& effort, const std::filesystem::path& stage_folder,
                                   int threads) {
  const Timeline time = c.timeline(effort);
  const Stage stage(stage_folder);
  JobSpec job = c.build(stage, time);
  job.frames = time.judged();
  BATON_ASSIGN(const Truth truth, exact_truth(job, effort.fine ? c.nodes : c.nodes / 2, threads));

  // Measure every subject.
  BATON_ASSIGN(const std::vector<Observations> seen,
               observe(job, time, subjects, effort.runs, threads));
  std::vector<Cell> cells;
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    Cell& cell = cells.emplace_back();
    cell.case_name = c.name;
    cell.subject = subjects[s].name;
    cell.summary = summarise(time, truth, seen[s]);
    cell.quadrature_error = truth.quadrature_error;
    const RenderStats& stats = seen[s].stats;
    cell.cpu_seconds = stats.cpu_seconds - stats.seconds_light;
    cell.pixel_us =
        1e6 * (stats.seconds_sample + stats.seconds_visibility + stats.seconds_shade) /
        static_cast<double>(std::max<std::uint64_t>(stats.pixels - stats.pixels_background, 1));
  }

  // Judge them beside fresh samples.
  const auto fresh = std::find_if(cells.begin(), cells.end(),
                                  [](const Cell& cell) { return cell.subject == kFreshSubject; });
  if (fresh == cells.end())
    return Error{ErrorKind::usage, fmt::format("{} must be among the subjects", kFreshSubject)};
  const Numbers reference = fresh->summary.numbers;
  for (Cell& cell : cells) cell.judgement = judge(c.laws, cell.summary.numbers, reference);
  return cells;
}

Result<Expectations> Expectations::read(const std::filesystem::path& path) {
  Expectations table;
  if (!std::filesystem::exists(path)) return table;
  BATON_ASSIGN(const std::string text, read_text_file(path, kMaxTableBytes));
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (number == 1 && line == kHeader) continue;
    std::istringstream fields(line);
    std::string c, subject, full, quick, rest;
    std::getline(fields, c, ',');
    std::getline(fields, subject, ',');
    std::getline(fields, full, ',');
    std::getline(fields, quick, ',');
    Verdict verdict{};
    const bool good = !subject.empty() && (full.empty() || from_string(full, verdict)) &&
                      (quick.empty() || from_string(quick, verdict)) && !std::getline(fields, rest);
    if (number == 1 || !good) {
      return Error{ErrorKind::bad_input,
                   fmt::format("{}:{}: \"{}\", expected {} with holds, degrades or fails",
                               path.string(), number, line, kHeader)};
    }
    table.verdicts_[key_of(c, subject)] = {full, quick};
  }
  return table;
}

Status Expectations::write(const std::filesystem::path& path) const {
  std::string text = std::string(kHeader) + "\n";
  for (const auto& [key, verdicts] : verdicts_)
    text += fmt::format("{},{},{}\n", key, verdicts.full, verdicts.quick);
  return write_text(path, text);
}

std::string Expectations::find(const Cell& cell, bool quick) const {
  const auto found = verdicts_.find(key_of(cell.case_name, cell.subject));
  if (found == verdicts_.end()) return "";
  return quick ? found->second.quick : found->second.full;
}

void Expectations::record(const Cell& cell, bool quick) {
  Verdicts& verdicts = verdicts_[key_of(cell.case_name, cell.subject)];
  (quick ? verdicts.quick : verdicts.full) = to_string(cell.judgement.verdict);
}

std::string change(const Cell& cell, const std::string& recorded) {
  Verdict expected{};
  if (recorded.empty() || !from_string(recorded, expected)) return "";
  if (expected >= cell.judgement.lowest && expected <= cell.judgement.highest) return "";
  return fmt::format("{} / {}: {} ({}), recorded is {}", cell.case_name, cell.subject,
                     to_string(cell.judgement.verdict), cell.judgement.number, recorded);
}

Status write_tables(const std::filesystem::path& folder, const std::vector<Cell>& cells,
                    const Expectations& expectations, bool quick) {
  std::string grid =
      "case,subject,verdict,expected,number,unlawful,negative,bias,bias_interval,lns_mean,lns_mean_"
      "interval,"
      "lns_median,noise,"
      "noise_after,p999,lost,growth,flicker,ess,acceptance,restarted,refreshed,resampled,"
      "quadrature_error,cpu_seconds,pixel_us\n";
  std::string series = "case,subject,frame,lns_mean,lns_median,lns_p5,lns_p95,bias,noise,ess\n";
  for (const Cell& cell : cells) {
    const Numbers& n = cell.summary.numbers;
    grid += fmt::format("{},{},{},{},{},{}", cell.case_name, cell.subject,
                        to_string(cell.judgement.verdict), expectations.find(cell, quick),
                        cell.judgement.number, n.unlawful);
    for (const double value : {n.negative,
                               n.bias,
                               n.bias_interval,
                               n.lns_mean,
                               n.lns_mean_interval,
                               n.lns_median,
                               n.noise,
                               n.noise_after,
                               n.tail,
                               n.lost,
                               n.growth,
                               n.flicker,
                               n.ess,
                               n.acceptance,
                               n.restarted,
                               n.refreshed,
                               n.resampled,
                               cell.quadrature_error,
                               cell.cpu_seconds,
                               cell.pixel_us}) {
      grid += fmt::format(",{:.5g}", value);
    }
    grid += "\n";
    for (const FramePoint& p : cell.summary.series) {
      series += fmt::format("{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n",
                            cell.case_name, cell.subject, p.frame, p.lns_mean, p.lns_median,
                            p.lns_low, p.lns_high, p.bias, p.noise, p.ess);
    }
  }
  BATON_TRY(write_text(folder / "grid.csv", grid));
  return write_text(folder / "series.csv", series);
}

}  // namespace baton::stability

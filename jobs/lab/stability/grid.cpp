#include "jobs/lab/stability/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <utility>

#include "common/base/files.h"

namespace baton::stability {
namespace {

constexpr std::uint64_t kMaxTableBytes = 1 << 20;

/// The columns of grid.csv that are numbers of a summary.
constexpr std::pair<const char*, double Numbers::*> kColumns[] = {
    {"negative", &Numbers::negative},
    {"bias", &Numbers::bias},
    {"bias_interval", &Numbers::bias_interval},
    {"lns_mean", &Numbers::lns_mean},
    {"lns_mean_interval", &Numbers::lns_mean_interval},
    {"lns_median", &Numbers::lns_median},
    {"noise", &Numbers::noise},
    {"noise_shown", &Numbers::noise_shown},
    {"black", &Numbers::black},
    {"noise_after", &Numbers::noise_after},
    {"p999", &Numbers::tail},
    {"lost", &Numbers::lost},
    {"growth", &Numbers::growth},
    {"flicker", &Numbers::flicker},
    {"ess", &Numbers::ess},
    {"acceptance", &Numbers::acceptance},
    {"restarted", &Numbers::restarted},
    {"refreshed", &Numbers::refreshed},
    {"resampled", &Numbers::resampled},
};

/// The parts of a line between commas.
std::vector<std::string> parts_of(const std::string& line, char separator = ',') {
  std::vector<std::string> parts{""};
  for (const char c : line) {
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
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
  std::getline(lines, line);
  const std::vector<std::string> subjects = parts_of(line);
  for (int number = 2; std::getline(lines, line); ++number) {
    const std::vector<std::string> cells = parts_of(line);
    for (std::size_t s = 1; s < subjects.size(); ++s) {
      std::vector<std::string> verdicts = parts_of(s < cells.size() ? cells[s] : "?", '/');
      verdicts.resize(2);
      for (const std::string& text_of : verdicts) {
        Verdict verdict{};
        if (!text_of.empty() && !from_string(text_of, verdict))
          return Error{ErrorKind::bad_input,
                       fmt::format("{}:{}: {}: expected holds, degrades or fails", path.string(),
                                   number, subjects[s])};
      }
      table.verdicts_[cells[0]][subjects[s]] = {verdicts[0], verdicts[1]};
    }
  }
  return table;
}

Status Expectations::write(const std::filesystem::path& path) const {
  std::set<std::string> subjects;
  for (const auto& [name, row] : verdicts_) {
    for (const auto& [subject, verdicts] : row) subjects.insert(subject);
  }
  std::string text = fmt::format("case,{}\n", fmt::join(subjects, ","));
  for (const auto& [name, row] : verdicts_) {
    text += name;
    for (const std::string& subject : subjects) {
      const auto found = row.find(subject);
      const Verdicts verdicts = found == row.end() ? Verdicts{} : found->second;
      text += "," + verdicts.full + (verdicts.quick.empty() ? "" : "/" + verdicts.quick);
    }
    text += "\n";
  }
  return write_text(path, text);
}

std::string Expectations::find(const Cell& cell, bool quick) const {
  const auto row = verdicts_.find(cell.case_name);
  if (row == verdicts_.end()) return "";
  const auto found = row->second.find(cell.subject);
  if (found == row->second.end()) return "";
  return quick ? found->second.quick : found->second.full;
}

void Expectations::record(const Cell& cell, bool quick) {
  Verdicts& verdicts = verdicts_[cell.case_name][cell.subject];
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
  std::string grid = "case,subject,verdict,expected,number,unlawful";
  for (const auto& [name, member] : kColumns) grid += fmt::format(",{}", name);
  grid += ",quadrature_error,cpu_seconds,pixel_us\n";
  std::string series = "case,subject,frame,lns_mean,lns_median,lns_p5,lns_p95,bias,noise,ess\n";
  for (const Cell& cell : cells) {
    const Numbers& n = cell.summary.numbers;
    grid += fmt::format("{},{},{},{},{},{}", cell.case_name, cell.subject,
                        to_string(cell.judgement.verdict), expectations.find(cell, quick),
                        cell.judgement.number, n.unlawful);
    for (const auto& [name, member] : kColumns) grid += fmt::format(",{:.5g}", n.*member);
    for (const double value : {cell.quadrature_error, cell.cpu_seconds, cell.pixel_us})
      grid += fmt::format(",{:.5g}", value);
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

// The stability suite: every case with every method against the exact answer, judged by the case's
// laws and compared with the recorded verdicts. ./run stability
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <thread>

#include "jobs/lab/stability/grid.h"

namespace baton::stability {
namespace {

struct Options {
  bool quick = false;
  bool record = false;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::string> cases, subjects;
  std::string output = "stability";
  std::string expected;
};

/// The entries that are named; all of them when none is. `keep` stays in any case.
template <class T>
std::vector<T> selected(const std::vector<T>& all, const std::vector<std::string>& names,
                        const std::string& keep = {}) {
  if (names.empty()) return all;
  std::vector<T> chosen;
  std::copy_if(all.begin(), all.end(), std::back_inserter(chosen), [&](const T& entry) {
    return entry.name == keep || std::find(names.begin(), names.end(), entry.name) != names.end();
  });
  return chosen;
}

std::vector<Case> selected_cases(const Options& options) {
  std::vector<Case> cases = selected(all_cases(), options.cases);
  if (options.quick && options.cases.empty())
    std::erase_if(cases, [](const Case& c) { return !c.quick; });
  return cases;
}

void print(const Cell& cell) {
  const Numbers& n = cell.summary.numbers;
  std::printf(
      "%-22s %-26s %-9s %-34s noise %8.3f  Lns mean %6.3f median %6.3f  bias %+6.3f +- %.3f  ess "
      "%.2f  %6.2f s\n",
      cell.case_name.c_str(), cell.subject.c_str(), to_string(cell.judgement.verdict).c_str(),
      cell.judgement.number.c_str(), n.noise, n.lns_mean, n.lns_median, n.bias, n.bias_interval,
      n.ess, cell.cpu_seconds);
  std::fflush(stdout);
}

/// Renders the grid. Returns the number of changed verdicts.
Result<int> run_grid(const Options& options) {
  BATON_ASSIGN(Expectations expectations, Expectations::read(options.expected));
  const std::vector<Subject> subjects = selected(all_subjects(), options.subjects, kFreshSubject);
  const Effort& effort = options.quick ? kQuickEffort : kFullEffort;
  const std::filesystem::path output = options.output;
  std::vector<Cell> cells;
  std::vector<std::string> changes;
  for (const Case& c : selected_cases(options)) {
    BATON_ASSIGN(const std::vector<Cell> row,
                 run_case(c, subjects, effort, output / "stage" / c.name, options.threads));
    for (const Cell& cell : row) {
      print(cell);
      const std::string changed = change(cell, expectations.find(cell, options.quick));
      if (!changed.empty()) changes.push_back(changed);
      if (options.record) expectations.record(cell, options.quick);
    }
    cells.insert(cells.end(), row.begin(), row.end());
    // Leave after each case what is known so far.
    BATON_TRY(write_tables(output, cells, expectations, options.quick));
    if (options.record) BATON_TRY(expectations.write(options.expected));
  }
  for (const std::string& line : changes) std::printf("changed: %s\n", line.c_str());
  return static_cast<int>(changes.size());
}

/// One line a case: its name and text, for the report.
void list_cases() {
  for (const Case& c : all_cases()) std::printf("%s\t%s\n", c.name.c_str(), c.text.c_str());
}

int main_of_suite(int argc, char** argv) {
  Options options;
  bool list = false;
  CLI::App app{"Every case of the stability suite with every method, against the exact answer."};
  app.add_flag("--quick", options.quick, "The reduced form: fewer cases, frames and runs");
  app.add_option("--case", options.cases, "Only these cases");
  app.add_option("--subject", options.subjects, "Only these methods");
  app.add_option("--output", options.output, "Folder for grid.csv, series.csv and generated maps");
  app.add_option("--expected", options.expected, "Table of recorded verdicts");
  app.add_flag("--record", options.record, "Write the verdicts seen to the table");
  app.add_option("--threads", options.threads)->check(CLI::Range(1, 256));
  app.add_flag("--list", list, "Print name and text of every case");
  CLI11_PARSE(app, argc, argv);
  if (list) {
    list_cases();
    return 0;
  }
  const Result<int> changes = run_grid(options);
  if (!changes) {
    std::fprintf(stderr, "stability: %s\n", changes.error().message.c_str());
    return 1;
  }
  return *changes == 0 || options.record ? 0 : 1;
}

}  // namespace
}  // namespace baton::stability

int main(int argc, char** argv) { return baton::stability::main_of_suite(argc, argv); }

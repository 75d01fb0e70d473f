#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "jobs/lab/stability/summary.h"

namespace baton::stability {

/// One cell of the grid.
struct Cell {
  std::string case_name, subject;
  Judgement judgement;
  Summary summary;
  double quadrature_error = 0;
  double cpu_seconds = 0;
  /// CPU microseconds per pixel with a surface and frame: samples, rays, shade.
  double pixel_us = 0;
};

/// Renders one case with every subject. stage_folder: for its maps and meshes. Subjects are
/// compared with kFreshSubject, which must be among them.
Result<std::vector<Cell>> run_case(const Case& c, const std::vector<Subject>& subjects,
                                   const Effort& effort, const std::filesystem::path& stage_folder,
                                   int threads);

/// Recorded verdicts. expected.csv has a row a case and a column a subject, whose cells are the
/// verdict of the full form, and behind a slash that of the quick one if the case has it.
class Expectations {
 public:
  struct Verdicts {
    std::string full, quick;
  };
  /// A missing file is an empty table. Errors name the file and the line.
  static Result<Expectations> read(const std::filesystem::path& path);
  Status write(const std::filesystem::path& path) const;

  /// The recorded verdict of the cell; empty when there is none.
  std::string find(const Cell& cell, bool quick) const;
  void record(const Cell& cell, bool quick);

 private:
  std::map<std::string, std::map<std::string, Verdicts>> verdicts_;  ///< by case and subject
};

/// "" when the cell is as recorded, or not recorded; else what changed.
std::string change(const Cell& cell, const std::string& recorded);

/// grid.csv: one line a cell; series.csv: one line a cell and judged frame. Published whole.
Status write_tables(const std::filesystem::path& folder, const std::vector<Cell>& cells,
                    const Expectations& expectations, bool quick);

}  // namespace baton::stability

#pragma once

#include <string>
#include <vector>

#include "jobs/study/study_summary.h"

namespace baton {

/// How `"method": "auto"` did beside the fixed methods of its scene whose budget has the same name.
/// What is below the reference's own error takes no part.
struct AutoRow {
  std::size_t cell = 0;
  std::size_t best = 0, worst = 0;  ///< fixed cells, by MSE x time
  Interval over_best, over_worst;   ///< efficiency of auto over theirs
};
std::vector<AutoRow> compare_auto(const Study& study, const StudyResults& results);

/// What the best choice of a fixed method for each square of NoiseBlocks::kSide, instead of one for
/// the whole image, would make of the efficiency: chosen on one half of the seeds, measured on the
/// other, and the other way round. 1: nothing gained. NaN with fewer than two fixed methods or two
/// seeds. budget: name of the cells' budget.
double block_headroom(const Study& study, const StudyResults& results, std::size_t scene,
                      const std::string& budget);

std::string auto_csv(const Study& study, const StudyResults& results);
/// What `auto` chose, as a table of the report; empty without `auto` in the study.
std::string auto_html(const Study& study, const StudyResults& results);

}  // namespace baton

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs/study/study_summary.h"

namespace baton {

/// Who wins in a scene: each method at its most efficient budget, by 1 / (MSE x time).
struct Verdict {
  std::size_t scene = 0;
  std::size_t winner = 0;           ///< a cell
  std::optional<std::size_t> next;  ///< second best method; none: there is one
  Interval ratio;                   ///< efficiency of the winner over the next
  bool winner_biased = false;
  bool next_biased = false;
  /// Methods whose error lies below the reference's own: they may be the best.
  std::vector<std::string> not_resolved;
};

/// One for each scene in which some cell is resolved. rows: summarize_study.
std::vector<Verdict> verdicts(const Study& study, const StudyResults& results,
                              const std::vector<CellSummary>& rows);

/// "`pool`, 3.9 [3.1, 4.6] times the next (`bidirectional`), intervals apart".
std::string verdict_text(const Study& study, const Verdict& verdict);

}  // namespace baton

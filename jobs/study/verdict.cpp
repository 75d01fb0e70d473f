#include "jobs/study/verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace baton {
namespace {

/// The most efficient resolved row of each method of a scene, the best first.
std::vector<const CellSummary*> best_rows(const Study& study, const StudyResults& results,
                                          const std::vector<CellSummary>& rows, std::size_t scene) {
  std::vector<const CellSummary*> best;
  const auto better = [&](const CellSummary& a, const CellSummary& b) {
    return efficiency_ratio(results, b.cell, a.cell).value > 1;
  };
  for (const CellSummary& row : rows) {
    const StudyCell& cell = study.cells[row.cell];
    if (cell.scene != scene || !row.resolved) continue;
    const auto same = std::find_if(best.begin(), best.end(), [&](const CellSummary* other) {
      return study.cells[other->cell].method == cell.method;
    });
    if (same == best.end()) {
      best.push_back(&row);
    } else if (better(row, **same)) {
      *same = &row;
    }
  }
  std::stable_sort(best.begin(), best.end(),
                   [&](const CellSummary* a, const CellSummary* b) { return better(*a, *b); });
  return best;
}

std::string shown(const Study& study, std::size_t cell, bool biased) {
  return fmt::format("`{}`{}", study.method_of(cell), biased ? " (biased)" : "");
}

}  // namespace

std::vector<Verdict> verdicts(const Study& study, const StudyResults& results,
                              const std::vector<CellSummary>& rows) {
  std::vector<Verdict> all;
  for (std::size_t scene = 0; scene < study.scenes.size(); ++scene) {
    const std::vector<const CellSummary*> best = best_rows(study, results, rows, scene);
    if (best.empty()) continue;
    Verdict verdict{
        .scene = scene, .winner = best[0]->cell, .next = {}, .ratio = {}, .not_resolved = {}};
    verdict.winner_biased = best[0]->biased;
    if (best.size() > 1) {
      verdict.next = best[1]->cell;
      verdict.next_biased = best[1]->biased;
      verdict.ratio = efficiency_ratio(results, best[1]->cell, best[0]->cell);
    }
    for (const CellSummary& row : rows) {
      if (study.cells[row.cell].scene != scene || row.resolved) continue;
      const std::string& name = study.method_of(row.cell);
      if (std::find(verdict.not_resolved.begin(), verdict.not_resolved.end(), name) ==
          verdict.not_resolved.end())
        verdict.not_resolved.push_back(name);
    }
    all.push_back(std::move(verdict));
  }
  return all;
}

std::string verdict_text(const Study& study, const Verdict& v) {
  std::string text = shown(study, v.winner, v.winner_biased);
  if (v.next) {
    text += fmt::format(", {:.2g} [{:.2g}, {:.2g}] times the next ({}), {}", v.ratio.value,
                        v.ratio.low, v.ratio.high, shown(study, *v.next, v.next_biased),
                        v.ratio.low == v.ratio.high ? "one seed: no interval"
                        : v.ratio.low > 1           ? "intervals apart"
                                                    : "intervals touch: not decided");
  } else {
    text += ", nothing to compare it with";
  }
  if (!v.not_resolved.empty()) {
    text += fmt::format(
        "; of `{}` some lies below the reference's own error: raise "
        "referenceSamples to judge it",
        fmt::join(v.not_resolved, "`, `"));
  }
  return text;
}

}  // namespace baton

#include "jobs/study/auto_table.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "common/image/noise.h"
#include "jobs/study/svg_text.h"

namespace baton {
namespace {

bool is_auto(const StudyCell& cell) { return !cell.chosen.empty(); }

/// The fixed cells of a scene and budget.
std::vector<std::size_t> fixed_cells(const Study& study, std::size_t scene,
                                     const std::string& budget) {
  std::vector<std::size_t> cells;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const StudyCell& cell = study.cells[c];
    if (cell.scene == scene && cell.budget == budget && !is_auto(cell)) cells.push_back(c);
  }
  return cells;
}

/// Whether the reference can tell the cell's error.
bool is_resolved(const Study& study, const StudyResults& results, std::size_t cell) {
  return cell_error(results.runs[cell], ErrorKindOfImage::rmse, {}).value >=
         reference_error(results.references[study.cells[cell].scene], ErrorKindOfImage::rmse, {});
}

/// What is known of a choice for every block: squared error and time, both to be multiplied.
struct Blocks {
  std::vector<double> pixels;                 ///< with a surface
  std::vector<std::vector<double>> train;     ///< (cells, blocks) squared error
  std::vector<std::vector<double>> held_out;  ///< errors of other seeds
  std::vector<double> cost;                   ///< (cells) of a pixel
};

/// The mean over renderings of one parity, and frames, of a cell's errors by block.
std::vector<double> mean_blocks(const std::vector<RunRecord>& runs, std::size_t parity,
                                std::size_t num_blocks) {
  std::vector<double> sum(num_blocks);
  for (std::size_t s = parity; s < runs.size(); s += 2) {
    for (const FrameMeasures& frame : runs[s].frames) {
      for (std::size_t b = 0; b < num_blocks && b < frame.block_mse.size(); ++b)
        sum[b] += frame.block_mse[b];
    }
  }
  return sum;
}

/// Error x time of a choice of cell for each block.
double product(const Blocks& blocks, const std::vector<std::vector<double>>& errors,
               const std::vector<std::size_t>& choice) {
  double error = 0, time = 0;
  for (std::size_t b = 0; b < choice.size(); ++b) {
    error += errors[choice[b]][b];
    time += blocks.pixels[b] * blocks.cost[choice[b]];
  }
  return error * time;
}

/// The one cell for all blocks that is best on the training seeds.
std::vector<std::size_t> best_uniform(const Blocks& blocks) {
  std::vector<std::size_t> best(blocks.pixels.size(), 0);
  for (std::size_t c = 1; c < blocks.cost.size(); ++c) {
    const std::vector<std::size_t> all(best.size(), c);
    if (product(blocks, blocks.train, all) < product(blocks, blocks.train, best)) best = all;
  }
  return best;
}

/// The best cell for each block on the training seeds: to first order the product of sums falls
/// with the sum over blocks of error over all error plus time over all time.
std::vector<std::size_t> best_by_block(const Blocks& blocks) {
  constexpr int kRounds = 8;
  std::vector<std::size_t> choice = best_uniform(blocks);
  for (int round = 0; round < kRounds; ++round) {
    double error = 0, time = 0;
    for (std::size_t b = 0; b < choice.size(); ++b) {
      error += blocks.train[choice[b]][b];
      time += blocks.pixels[b] * blocks.cost[choice[b]];
    }
    for (std::size_t b = 0; b < choice.size(); ++b) {
      const auto score = [&](std::size_t c) {
        return blocks.train[c][b] / error + blocks.pixels[b] * blocks.cost[c] / time;
      };
      for (std::size_t c = 0; c < blocks.cost.size(); ++c) {
        if (score(c) < score(choice[b])) choice[b] = c;
      }
    }
  }
  return choice;
}

std::string interval_text(const Interval& i) {
  return fmt::format("{:.2f} [{:.2f}, {:.2f}]", i.value, i.low, i.high);
}

std::string choice_text(const StudyCell& cell) {
  return cell.chosen.substr(0, cell.chosen.find(':'));
}

}  // namespace

std::vector<AutoRow> compare_auto(const Study& study, const StudyResults& results) {
  std::vector<AutoRow> rows;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    if (!is_auto(study.cells[c]) || !is_resolved(study, results, c)) continue;
    std::optional<std::size_t> best, worst;
    for (const std::size_t fixed :
         fixed_cells(study, study.cells[c].scene, study.cells[c].budget)) {
      if (!is_resolved(study, results, fixed)) continue;
      if (!best || efficiency_ratio(results, *best, fixed).value > 1) best = fixed;
      if (!worst || efficiency_ratio(results, *worst, fixed).value < 1) worst = fixed;
    }
    if (!best) continue;
    rows.push_back({c, *best, *worst, efficiency_ratio(results, *best, c),
                    efficiency_ratio(results, *worst, c)});
  }
  return rows;
}

double block_headroom(const Study& study, const StudyResults& results, std::size_t scene,
                      const std::string& budget) {
  const std::vector<std::size_t> cells = fixed_cells(study, scene, budget);
  if (cells.size() < 2 || study.num_seeds < 2) return std::nan("");

  // The pixels of each block.
  const Reference& reference = results.references[scene].back();
  Blocks blocks;
  blocks.pixels.resize(reference.num_blocks);
  for (const std::size_t block : reference.block) blocks.pixels[block] += 1;

  // Choose on one half of the seeds, measure on the other.
  double log_gain = 0;
  for (const std::size_t parity : {std::size_t{0}, std::size_t{1}}) {
    blocks.train.clear();
    blocks.held_out.clear();
    blocks.cost.clear();
    for (const std::size_t c : cells) {
      blocks.train.push_back(mean_blocks(results.runs[c], parity, blocks.pixels.size()));
      blocks.held_out.push_back(mean_blocks(results.runs[c], 1 - parity, blocks.pixels.size()));
      blocks.cost.push_back(cell_cost(results.runs[c]).cpu_us);
    }
    log_gain += std::log(product(blocks, blocks.held_out, best_uniform(blocks)) /
                         product(blocks, blocks.held_out, best_by_block(blocks)));
  }
  return std::exp(0.5 * log_gain);
}

std::string auto_csv(const Study& study, const StudyResults& results) {
  std::string csv =
      "scene,budget,choice,best,overBest,overBestLow,overBestHigh,worst,overWorst,overWorstLow,"
      "overWorstHigh,headroomByBlock\n";
  for (const AutoRow& row : compare_auto(study, results)) {
    const StudyCell& cell = study.cells[row.cell];
    fmt::format_to(std::back_inserter(csv),
                   "{},{},{},{},{:.4g},{:.4g},{:.4g},{},{:.4g},{:.4g},{:.4g},{:.4g}\n",
                   study.scene_of(row.cell).name, cell.budget, choice_text(cell),
                   study.method_of(row.best), row.over_best.value, row.over_best.low,
                   row.over_best.high, study.method_of(row.worst), row.over_worst.value,
                   row.over_worst.low, row.over_worst.high,
                   block_headroom(study, results, study.cells[row.cell].scene, cell.budget));
  }
  return csv;
}

std::string auto_html(const Study& study, const StudyResults& results) {
  const std::vector<AutoRow> rows = compare_auto(study, results);
  if (rows.empty()) return {};
  std::string html =
      "<h2>auto beside the fixed methods</h2>\n<table><tr><th>scene</th><th>chosen</th>"
      "<th>budget</th><th>best fixed</th><th>efficiency / best</th><th>worst fixed</th>"
      "<th>efficiency / worst</th><th>if chosen by square</th></tr>\n";
  for (const AutoRow& row : rows) {
    const StudyCell& cell = study.cells[row.cell];
    fmt::format_to(std::back_inserter(html),
                   "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
                   "<td>{}</td><td>{:.2f}</td></tr>\n",
                   escaped(study.scene_of(row.cell).name), escaped(choice_text(cell)),
                   escaped(cell.budget), escaped(study.method_of(row.best)),
                   interval_text(row.over_best), escaped(study.method_of(row.worst)),
                   interval_text(row.over_worst),
                   block_headroom(study, results, study.cells[row.cell].scene, cell.budget));
  }
  return html + fmt::format(
                    "</table>\n<p class=\"note\">Efficiency of auto over that of the best and the "
                    "worst fixed method with the same budget; its pilot is not counted. Last: "
                    "what the best fixed method for each square of {} pixels would gain over the "
                    "best one for the whole image, chosen on one half of the seeds and judged on "
                    "the other.</p>\n",
                    NoiseBlocks::kSide);
}

}  // namespace baton

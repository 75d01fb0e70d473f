#include "jobs/study/material_pilot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "common/job/job_fields.h"
#include "common/job/sequence.h"
#include "jobs/study/auto_pilot.h"
#include "jobs/study/material_choice.h"
#include "jobs/study/pilot_windows.h"
#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

constexpr double kGain = 1.05;

/// The candidates of a job that draw their samples anew, at the N that are to be tried.
std::vector<AutoCandidate> fresh_candidates(const JobSpec& job) {
  std::vector<AutoCandidate> candidates;
  std::string family;
  for (const AutoCandidate& candidate : auto_candidates(job)) {
    const bool seen = candidate.family == family;
    family = candidate.family;
    if (seen || candidate.correlated || !fresh_method(candidate.sampling.method)) continue;
    for (const int n : material_particles(job.sampling)) {
      AutoCandidate tried = candidate;
      tried.sampling.num_particles = n;
      tried.sampling.num_candidates = std::max(tried.sampling.num_candidates, n);
      candidates.push_back(std::move(tried));
    }
  }
  return candidates;
}

/// The pilot of fresh candidates: only frames that are measured are rendered.
Study fresh_study(const JobSpec& job, const std::vector<AutoCandidate>& candidates, int num_seeds) {
  Study study = pilot_study(job, candidates);
  study.num_seeds = num_seeds;
  keep_measured_frames(study);
  return study;
}

/// The materials that a pilot's pictures show, by their numbers; names: of all, in order.
struct MaterialTable {
  std::vector<std::size_t> number;
  std::vector<SeenMaterial> seen;
};

MaterialTable seen_materials(const JobSpec& job, const StudyResults& results) {
  std::vector<double> pixels(job.scene.materials.size());
  double all = 0;
  for (const std::vector<Reference>& scene : results.references) {
    for (const Reference& reference : scene) {
      for (const std::size_t block : reference.block) pixels[block] += 1;
      all += static_cast<double>(reference.block.size());
    }
  }
  MaterialTable table;
  std::size_t number = 0;
  for (const auto& [name, material] : job.scene.materials) {
    if (pixels[number] > 0) {
      table.number.push_back(number);
      table.seen.push_back({name, pixels[number] / all});
    }
    ++number;
  }
  return table;
}

/// Squared error over squared mean radiance in the blocks of a scene, as relative_square.
double block_square(const std::vector<RunRecord>& runs, const std::vector<Reference>& references,
                    std::size_t block) {
  double sum = 0, mean = 0;
  for (std::size_t f = 0; f < references.size(); ++f) {
    for (const RunRecord& run : runs) {
      const std::vector<double>& blocks = run.frames[f].block_mse;
      if (block < blocks.size()) sum += blocks[block] / static_cast<double>(runs.size());
    }
    mean += references[f].mean_radiance * references[f].mean_radiance;
  }
  return mean > 0 ? std::max(sum, 0.0) / mean : 0;
}

/// What the runs say of each candidate, the mean over scenes.
std::vector<MaterialNumbers> numbers_of(const Study& study, const StudyResults& results,
                                        const std::vector<AutoCandidate>& candidates,
                                        const MaterialTable& table) {
  const auto num_scenes = static_cast<double>(study.scenes.size());
  std::vector<MaterialNumbers> numbers;
  for (const AutoCandidate& candidate : candidates)
    numbers.push_back({candidate, std::vector<double>(table.seen.size()), 0});
  std::vector<double> lit(candidates.size());
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const auto method = static_cast<std::size_t>(study.cells[c].method);
    const auto scene = static_cast<std::size_t>(study.cells[c].scene);
    for (std::size_t k = 0; k < table.seen.size(); ++k) {
      numbers[method].square[k] +=
          block_square(results.runs[c], results.references[scene], table.number[k]) / num_scenes;
    }
    for (const RunRecord& run : results.runs[c]) {
      numbers[method].cost_us += counted_cost_us(study.cells[c].job, run.counts);
      lit[method] += static_cast<double>(run.counts.lit_pixels());
    }
  }
  for (std::size_t c = 0; c < candidates.size(); ++c) numbers[c].cost_us /= std::max(lit[c], 1.0);
  return numbers;
}

/// `base` with a setting of its own for each material that departs from it.
SamplingSpec with_materials(SamplingSpec base, const MaterialTable& table,
                            const MaterialChoice& materials) {
  for (std::size_t k = 0; k < table.seen.size(); ++k) {
    const SamplingSpec& own = materials.sampling[k];
    if (own == base) continue;
    base.by_material[table.seen[k].name] = {*fresh_method(own.method), own.num_particles,
                                            own.num_candidates, own.brdf_fraction};
  }
  return base;
}

/// Squared errors of the settings on seeds that chose nothing.
Result<std::vector<double>> judge_settings(const JobSpec& job, const StudyFolder& folder,
                                           JobRunner& runner,
                                           const std::vector<AutoCandidate>& settings) {
  Study study = fresh_study(job, settings, kJudgingSeeds);
  study.first_seed = kChoosingSeeds + 1;
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));
  std::vector<double> square(settings.size());
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const auto scene = static_cast<std::size_t>(study.cells[c].scene);
    square[static_cast<std::size_t>(study.cells[c].method)] +=
        relative_square(results.runs[c], results.references[scene]) /
        static_cast<double>(study.scenes.size());
  }
  return square;
}

}  // namespace

Status vary_by_material(const JobSpec& job, double lit_pixels, const StudyFolder& folder,
                        JobRunner& runner, AutoChoice& choice) {
  if (choice.correlated || !fresh_method(choice.sampling.method)) {
    choice.reason +=
        "; one setting for all materials, as only fresh samples may differ by material";
    return {};
  }
  if (job.scene.materials.size() < 2 || job.sampling.mis_compensation) return {};

  // Judge the candidates material by material.
  const std::vector<AutoCandidate> candidates = fresh_candidates(job);
  const Study study = fresh_study(job, candidates, kChoosingSeeds);
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));
  const MaterialTable table = seen_materials(job, results);
  if (table.seen.size() < 2) return {};
  const std::vector<MaterialNumbers> numbers = numbers_of(study, results, candidates, table);
  const std::optional<MaterialChoice> materials =
      choose_by_material(job, table.seen, numbers, choice.sampling, lit_pixels);
  if (!materials) {
    choice.reason += "; one setting for all materials, as none of its own gains 5 %";
    return {};
  }

  // Judge what comes of it beside the one for all, by other seeds.
  const SamplingSpec mixed = with_materials(choice.sampling, table, *materials);
  BATON_ASSIGN(const std::vector<double> square,
               judge_settings(job, folder, runner,
                              {{"alike", choice.sampling, false}, {"by material", mixed, false}}));
  const double gain = square[0] * choice.cost_us / std::max(square[1] * materials->cost_us, 1e-30);
  const std::string name = materials->name(table.seen);
  if (gain < kGain) {
    choice.reason += fmt::format(
        "; one setting for all materials, as {} is {:.2f} times as efficient", name, gain);
    return {};
  }
  choice.reason += fmt::format("; by material {:.2f} times as efficient as {} N={} for all", gain,
                               traits(choice.sampling.method).name, choice.sampling.num_particles);
  choice.sampling = mixed;
  choice.error = std::sqrt(square[1]);
  choice.cost_us = materials->cost_us;
  choice.by_material = name;
  return {};
}

}  // namespace baton

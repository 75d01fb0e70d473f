#include "jobs/study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "common/job/text/job_json_text.h"
#include "jobs/study/study_layers.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kMaxSeeds = 10000;
/// Far from the seeds of renderings, which count from 1.
constexpr std::uint64_t kReferenceSeed = 1'000'000'000;

constexpr std::uint64_t kSiteSeed = 1;

struct Budget {
  std::string name;
  StudyPatch patch;
};
struct MethodEntry {
  std::string name;
  StudyPatch patch;
  std::vector<Budget> budgets;
};

/// A budget is a number of particles or an object with a name and a patch.
std::vector<Budget> read_budgets(const json& list, const std::string& path, StudyFaults& faults) {
  std::vector<Budget> budgets;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string place = json_path_index(path, i);
    Budget budget;
    if (list[i].is_number_integer()) {
      // The number stands for a patch.
      budget = {list[i].dump(), {place, {{"sampling", {{"numParticles", list[i]}}}}}};
    } else {
      StudyObject object(list[i], place, faults);
      budget.name = object.name("name");
      budget.patch = {object.path_of("patch"), object.patch("patch")};
      object.finish();
    }
    if (!names.insert(budget.name).second)
      faults.add(place, fmt::format("expected each name once, got \"{}\" twice", budget.name));
    budgets.push_back(std::move(budget));
  }
  return budgets;
}

std::vector<MethodEntry> read_methods(StudyObject& study, StudyFaults& faults) {
  const std::vector<Budget> shared =
      read_budgets(study.list("budgets", false), study.path_of("budgets"), faults);
  std::vector<MethodEntry> methods;
  const json& list = study.list("methods", true);
  std::set<std::string> names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    StudyObject object(list[i], json_path_index(study.path_of("methods"), i), faults);
    MethodEntry method{object.name("name"), {object.path_of("patch"), object.patch("patch")}, {}};
    method.budgets = object.has("budgets") ? read_budgets(object.list("budgets", true),
                                                          object.path_of("budgets"), faults)
                                           : shared;
    object.list("budgets", false);
    object.finish();
    // Without any budget the patch is the whole of it.
    if (method.budgets.empty()) method.budgets.push_back({"default", {"", json::object()}});
    if (!names.insert(method.name).second)
      faults.add(object.path(),
                 fmt::format("expected each name once, got \"{}\" twice", method.name));
    methods.push_back(std::move(method));
  }
  return methods;
}

/// prepare_measured, and the AOVs.
void prepare_output(JobSpec& job) {
  prepare_measured(job);
  std::vector<Aov>& aovs = job.output.aovs;
  aovs.insert(aovs.end(), {Aov::lns, Aov::ess, Aov::acceptance});
  std::sort(aovs.begin(), aovs.end());
  aovs.erase(std::unique(aovs.begin(), aovs.end()), aovs.end());
}

/// The measured frames: those of `text`, or all.
std::vector<FrameNumber> measured_frames(const std::string& text, const JobSpec& job,
                                         const std::string& path, StudyFaults& faults) {
  if (text.empty()) return job.frames;
  Result<std::vector<FrameNumber>> frames = parse_frames(text);
  if (!frames) {
    faults.add(path, frames.error().message);
    return job.frames;
  }
  for (const FrameNumber frame : *frames) {
    if (!std::binary_search(job.frames.begin(), job.frames.end(), frame))
      faults.add(path, fmt::format("expected frames of the job ({}), got {}",
                                   format_frames(job.frames), frame));
  }
  return std::move(frames).value();
}

std::array<int, 4> read_crop(StudyObject& object, const PixelRect& image, StudyFaults& faults) {
  const std::array<int, 4> whole{0, 0, image.width(), image.height()};
  if (!object.has("crop")) return whole;
  const json& list = object.list("crop", true);
  const bool numbers = list.size() == 4 && std::all_of(list.begin(), list.end(), [](const json& n) {
                         return n.is_number_unsigned() && n.get<double>() <= limits::kMaxImageSide;
                       });
  std::array<int, 4> crop = whole;
  if (numbers) crop = list.get<std::array<int, 4>>();
  if (!numbers || crop[2] < 1 || crop[3] < 1 || crop[0] + crop[2] > image.width() ||
      crop[1] + crop[3] > image.height()) {
    faults.add(object.path_of("crop"),
               fmt::format("expected [x, y, width, height] inside of {} x {} pixels, got {}",
                           image.width(), image.height(), list.dump()));
    return whole;
  }
  return crop;
}

/// What all scenes share.
struct Shared {
  StudyPatch patch;
  int reference_samples = 0;
  std::string measured;       ///< frames, as text
  std::string measured_path;  ///< where it is said
  const std::vector<MethodEntry>& methods;
  const fs::path& base_directory;
};

void read_scene(StudyObject& object, const Shared& shared, Study& study, StudyFaults& faults) {
  StudyScene scene;
  scene.name = object.name("name");
  const fs::path file = object.file("job", shared.base_directory);
  const StudyPatch patch{object.path_of("patch"), object.patch("patch")};
  scene.cut_frame = FrameNumber(object.integer("cutFrame", 0, 1, limits::kMaxFrameNumber));
  if (file.empty()) return;
  const Result<JobSpec> given = load_job(file);
  if (!given) {
    faults.add(object.path_of("job"), given.error().message);
    return;
  }
  const json base = json::parse(to_json(*given));
  std::vector<StudyPatch> patches{shared.patch, patch};
  std::optional<JobSpec> plain =
      patched_job(base, object.path_of("job"), patches, shared.base_directory, faults);
  if (!plain) return;

  // The reference.
  prepare_output(*plain);
  scene.crop = read_crop(object, plain->image.shown(), faults);
  scene.frames = measured_frames(shared.measured, *plain, shared.measured_path, faults);
  if (scene.cut_frame > FrameNumber(0) &&
      !std::binary_search(scene.frames.begin() + 1, scene.frames.end(), scene.cut_frame)) {
    faults.add(object.path_of("cutFrame"),
               fmt::format("expected a measured frame after the first ({}), got {}",
                           format_frames(scene.frames), scene.cut_frame));
  }
  for (int half = 0; half < 2; ++half)
    scene.reference[half] = reference_job(*plain, shared.reference_samples, scene.frames, half);

  // Every method with every budget.
  const std::size_t index = study.scenes.size();
  for (std::size_t m = 0; m < shared.methods.size(); ++m) {
    for (const Budget& budget : shared.methods[m].budgets) {
      patches.resize(2);
      patches.push_back(shared.methods[m].patch);
      patches.push_back(budget.patch);
      std::optional<JobSpec> job =
          patched_job(base, object.path_of("job"), patches, shared.base_directory, faults);
      if (!job) continue;
      prepare_output(*job);
      job->name = fmt::format("{} {} {}", scene.name, shared.methods[m].name, budget.name);
      study.cells.push_back({index, m, budget.name, std::move(*job)});
    }
  }
  study.scenes.push_back(std::move(scene));
}

}  // namespace

void prepare_measured(JobSpec& job) {
  job.output.background = Background::transparent;
  job.output.pixel_type = PixelType::full_float;
  job.output.clamp_negative = false;
  job.output.pattern = kFramePattern;
  job.state.keep = StateKeep::last;
  if (job.image.site_seed == 0) job.image.site_seed = kSiteSeed;
}

JobSpec reference_job(const JobSpec& job, int samples, const std::vector<FrameNumber>& frames,
                      int half) {
  JobSpec reference = job;
  reference.frames = frames;
  reference.name = "reference";
  reference.sampling = {};
  reference.sampling.method = Method::reference;
  reference.sampling.reference_samples = samples;
  reference.seed = kReferenceSeed + static_cast<std::uint64_t>(half);
  reference.output.aovs = {Aov::lns, Aov::variance};
  return reference;
}

Result<Study> parse_study(std::string_view text, const std::string& name,
                          const fs::path& base_directory) {
  BATON_ASSIGN(const json root, parse_json_text(text, name));
  std::error_code error;
  const fs::path base = fs::absolute(base_directory, error);
  StudyFaults faults(name);
  Study study;
  StudyObject object(root, "$", faults);
  study.name = object.name("name");
  study.num_seeds = object.integer("seeds", study.num_seeds, 1, kMaxSeeds);
  const StudyPatch patch{object.path_of("patch"), object.patch("patch")};
  const int samples = object.integer("referenceSamples", 4096, 2, limits::kMaxReferenceSamples);
  const std::vector<MethodEntry> methods = read_methods(object, faults);
  for (const MethodEntry& method : methods) study.methods.push_back(method.name);
  const Shared shared{
      patch, samples, object.text("measureFrames"), object.path_of("measureFrames"), methods, base};

  const json& scenes = object.list("scenes", true);
  std::set<std::string> names;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    StudyObject scene(scenes[i], json_path_index(object.path_of("scenes"), i), faults);
    read_scene(scene, shared, study, faults);
    scene.list("crop", false);
    scene.finish();
    if (const std::string given = scene.name("name"); !names.insert(given).second)
      faults.add(scene.path(), fmt::format("expected each name once, got \"{}\" twice", given));
  }
  object.finish();
  if (faults.any()) return Error{ErrorKind::bad_input, faults.text()};
  return study;
}

Result<Study> load_study(const fs::path& path) {
  BATON_TRY(expect_file(path));
  BATON_ASSIGN(const std::string text, read_text_file(path, limits::kMaxJobFileBytes));
  return parse_study(text, path.string(), path.parent_path());
}

}  // namespace baton

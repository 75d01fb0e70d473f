#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "common/base/machine_memory.h"
#include "common/job/motion.h"
#include "common/job/plan/estimate.h"
#include "common/job/plan/sequence.h"
#include "common/job/plan/store_estimate.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "common/scene/scene.h"
#include "common/scene/settle/animations.h"
#include "common/scene/settle/settle_motion.h"
#include "jobs/auto/unit_costs.h"
#include "jobs/cli/check/asset_report.h"
#include "jobs/cli/check/bounce_share.h"
#include "jobs/cli/check/job_warnings.h"
#include "jobs/cli/check/scene_preview.h"
#include "jobs/cli/check/surface_share.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/job_argument.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/settle_method.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

struct CheckOptions {
  JobArgument job;
  std::string picture;  ///< a look at the scene as PNG; empty: none
  bool explain = false;
  bool json = false;
};

ordered_json settings_json(const std::vector<JobSetting>& settings) {
  ordered_json list = ordered_json::array();
  for (const JobSetting& s : settings) {
    list.push_back({{"path", s.path}, {"value", ordered_json::parse(s.value)}, {"given", s.given}});
  }
  return list;
}

ordered_json map_json(const MapReport& map) {
  return {{"path", map.path},
          {"width", map.width},
          {"height", map.height},
          {"fileWidth", map.file_width},
          {"fileHeight", map.file_height},
          {"colors", map.colors},
          {"repairedTexels", map.repaired_texels},
          {"black", map.black}};
}

void print_json(const JobSpec& job, const JobEstimate& e, const AssetReport& assets,
                const std::vector<AnimationUse>& animations,
                const std::vector<std::string>& warnings, const std::vector<JobSetting>& settings,
                const PilotPlan& plan, const std::optional<BounceShare>& bounces) {
  ordered_json maps = ordered_json::array(), plates = ordered_json::array(),
               moving = ordered_json::array();
  for (const AnimationUse& use : animations) {
    moving.push_back({{"path", use.file}, {"names", use.names}});
    if (use.played >= 0) moving.back()["played"] = use.names[static_cast<std::size_t>(use.played)];
  }
  for (const MapReport& map : assets.maps) maps.push_back(map_json(map));
  for (const PlateReport& plate : assets.plates)
    plates.push_back(
        {{"path", plate.path}, {"colors", plate.colors}, {"repairedPixels", plate.repaired}});
  const double share = surface_share(job, *assets.scene);
  ordered_json result = {{"name", job.name},
                         {"frames", e.frames},
                         {"tiles", e.tiles},
                         {"runs", e.runs},
                         {"renderTasks", e.render_tasks},
                         {"secondPassTasks", e.second_pass_tasks},
                         {"assembleTasks", e.assemble_tasks},
                         {"dependencies", e.dependencies},
                         {"rounds", e.rounds},
                         {"prerollRounds", e.preroll_rounds},
                         {"primaryRaysPerPixel", e.primary_rays_per_pixel},
                         {"shadowRaysPerPixel", e.shadow_rays_per_pixel},
                         {"filmBytesPerFrame", e.film_bytes},
                         {"frameBytes", e.frame_bytes},
                         {"stateBytesPerPixel", e.state_bytes_per_pixel},
                         {"stateBytesPerBlock", e.state_bytes_per_block},
                         {"stateBytes", e.state_bytes},
                         {"storeBytes", estimate_store(job, share).total()},
                         {"storeBytesMost", bound_store(job).total()},
                         {"diskBytes", e.frames * e.frame_bytes + bound_store(job).total()},
                         {"motionMaxPx", moves(job) ? job.motion.max_px : 0},
                         {"outputDirectory", job.output.directory},
                         {"meshes", assets.meshes},
                         {"instances", assets.instances},
                         {"deformingMeshes", assets.deforming_meshes},
                         {"triangles", assets.triangles},
                         {"droppedTriangles", assets.dropped_triangles},
                         {"maps", std::move(maps)},
                         {"warnings", warnings}};
  if (assets.camera_map) result["cameraMap"] = map_json(*assets.camera_map);
  if (!plates.empty()) result["plates"] = std::move(plates);
  if (!moving.empty()) result["animations"] = std::move(moving);
  if (plan.candidates > 0) {
    result["pilot"] = {{"candidates", plan.candidates},
                       {"frames", plan.frames},
                       {"pixels", plan.pixels},
                       {"cpuSeconds", plan.cpu_seconds}};
  }
  if (bounces) {
    result["bounces"] = {{"adds", bounces->whole}};
    if (!bounces->material.empty())
      result["bounces"].update(
          {{"mostOn", bounces->material}, {"addsThere", bounces->of_material}});
  }
  if (!settings.empty()) result["settings"] = settings_json(settings);
  fmt::print("{}\n", json_text(result, 2));
}

/// Whether two maps are alike and are called alike but for digits.
bool is_one_series(const MapReport& a, const MapReport& b) {
  const auto without_digits = [](std::string path) {
    std::erase_if(path, [](char c) { return c >= '0' && c <= '9'; });
    return path;
  };
  const auto facts = [](const MapReport& map) {
    return std::tie(map.width, map.height, map.file_width, map.file_height, map.colors);
  };
  return facts(a) == facts(b) && without_digits(a.path) == without_digits(b.path);
}

/// A line for each, or for each series of them.
void print_maps(const std::vector<MapReport>& maps) {
  for (std::size_t first = 0, last = 0; first < maps.size(); first = last + 1) {
    last = first;
    while (last + 1 < maps.size() && is_one_series(maps[first], maps[last + 1])) ++last;
    const MapReport& map = maps[first];
    const std::string until =
        last > first ? fmt::format(" to {}, {} maps", maps[last].path, last - first + 1) : "";
    say("map        {}{} ({}x{})\n", map.path, until, map.file_width, map.file_height);
    if (map.width < map.file_width) say("           reduced to {}x{}\n", map.width, map.height);
    if (!map.colors.empty()) say("           converted: {}\n", map.colors);
  }
}

void print_assets(const AssetReport& assets) {
  say("geometry   {} triangles in {} instances of {} meshes\n", assets.triangles, assets.instances,
      assets.meshes);
  if (assets.deforming_meshes > 0)
    say("           {} of the meshes deform\n", assets.deforming_meshes);
  print_maps(assets.maps);
  if (const auto& map = assets.camera_map) {
    say("cameraMap  {} ({}x{})\n", map->path, map->file_width, map->file_height);
    if (!map->colors.empty()) say("           converted: {}\n", map->colors);
  }
}

/// Each conversion once, however many plates there are.
void print_plates(const JobSpec& job, const std::vector<PlateReport>& plates) {
  if (plates.empty()) return;
  const auto file = [&](FrameNumber frame) { return file_at(*job.output.plate, frame); };
  say("over       {}{}\n", file(job.frames.front()),
      job.frames.size() > 1 ? " ... " + file(job.frames.back()) : "");
  std::map<std::string, std::size_t> conversions;
  for (const PlateReport& plate : plates) ++conversions[plate.colors];
  conversions.erase("");
  for (const auto& [text, count] : conversions)
    say("           {}converted: {}\n",
        count < plates.size() ? fmt::format("{} of {} ", count, plates.size()) : "", text);
}

void print_text(const JobSpec& job, const JobEstimate& e, const AssetReport& assets,
                const std::vector<AnimationUse>& animations) {
  const auto total = [&](std::int64_t bytes) {
    return bytes_text(static_cast<std::uint64_t>(bytes));
  };
  say("job        {}\n", job.name);
  say("frames     {} ({})\n", e.frames, format_frames(job.frames));
  const PixelRect image = job.image.shown();
  say("image      {}x{}, {} tiles\n", image.width(), image.height(), e.tiles);
  if (job.image.region)
    say("           from ({}, {}) of {}x{}\n", image.x0, image.y0, job.image.width,
        job.image.height);
  if (const Overscan& o = job.image.overscan; o != Overscan{})
    say("           overscan {} left, {} on top, {} right, {} below: {}x{} are rendered\n", o.left,
        o.top, o.right, o.bottom, job.image.rendered().width(), job.image.rendered().height());
  print_assets(assets);
  for (const AnimationUse& use : animations) say("animation  {}\n", text_of(use));
  say("tasks      {}: {} to render ({} a tile), {} to assemble; {} dependencies\n", e.tasks(),
      e.render_tasks, e.runs, e.assemble_tasks, e.dependencies);
  say("rays       {}{} primary and at most {} shadow rays a pixel and frame\n",
      has_fine_sites(job) ? "at most " : "", e.primary_rays_per_pixel, e.shadow_rays_per_pixel);
  if (e.rounds > 1)
    say("           in {}{} rounds\n", job.quality.adaptive_threshold ? "at most " : "", e.rounds);
  if (e.preroll_rounds > 0) {
    say("preroll    {} rounds before frame {} that are not seen: it takes {:.3g} times as "
        "long\n",
        e.preroll_rounds, job.frames.front(),
        1 + kPrerollShare * static_cast<double>(e.preroll_rounds) / static_cast<double>(e.rounds));
  }
  if (moves(job)) {
    say("motion     history is followed up to {} pixels a frame\n", job.motion.max_px);
  }
  if (e.state_bytes > 0) {
    say("state      at most {:.0f} bytes a pixel\n",
        static_cast<double>(e.state_bytes) / static_cast<double>(job.image.rendered().area()));
  }
  say("film       {} channels, {} a frame in tiles\n", e.film_channels, total(e.film_bytes));
  const StoreEstimate store = estimate_store(job, surface_share(job, *assets.scene));
  say("store      {} at its fullest with one worker: states {}, tiles on their way {}\n",
      total(store.total()), total(store.states), total(store.films + store.samples));
  say("           at most {}, however many workers\n", total(bound_store(job).total()));
  say("disk       frames take at most {}, {} each\n", total(e.frames * e.frame_bytes),
      total(e.frame_bytes));
  say("output     {}/{}\n", job.output.directory, job.output.pattern);
  print_plates(job, assets.plates);
}

void print_settings(const std::vector<JobSetting>& settings) {
  say("\n");
  for (const JobSetting& s : settings) {
    say("{} {} = {}\n", s.given ? "given  " : "default", s.path, s.value);
  }
}

Status write_preview(const CheckOptions& options, const JobSpec& job, const Scene& scene) {
  if (options.picture.empty()) return {};
  BATON_TRY(write_png(options.picture, scene_preview(job, scene)));
  if (options.json) return {};
  for (const std::string& line : object_lines(job, scene)) say("object     {}\n", line);
  say("picture    {}: frame {} as the camera sees it, and from outside\n", options.picture,
      job.frames.front());
  return {};
}

Result<ExitCode> run_check(const CheckOptions& options) {
  BATON_ASSIGN(const JobSpec wanted, load_wanted(options.job));
  std::vector<std::string> left_out;
  const Result<JobSpec> settled = settle_motion(wanted, &left_out);
  const JobSpec& job = settled ? *settled : wanted;
  BATON_ASSIGN(const AssetReport assets,
               load_assets(job, default_memory_bytes()));  // lists the faults of all files
  if (!settled) return settled.error();
  std::vector<JobSetting> settings;
  if (options.explain) {
    BATON_ASSIGN(settings, explain_job(options.job.file, overrides_of(options.job)));
  }

  const JobEstimate estimate = estimate_job(job);
  const std::vector<AnimationUse> animations = animations_of(wanted);
  std::vector<std::string> warnings = job_warnings(job, assets);
  warnings.insert(warnings.end(), left_out.begin(), left_out.end());
  const PilotPlan plan =
      job.sampling.method == Method::automatic
          ? plan_pilot(job, ray_cost_factor(assets.triangles, assets.objects_move))
          : PilotPlan{};
  std::optional<BounceShare> bounces;
  if (job.light.bounces > 0) {
    Result<BounceShare> found = bounce_share(job);
    if (found) bounces = std::move(found).value();
    if (!found && found.error().kind == ErrorKind::cancelled) return found.error();
    if (!found)
      warnings.push_back("what light between surfaces adds is not known: " + found.error().message);
  }
  if (options.json) {
    BATON_TRY(write_preview(options, job, *assets.scene));
    print_json(job, estimate, assets, animations, warnings, settings, plan, bounces);
  } else {
    print_text(job, estimate, assets, animations);
    if (bounces) say("bounces    light between surfaces adds {}\n", text_of(*bounces));
    if (job.sampling.method == Method::automatic)
      say("pilot      before the first frame: {}\n", pilot_text(plan));
    BATON_TRY(write_preview(options, job, *assets.scene));
    for (const std::string& warning : warnings) say("warning    {}\n", warning);
    if (options.explain) print_settings(settings);
  }
  return ExitCode::ok;
}

}  // namespace

void add_check_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      app.add_subcommand("check", "Checks a job with all its files; shows what it will take");
  add_job_argument(*command, options->job);
  command->add_option(
      "--picture", options->picture,
      "writes a cheap look at the scene as PNG: objects with names and bounds, axes, "
      "the camera's view");
  command->add_flag("--explain", options->explain, "also every value in force, given or default");
  command->add_flag("--json", options->json, "for machines");
  command->footer(
      "Examples:\n  baton check job.json\n  baton check job.json --explain | grep sampling\n"
      "  baton check job.json --picture scene.png");
  command->callback([options, &code] { code = finish(run_check(*options)); });
}

}  // namespace baton

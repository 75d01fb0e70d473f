#include "jobs/lab/stability/cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/job/text/job_fields.h"
#include "jobs/lab/stability/maps.h"

namespace baton::stability {
namespace {

std::vector<Law> usual_laws_and(Law law) {
  std::vector<Law> laws = usual_laws();
  laws.push_back(law);
  return laws;
}

using Build = std::function<JobSpec(const Stage&, const Timeline&)>;

/// Adds a case with its job; its laws are the usual ones where it has none of its own.
void add_case(std::vector<Case>& cases, Case added, Build build) {
  added.build = std::move(build);
  if (added.laws.empty()) added.laws = usual_laws();
  cases.push_back(std::move(added));
}

constexpr Law kNoWorseAfterTheJump{Measure::noise_after, 2, 5};

JobSpec turning(JobSpec job, double degrees_per_frame) {
  job.environment.rotation_deg_per_frame = degrees_per_frame;
  return job;
}

/// Maps that take over at a frame, unblended.
JobSpec switching(JobSpec job, const Stage& stage,
                  const std::vector<std::pair<int, RgbImage>>& maps) {
  job.environment.interpolate = false;
  for (const auto& [frame, image] : maps) {
    job.environment.keys.push_back({.frame = static_cast<double>(frame),
                                    .map = stage.map(fmt::format("light{}", frame), image)});
  }
  return job;
}

void add_turning_case(double degrees, const std::string& name, const MaterialSpec& material,
                      bool quick, std::vector<Case>& cases) {
  add_case(cases,
           {.name = fmt::format("turn-{}-{}", degrees, name),
            .text = fmt::format("The studio map turns by {} degrees a frame over boxes, {}.",
                                degrees, name),
            .nodes = name == "phong1000" ? 8 : 4,
            .quick = quick},
           [degrees, material](const Stage& stage, const Timeline&) {
             JobSpec job = turning(stage.boxes(studio_map()), degrees);
             job.scene.materials["ground"] = material;
             return job;
           });
}

void add_turning_cases(std::vector<Case>& cases) {
  for (const double degrees : {0.1, 0.7, 1.5, 5.0, 45.0}) {
    const bool quick = degrees == 1.5;
    add_turning_case(degrees, "diffuse", diffuse({0.5f, 0.5f, 0.5f}), quick || degrees == 45,
                     cases);
    add_turning_case(degrees, "phong50", phong(50, 0.5f, 0.5f), false, cases);
    add_turning_case(degrees, "phong1000", phong(1000, 1, 0), quick, cases);
  }
}

void add_jumping_cases(std::vector<Case>& cases) {
  const auto add = [&](const char* name, const char* text, bool quick, Build build) {
    add_case(cases,
             {.name = name,
              .text = text,
              .laws = usual_laws_and(kNoWorseAfterTheJump),
              .jumps = true,
              .quick = quick},
             std::move(build));
  };
  add("cut", "The studio map, then with one frame another one, for good.", true,
      [](const Stage& stage, const Timeline& time) {
        return switching(stage.boxes(studio_map()), stage, {{time.event, other_map()}});
      });
  add("flash", "Dusk; a lamp of a thousand times its radiance for a single frame; dusk again.",
      true, [](const Stage& stage, const Timeline& time) {
        return switching(stage.boxes(dusk_map(false)), stage,
                         {{time.event, dusk_map(true)}, {time.event + 1, dusk_map(false)}});
      });
  add("sun-on", "Dusk, then the lamp is switched on for good.", false,
      [](const Stage& stage, const Timeline& time) {
        return switching(stage.boxes(dusk_map(false)), stage, {{time.event, dusk_map(true)}});
      });
  add("lamp-where-black",
      "One lit texel on black; another place is lit besides, where no carried sample is.", true,
      [](const Stage& stage, const Timeline& time) {
        RgbImage both = lit_texel_map();
        std::copy_n(std::begin({60.0f, 60.0f, 60.0f}), 3, &both.rgb[3 * (8 * 64 + 40)]);
        return switching(stage.boxes(lit_texel_map()), stage, {{time.event, both}});
      });
  add("black-then-light", "A black map, then the studio map.", true,
      [](const Stage& stage, const Timeline& time) {
        return switching(stage.boxes(black_map()), stage, {{time.event, studio_map()}});
      });
}

void add_hard_light_cases(std::vector<Case>& cases) {
  const auto add = [&](const char* name, const char* text, bool quick, int nodes,
                       const RgbImage& map, double degrees, MapFilter filter) {
    add_case(cases, {.name = name, .text = text, .nodes = nodes, .quick = quick},
             [map, degrees, filter](const Stage& stage, const Timeline&) {
               JobSpec job = turning(stage.boxes(map), degrees);
               job.environment.filter = filter;
               return job;
             });
  };
  add("lit-texel", "One lit texel moves over black, 1.5 degrees a frame.", true, 12,
      lit_texel_map(), 1.5, MapFilter::nearest);
  add("led-panels", "Hard-edged capped panels on black turn by 1.5 degrees a frame.", true, 8,
      panels_map(), 1.5, MapFilter::nearest);
  add("sun-1e5", "A sun of 1e5 in two texels over a sky of 1 turns by 0.7 degrees a frame.", true,
      4, two_texel_sun_map(), 0.7, MapFilter::bilinear);
  add_case(cases,
           {.name = "broken-texels",
            .text = "NaN, infinite and negative texels in the turning studio map count as black."},
           [](const Stage& stage, const Timeline&) {
             return turning(stage.boxes(broken_map(false)), 0.7);
           });
}

void add_surface_cases(std::vector<Case>& cases) {
  add_case(
      cases,
      {.name = "horizon",
       .text = "A lone panel sets and rises about a coarse sphere with smooth normals, "
               "3 degrees a frame.",
       .nodes = 8,
       .quick = true},
      [](const Stage& stage, const Timeline&) {
        JobSpec job = turning(stage.plain(lone_panel_map()), 3);
        job.environment.rotation_axis = {1, 0, 0.3f};
        job.camera = {
            .position = {0, 1, 4}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .vertical_fov_deg = 27};
        stage.add(job, "sphere", sphere_obj(), phong(20, 0.5f, 0.5f), true);
        job.scene.ground->height = -1;
        return job;
      });
  add_case(
      cases,
      {.name = "mirror-beside-diffuse",
       .text =
           "Near-mirrors (exponent 20000) checkered with diffuse under panels that turn slowly.",
       .nodes = 24},
      [](const Stage& stage, const Timeline&) {
        JobSpec job = turning(stage.boxes(panels_map()), 0.1);
        job.environment.filter = MapFilter::nearest;
        stage.add(job, "mirror", checker_obj(12, 12, 0.35f, 0.01f), phong(20000, 0.9f, 0.1f));
        return job;
      });
  add_case(cases,
           {.name = "albedo-checker",
            .text = "Albedo 1 beside 0.01, the studio map turning by 0.7 degrees a frame."},
           [](const Stage& stage, const Timeline&) {
             JobSpec job = turning(stage.boxes(studio_map()), 0.7);
             job.scene.materials["ground"] = diffuse({0.01f, 0.01f, 0.01f});
             stage.add(job, "white", checker_obj(12, 12, 0.35f, 0.01f), diffuse({1, 1, 1}));
             return job;
           });
  add_case(cases,
           {.name = "coloured-walls",
            .text = "A corner of a pure red and a pure green wall, the studio map turning "
                    "by 0.7 degrees a frame."},
           [](const Stage& stage, const Timeline&) {
             JobSpec job = turning(stage.plain(studio_map()), 0.7);
             stage.add(job, "red", box_obj({-1.2f, 0, -1.3f}, {-0.9f, 1.5f, 1.3f}),
                       diffuse({0.9f, 0, 0}));
             stage.add(job, "green", box_obj({-0.9f, 0, -1.3f}, {1.5f, 1.5f, -1}),
                       diffuse({0, 0.9f, 0}));
             return job;
           });
}

void add_shadow_cases(std::vector<Case>& cases) {
  add_case(
      cases,
      {.name = "dark-cave",
       .text = "Under a plate with a small hole: at most 3 % of the light arrives, most pixels see "
               "none of it.",
       // What arrives is so rare that noise is all there is: only bias and Lns are judged.
       .laws = {{Measure::unlawful, 0, 0},
                {Measure::negative, 1e-4, 1e-2},
                {Measure::bias, 0.01, 0.05},
                {Measure::lns_bias, 0.01, 0.05},
                {Measure::lns_median, 0.1, 0.3},
                {Measure::lost, 0.01, 0.1}}},
      [](const Stage& stage, const Timeline&) {
        JobSpec job = turning(stage.plain(studio_map()), 0.7);
        job.camera = {.position = {0, 0.9f, 1.2f},
                      .look_at = {0, 0, 0},
                      .up = {0, 1, 0},
                      .vertical_fov_deg = 50};
        stage.add(job, "plate", pierced_plate_obj(60, 0.35f, 1), diffuse({0.5f, 0.5f, 0.5f}));
        return job;
      });
  add_case(cases,
           {.name = "open-plain", .text = "A thin pole on a plain: nearly everything is visible."},
           [](const Stage& stage, const Timeline&) {
             JobSpec job = turning(stage.plain(studio_map()), 0.7);
             stage.add(job, "pole", box_obj({-0.02f, 0, -0.02f}, {0.02f, 0.6f, 0.02f}),
                       diffuse({0.5f, 0.5f, 0.5f}));
             return job;
           });
  add_case(cases,
           {.name = "lone-shadow",
            .text = "A small box hovers under a tiny sun: about one pixel is in its shadow."},
           [](const Stage& stage, const Timeline&) {
             JobSpec job = stage.plain(two_texel_sun_map());
             stage.add(job, "chip", box_obj({-0.1f, 0.3f, -0.1f}, {0.1f, 0.32f, 0.1f}),
                       diffuse({0.5f, 0.5f, 0.5f}));
             return job;
           });
}

void add_frame_cases(std::vector<Case>& cases) {
  const auto add = [&](const char* name, const char* text, int width, int height, bool quick) {
    add_case(cases, {.name = name, .text = text, .quick = quick},
             [width, height](const Stage& stage, const Timeline&) {
               JobSpec job = turning(stage.boxes(studio_map()), 0.7);
               job.image.width = width;
               job.image.height = height;
               job.image.tile_size = 8;
               return job;
             });
  };
  add("one-column", "An image one pixel wide in clipped tiles.", 1, 27, true);
  add("one-row", "An image one pixel high in clipped tiles.", 27, 1, false);
  add("clipped-tiles", "Tiles clipped at both borders.", 11, 9, false);
  add_case(cases,
           {.name = "thousand-frames",
            .text = "A thousand frames of the overcast sky turning about a tilted axis by "
                    "0.7 degrees a frame.",
            .laws = usual_laws_and({Measure::growth, 1.5, 3}),
            .stretch = 5},
           [](const Stage& stage, const Timeline&) {
             // The sky is the same all around: only a tilted axis changes it.
             JobSpec job = turning(stage.boxes(overcast_map()), 0.7);
             job.environment.rotation_axis = {1, 1, 0};
             return job;
           });
}

}  // namespace

std::vector<FrameNumber> Timeline::judged() const {
  std::set<int> numbers{1, 2};
  for (int pair = 1; pair < 5; ++pair) {
    numbers.insert({1 + frames * 3 * pair / 20, 2 + frames * 3 * pair / 20});
  }
  const int late_step = std::max((frames - late()) / 4, 2);
  for (int first = late(); first < frames; first += late_step) numbers.insert({first, first + 1});
  if (event > 0) {
    for (const int after : {-1, 0, 1, 2, 4, 8, 16}) numbers.insert(std::min(event + after, frames));
  }
  std::vector<FrameNumber> judged;
  for (const int number : numbers) judged.emplace_back(number);
  return judged;
}

Timeline Case::timeline(const Effort& effort) const {
  const int frames = std::min(effort.frames * stretch, 1000);
  return {frames, jumps ? 3 * frames / 10 : 0};
}

std::vector<Law> usual_laws() {
  return {
      {Measure::unlawful, 0, 0},       {Measure::negative, 1e-4, 1e-2}, {Measure::bias, 0.01, 0.05},
      {Measure::lns_bias, 0.01, 0.05}, {Measure::lns_median, 0.1, 0.3}, {Measure::noise, 2, 5},
      {Measure::noise_shown, 2, 5},    {Measure::black, 1e-3, 1e-2},    {Measure::lost, 0.01, 0.1}};
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  add_case(cases,
           {.name = "static",
            .text = "Nothing moves, so the samples' Lns must not either.",
            .laws = usual_laws_and({Measure::growth, 1.2, 2}),
            .quick = true},
           [](const Stage& stage, const Timeline&) { return stage.boxes(studio_map()); });
  add_turning_cases(cases);
  add_jumping_cases(cases);
  add_hard_light_cases(cases);
  add_surface_cases(cases);
  add_shadow_cases(cases);
  const std::vector<Case> moving = moving_cases();
  cases.insert(cases.end(), moving.begin(), moving.end());
  add_frame_cases(cases);
  return cases;
}

std::vector<Subject> all_subjects() {
  std::vector<Subject> subjects;
  for (std::size_t method = 0; method < method_names().size(); ++method) {
    if (static_cast<Method>(method) == Method::automatic) continue;
    subjects.push_back({std::string(method_names()[method]), [method](JobSpec& job) {
                          job.sampling.method = static_cast<Method>(method);
                          job.sampling.reference_samples = 128;
                        }});
  }
  subjects.push_back({"mis compensated", [](JobSpec& job) {
                        job.sampling.method = Method::mis;
                        job.sampling.mis_compensation = true;
                      }});

  // The sequential sampler as published: no refresh on schedule.
  const auto published = [&](const char* name, int distributions, LnsUpdate update,
                             std::optional<float> refresh_ratio) {
    subjects.push_back({name, [=](JobSpec& job) {
                          job.sampling.method = Method::sequential;
                          job.sampling.num_distributions = distributions;
                          job.sampling.lns_update = update;
                          job.sampling.refresh_every = 0;
                          job.sampling.refresh_ratio = refresh_ratio;
                        }});
  };
  published("published P=1", 1, LnsUpdate::ratio, {});
  published("published P=5", 5, LnsUpdate::ratio, {});
  published("published path left", 5, LnsUpdate::path_left, {});
  published("published path trapezoid", 5, LnsUpdate::path_trapezoid, {});
  published("published refresh rule", 5, LnsUpdate::path_trapezoid, 1.5f);
  return subjects;
}

}  // namespace baton::stability

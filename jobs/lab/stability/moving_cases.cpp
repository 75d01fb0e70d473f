#include <cmath>
#include <numbers>

#include "jobs/lab/stability/cases.h"
#include "jobs/lab/stability/maps.h"

namespace baton::stability {
namespace {

/// Frames of one way there and back.
constexpr int kPeriod = 80;
/// Between keys, which are joined by splines.
constexpr int kKeyStep = 8;

/// Where a swing between -1 and 1 is at a frame; at 0 in frame 1.
float swing(int frame) {
  return static_cast<float>(std::sin(2 * std::numbers::pi * (frame - 1) / kPeriod));
}

/// The scene at 16 x 16 pixels, history followed for up to four of them.
JobSpec prepared(JobSpec job) {
  job.image.width = 16;
  job.image.height = 16;
  job.motion.max_px = 4;
  return job;
}

/// Calls add(frame) for the frames of the keys.
template <class F>
void for_keys(const Timeline& time, F add) {
  for (int frame = 1; frame < time.frames + kKeyStep; frame += kKeyStep) add(frame);
}

JobSpec panned(const Stage& stage, const Timeline& time) {
  JobSpec job = prepared(stage.boxes(studio_map()));
  for_keys(time, [&](int frame) {
    const Vec3 aside{1.2f * swing(frame), 0, 0};
    job.camera.keys.push_back({.frame = static_cast<double>(frame),
                               .position = job.camera.position + aside,
                               .look_at = job.camera.look_at + aside});
  });
  return job;
}

JobSpec zoomed(const Stage& stage, const Timeline& time) {
  JobSpec job = prepared(stage.boxes(studio_map()));
  for_keys(time, [&](int frame) {
    job.camera.keys.push_back({.frame = static_cast<double>(frame),
                               .position = job.camera.position,
                               .look_at = job.camera.look_at,
                               .vertical_fov_deg = 22 - 8 * swing(frame)});
  });
  return job;
}

/// A camera that is elsewhere every 20 frames: nothing can be followed across.
JobSpec cut_from_place_to_place(const Stage& stage, const Timeline& time) {
  JobSpec job = prepared(stage.boxes(studio_map()));
  job.motion.curve = KeyCurve::linear;
  for (int frame = 1; frame <= time.frames; frame += 20) {
    const float side = frame / 20 % 2 == 0 ? 1.0f : -1.0f;
    const Vec3 position{2.5f * side, 2.5f, 3.1f};
    for (const int at : {frame, frame + 19}) {
      job.camera.keys.push_back(
          {.frame = static_cast<double>(at), .position = position, .look_at = job.camera.look_at});
    }
  }
  return job;
}

/// Adds a grey box that swings by `way`, and turns a little.
void add_swinging(const Stage& stage, const Timeline& time, const std::string& box, const Vec3& way,
                  JobSpec& job) {
  stage.add(job, "swinging", box, diffuse({0.3f, 0.3f, 0.3f}));
  for_keys(time, [&](int frame) {
    job.scene.objects.back().keys.push_back({.frame = static_cast<double>(frame),
                                             .translate = way * swing(frame),
                                             .rotate_deg = {0, 10 * swing(frame), 0}});
  });
}

}  // namespace

std::vector<Case> moving_cases() {
  std::vector<Case> cases;
  const auto add = [&](const char* name, const char* text, bool quick, auto build) {
    cases.push_back(
        {.name = name, .text = text, .build = build, .laws = usual_laws(), .quick = quick});
  };
  add("pan", "The camera slides to and fro by up to 0.7 pixels a frame; the light stands still.",
      true, panned);
  add("pan-and-turn", "The same while the studio map turns by 0.7 degrees a frame.", false,
      [](const Stage& stage, const Timeline& time) {
        JobSpec job = panned(stage, time);
        job.environment.rotation_deg_per_frame = 0.7;
        return job;
      });
  add("zoom", "The angle of view goes from 30 to 14 degrees and back.", false, zoomed);
  add("camera-cut", "The camera is elsewhere every 20 frames: everything starts afresh.", false,
      cut_from_place_to_place);
  add("disocclusion", "A plate swings before the boxes: what it uncovers starts afresh.", false,
      [](const Stage& stage, const Timeline& time) {
        JobSpec job = prepared(stage.boxes(studio_map()));
        add_swinging(stage, time, box_obj({-0.4f, 0.05f, 1.2f}, {0.4f, 0.9f, 1.25f}), {1.2f, 0, 0},
                     job);
        return job;
      });
  add("moving-caster",
      "A plate above the scene swings: its shadow sweeps surfaces that stand still.", true,
      [](const Stage& stage, const Timeline& time) {
        JobSpec job = prepared(stage.boxes(studio_map()));
        add_swinging(stage, time, box_obj({-0.5f, 1.4f, -0.5f}, {0.5f, 1.45f, 0.5f}),
                     {1.0f, 0, 0.5f}, job);
        return job;
      });
  return cases;
}

}  // namespace baton::stability

#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "worker/pass/render_context.h"

namespace baton::test {

/// A folder of the test in work, or of a study, in this process, made on demand.
inline std::filesystem::path test_folder() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  const std::string name =
      info == nullptr ? "study" : std::string(info->test_suite_name()) + "_" + info->name();
  std::filesystem::path folder = std::filesystem::path(testing::TempDir()) /
                                 ("baton_" + name + "_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  return folder;
}

/// Writes `image` as a float EXR and returns its path.
inline std::string write_map(const std::string& name, const RgbImage& image) {
  FilmTile film{
      .rect = {0, 0, image.width, image.height}, .channels = {"R", "G", "B"}, .values = {}};
  film.values.resize(film.num_pixels() * 3);
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) film.plane(c)[i] = image.rgb[3 * i + c];
  }
  const std::filesystem::path path = test_folder() / name;
  const Status written =
      write_exr(path, film, {.half_float = false, .compression = "none", .metadata = {}});
  EXPECT_TRUE(written.ok());
  return path.string();
}

inline RgbImage constant_map(int width, int height, const Rgb& color) {
  RgbImage image{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    image.rgb.insert(image.rgb.end(), {color.x, color.y, color.z});
  return image;
}

/// A dim sky, a darker ground and a warm sun of 2 x 2 texels half-way up on the +Z side: shadows
/// with hard and soft parts.
inline RgbImage sky_map(int width = 64, int height = 32, float sun = 60) {
  RgbImage image = constant_map(width, height, {0.3f, 0.4f, 0.6f});
  const auto set = [&](int x, int y, const Rgb& c) {
    float* texel = &image.rgb[3 * static_cast<std::size_t>(y * width + x)];
    texel[0] = c.x;
    texel[1] = c.y;
    texel[2] = c.z;
  };
  for (int y = height / 2; y < height; ++y) {
    for (int x = 0; x < width; ++x) set(x, y, {0.1f, 0.08f, 0.06f});
  }
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx)
      set(width / 2 + 3 + dx, height / 4 + dy, {sun, 0.8f * sun, 0.5f * sun});
  }
  return image;
}

/// An axis-aligned box of side 1 centred on the origin, as OBJ text.
inline std::string box_obj() {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    text += "v " + std::to_string((i & 1) - 0.5) + " " + std::to_string((i >> 1 & 1) - 0.5) + " " +
            std::to_string((i >> 2 & 1) - 0.5) + "\n";
  }
  for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"}) {
    text += std::string("f ") + face + "\n";
  }
  return text;
}

/// A glossy and a diffuse box on a diffuse ground under sky_map(): hard and soft shadow, gloss,
/// silhouettes.
inline JobSpec box_job() {
  const std::filesystem::path mesh = test_folder() / "box.obj";
  std::ofstream(mesh) << box_obj();
  JobSpec job;
  job.sampling.method = Method::sequential;
  job.name = "boxes";
  job.image = {.width = 12, .height = 9, .sites = 1, .tile_size = 4096};
  job.camera = {
      .position = {0, 1.6f, 4}, .look_at = {0, 0.3f, 0}, .up = {0, 1, 0}, .vertical_fov_deg = 35};
  job.scene.materials["ground"] = {.kind = MaterialKind::diffuse, .base_color = {0.5f, 0.5f, 0.5f}};
  job.scene.materials["glossy"] = {.kind = MaterialKind::phong,
                                   .base_color = {0.7f, 0.3f, 0.2f},
                                   .kd = 0.5f,
                                   .ks = 0.5f,
                                   .exponent = 20};
  job.scene.materials["metal"] = {.kind = MaterialKind::metallic_roughness,
                                  .base_color = {0.9f, 0.7f, 0.4f},
                                  .metallic = 1,
                                  .roughness = 0.4f};
  job.scene.meshes["box"] = {.path = mesh.string(), .smooth_normals = false};
  job.scene.objects = {{.mesh = "box",
                        .material = "glossy",
                        .translate = {-0.8f, 0, 0},
                        .rotate_deg = {0, 25, 0},
                        .place_on_ground = true},
                       {.mesh = "box",
                        .material = "metal",
                        .translate = {0.8f, 0, 0.2f},
                        .rotate_deg = {0, -20, 0},
                        .place_on_ground = true}};
  job.scene.ground = GroundSpec{.material = "ground", .height = 0, .size = 40};
  job.environment.keys = {{.frame = 1, .map = write_map("sky.exr", sky_map())}};
  job.output.directory = test_folder().string();
  job.output.aovs = {Aov::lns,    Aov::visibility, Aov::ess,  Aov::acceptance,
                     Aov::source, Aov::normal,     Aov::depth};
  job.state.checkpoint_every = 1000;
  return job;
}

inline std::vector<FrameNumber> frame_numbers(int count) {
  std::vector<FrameNumber> frames;
  for (int i = 1; i <= count; ++i) frames.emplace_back(i);
  return frames;
}

/// Gives the camera of box_job a motion (half a degree round the scene per frame, a little nearer)
/// and the second box one of its own; both for as many frames as the job has.
inline void set_in_motion(JobSpec& job, bool camera, bool object) {
  const auto frames = static_cast<int>(job.frames.size());
  for (int frame = 1; frame <= frames; ++frame) {
    const float angle = 0.5f * static_cast<float>(frame - 1) * kPi / 180;
    const float distance = 4 - 0.02f * static_cast<float>(frame - 1);
    if (camera) {
      job.camera.keys.push_back(
          {.frame = static_cast<double>(frame),
           .position = {distance * std::sin(angle), 1.6f, distance * std::cos(angle)},
           .look_at = job.camera.look_at});
    }
  }
  if (object) {
    job.scene.objects[1].keys = {
        {.frame = 1}, {.frame = static_cast<double>(frames + 1), .translate = {-0.3f, 0.1f, 0.2f}}};
  }
  job.motion.max_px = 4;
}

/// Films, what a second pass needs of them and last state of tile 0 over all frames of the job;
/// where things move, tile 0 must be the whole image.
struct TileResult {
  std::vector<FilmTile> films;
  std::vector<FirstPassSamples> samples;
  SampleState state;
  RenderStats stats;
};
inline TileResult render_tile(const JobSpec& job, std::int32_t tile = 0) {
  TileResult result;
  const auto context = load_render_context(job, Digest{1, 2});
  if (!context) {
    ADD_FAILURE() << context.error().message;
    return result;
  }
  const TileRunSink sink{
      .film =
          [&](Step, const FilmTile& film) {
            result.films.push_back(film);
            return Status();
          },
      .state =
          [&](const SampleState& state) {
            result.state = state;
            return Status();
          },
      .samples =
          [&](FirstPassSamples samples) {
            result.samples.push_back(std::move(samples));
            return Status();
          },
      .earlier_film = [&](Step step) -> Result<FilmTile> { return result.films.at(step.index()); }};
  for (Run run; run < Run(num_runs(job)); ++run) {
    std::vector<StatePtr> previous;
    if (carries_state(job) && run > Run(0))
      previous = {std::make_shared<const SampleState>(result.state)};
    const auto stats = run_tile(**context, tile_run(job, tile, run), previous, sink, {});
    if (!stats) {
      ADD_FAILURE() << stats.error().message;
      return result;
    }
    result.stats.merge(*stats);
  }
  return result;
}

/// The plane of a named channel.
inline std::span<const float> channel(const FilmTile& film, const std::string& name) {
  for (std::size_t c = 0; c < film.channels.size(); ++c) {
    if (film.channels[c] == name) return {film.plane(c), film.num_pixels()};
  }
  ADD_FAILURE() << "no channel " << name;
  return {};
}

/// Mean over R, G, B of a layer per pixel; "": of the colours.
inline std::vector<double> mean_rgb(const FilmTile& film, const std::string& layer = "") {
  const std::string stem = layer.empty() ? "" : layer + ".";
  const auto r = channel(film, stem + "R"), g = channel(film, stem + "G"),
             b = channel(film, stem + "B");
  std::vector<double> mean(film.num_pixels());
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = (double{r[i]} + g[i] + b[i]) / 3;
  return mean;
}

}  // namespace baton::test

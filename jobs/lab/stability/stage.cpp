#include "jobs/lab/stability/stage.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "common/base/check.h"

namespace baton::stability {

Stage::Stage(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
}

std::string Stage::map(const std::string& name, const RgbImage& image) const {
  FilmTile film{
      .rect = {0, 0, image.width, image.height}, .channels = {"R", "G", "B"}, .values = {}};
  film.values.resize(film.num_pixels() * 3);
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) film.plane(c)[i] = image.rgb[3 * i + c];
  }
  const std::filesystem::path path = folder_ / (name + ".exr");
  const Status written =
      write_exr(path, film, {.half_float = false, .compression = "none", .metadata = {}});
  BATON_CHECK(written.ok());
  return path.string();
}

std::string Stage::mesh(const std::string& name, const std::string& obj) const {
  const std::filesystem::path path = folder_ / (name + ".obj");
  std::ofstream(path) << obj;
  return path.string();
}

JobSpec Stage::plain(const RgbImage& light) const {
  JobSpec job;
  job.sampling.method = Method::sequential;
  job.name = "stability";
  job.image = {.width = 8, .height = 8, .sites = 1, .tile_size = 4096};
  job.camera = {
      .position = {0, 2.5f, 4}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .vertical_fov_deg = 25};
  job.scene.materials["ground"] = diffuse({0.5f, 0.5f, 0.5f});
  job.scene.ground = GroundSpec{.material = "ground", .height = 0, .size = 60};
  job.environment.keys = {{.frame = 1, .map = map("light", light)}};
  job.output.directory = folder_.string();
  job.output.background = Background::transparent;
  job.output.aovs = {Aov::lns, Aov::visibility, Aov::ess, Aov::acceptance, Aov::source};
  job.state.checkpoint_every = 1000;
  return job;
}

JobSpec Stage::boxes(const RgbImage& light) const {
  JobSpec job = plain(light);
  job.scene.meshes["boxes_left"] = {
      .path = mesh("left", box_obj({-0.9f, 0, -0.6f}, {-0.3f, 0.7f, 0})), .smooth_normals = false};
  job.scene.meshes["boxes_right"] = {
      .path = mesh("right", box_obj({0.35f, 0, -0.2f}, {0.8f, 0.4f, 0.3f})),
      .smooth_normals = false};
  for (const char* name : {"boxes_left", "boxes_right"}) {
    job.scene.objects.push_back({.mesh = name, .material = "ground"});
  }
  return job;
}

void Stage::add(JobSpec& job, const std::string& name, const std::string& obj,
                const MaterialSpec& material, bool smooth) const {
  job.scene.materials[name] = material;
  job.scene.meshes[name] = {.path = mesh(name, obj), .smooth_normals = smooth};
  job.scene.objects.push_back({.mesh = name, .material = name});
}

MaterialSpec phong(float exponent, float ks, float kd) {
  return {.kind = MaterialKind::phong,
          .base_color = {0.6f, 0.6f, 0.6f},
          .kd = kd,
          .ks = ks,
          .exponent = exponent};
}

MaterialSpec diffuse(const Rgb& albedo) {
  return {.kind = MaterialKind::diffuse, .base_color = albedo};
}

std::string box_obj(const Vec3& low, const Vec3& high) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    text += fmt::format("v {} {} {}\n", i & 1 ? high.x : low.x, i & 2 ? high.y : low.y,
                        i & 4 ? high.z : low.z);
  }
  for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"}) {
    text += fmt::format("f {}\n", face);
  }
  return text;
}

namespace {

/// Appends a horizontal rectangle that faces up.
void add_rectangle(std::string& text, int& corners, float x0, float x1, float z0, float z1,
                   float y) {
  text += fmt::format("v {0} {4} {2}\nv {0} {4} {3}\nv {1} {4} {3}\nv {1} {4} {2}\n", x0, x1, z0,
                      z1, y);
  text += fmt::format("f {} {} {} {}\n", corners + 1, corners + 2, corners + 3, corners + 4);
  corners += 4;
}

}  // namespace

std::string checker_obj(int columns, int rows, float cell, float y) {
  std::string text;
  int corners = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = j % 2; i < columns; i += 2) {
      const float x = (static_cast<float>(i) - 0.5f * static_cast<float>(columns)) * cell;
      const float z = (static_cast<float>(j) - 0.5f * static_cast<float>(rows)) * cell;
      add_rectangle(text, corners, x, x + cell, z, z + cell, y);
    }
  }
  return text;
}

std::string pierced_plate_obj(float size, float hole, float y) {
  const float s = 0.5f * size;
  const float h = 0.5f * hole;
  std::string text;
  int corners = 0;
  add_rectangle(text, corners, -s, s, -s, -h, y);
  add_rectangle(text, corners, -s, s, h, s, y);
  add_rectangle(text, corners, -s, -h, -h, h, y);
  add_rectangle(text, corners, h, s, -h, h, y);
  return text;
}

std::string sphere_obj() {
  constexpr int kAround = 8;
  constexpr int kDown = 4;
  std::string text = "v 0 1 0\n";
  for (int j = 1; j < kDown; ++j) {
    const float polar = kPi * static_cast<float>(j) / kDown;
    for (int i = 0; i < kAround; ++i) {
      const float longitude = 2 * kPi * static_cast<float>(i) / kAround;
      text += fmt::format("v {} {} {}\n", std::sin(polar) * std::sin(longitude), std::cos(polar),
                          std::sin(polar) * std::cos(longitude));
    }
  }
  text += "v 0 -1 0\n";
  const auto corner = [](int j, int i) { return 2 + (j - 1) * kAround + i % kAround; };
  const int south = 2 + (kDown - 1) * kAround;
  for (int i = 0; i < kAround; ++i) {
    text += fmt::format("f 1 {} {}\n", corner(1, i), corner(1, i + 1));
    for (int j = 1; j + 1 < kDown; ++j) {
      text += fmt::format("f {} {} {} {}\n", corner(j, i), corner(j + 1, i), corner(j + 1, i + 1),
                          corner(j, i + 1));
    }
    text += fmt::format("f {} {} {}\n", south, corner(kDown - 1, i + 1), corner(kDown - 1, i));
  }
  return text;
}

}  // namespace baton::stability

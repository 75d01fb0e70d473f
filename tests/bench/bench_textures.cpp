// Time of a pixel with textures over that without: a wavy sheet of 320,000 triangles that fills the
// picture, 1920 x 1080, `pool` with its defaults, with three images of 4096 x 4096 texels (base
// colour, metal and roughness, normals) and without any. Images of one colour show what the
// look-ups alone take: the surface is the bare one. The numbers of the bare material are the means
// of the images. All are rendered in turn in one process, every fifth tile, and the ratio of each
// turn is taken, so the rows hold on a noisy machine. The images are made in a folder of their own
// and removed. Usage: bench_textures [JOB.json] [FRAMES [TURNS]]; of the job only the light is
// used.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/job/text/job_json.h"
#include "common/math/philox.h"
#include "worker/pass/render_context.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr int kTexels = 4096;
constexpr int kCells = 400;  ///< of the sheet, a side
constexpr int kTileStep = 5;
/// Highest ratio that the project accepts.
constexpr double kGoal = 1.2;

/// A number that write_png, which is given light, shall store as such.
float stored(float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); }

/// Writes an image; value: of a texel at (x, y), with a number of it in [0, 1) that looks random.
Status write_image(const fs::path& path, const std::function<Rgb(float, float, float)>& value) {
  RgbImage image{kTexels, kTexels, {}};
  image.rgb.reserve(std::size_t{3} * kTexels * kTexels);
  std::uint32_t bits = 1;
  for (int y = 0; y < kTexels; ++y) {
    for (int x = 0; x < kTexels; ++x) {
      bits = bits * 1664525u + 1013904223u;
      const Rgb texel = value(static_cast<float>(x), static_cast<float>(y), uniform_float(bits));
      image.rgb.insert(image.rgb.end(), {texel.x, texel.y, texel.z});
    }
  }
  return write_png(path, image);
}

/// A wave over one period of `texels`, in [-1, 1].
float wave(float x, float texels) { return std::sin(2 * kPi * x / texels); }

/// What lies on the sheet.
enum class Images { none, flat, varied };

/// The images and the mesh.
Status make_files(const fs::path& folder) {
  BATON_TRY(write_image(folder / "color.png", [](float x, float y, float u) {
    const float tone = 0.5f + 0.15f * wave(x, 97) * wave(y, 61) + 0.2f * (u - 0.5f);
    return Rgb{tone, 0.8f * tone, 0.6f * tone};
  }));
  BATON_TRY(write_image(folder / "rough.png", [](float x, float y, float u) {
    return Rgb{0, stored(0.5f + 0.2f * wave(x + y, 47) + 0.1f * (u - 0.5f)),
               stored(0.2f + 0.2f * wave(y, 310))};
  }));
  BATON_TRY(write_image(folder / "normal.png", [](float x, float y, float u) {
    return Rgb{stored(0.5f + 0.06f * wave(x, 29) + 0.02f * (u - 0.5f)),
               stored(0.5f + 0.06f * wave(y, 37)), stored(0.98f)};
  }));
  BATON_TRY(write_image(folder / "flat-color.png", [](float, float, float) {
    return Rgb{0.5f, 0.4f, 0.3f};
  }));
  BATON_TRY(write_image(folder / "flat-rough.png", [](float, float, float) {
    return Rgb{0, stored(0.5f), stored(0.2f)};
  }));
  BATON_TRY(write_image(folder / "flat-normal.png", [](float, float, float) {
    return Rgb{stored(0.5f), stored(0.5f), 1};
  }));
  std::ofstream mesh(folder / "sheet.obj");
  const auto place = [](int i) { return static_cast<float>(i) / kCells; };
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const float x = 6 * (place(j) - 0.5f), z = 6 * (place(i) - 0.5f);
      mesh << fmt::format("v {} {} {}\nvt {} {}\n", x, 0.15f * std::sin(5 * x) * std::cos(4 * z), z,
                          place(j), place(i));
    }
  }
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const int a = i * (kCells + 1) + j + 1, b = a + kCells + 1;
      mesh << fmt::format("f {0}/{0} {1}/{1} {2}/{2}\nf {0}/{0} {2}/{2} {3}/{3}\n", a, b, b + 1,
                          a + 1);
    }
  }
  return mesh.flush() ? Status() : Error{ErrorKind::io, folder.string() + ": cannot write"};
}

JobSpec sheet_job(const JobSpec& light, const fs::path& folder, Images images) {
  JobSpec job;
  job.name = "textures";
  job.environment = light.environment;
  job.image = {.width = 1920, .height = 1080};
  job.camera = {
      .position = {0, 1.6f, 2.6f}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .vertical_fov_deg = 40};
  MaterialSpec& material = job.scene.materials["sheet"];
  material.kind = MaterialKind::metallic_roughness;
  if (images != Images::none) {
    const auto texture = [&](const std::string& name) {
      return TextureSpec{.file =
                             (folder / ((images == Images::flat ? "flat-" : "") + name)).string()};
    };
    material.base_color = {1, 1, 1};
    material.metallic = material.roughness = 1;
    material.color_texture = texture("color.png");
    material.metallic_roughness_texture = texture("rough.png");
    material.normal_texture = texture("normal.png");
  } else {
    material.base_color = {0.5f, 0.4f, 0.3f};
    material.metallic = 0.2f;
    material.roughness = 0.5f;
  }
  job.scene.meshes["sheet"] = {.path = (folder / "sheet.obj").string()};
  job.scene.objects = {{.mesh = "sheet", .material = "sheet"}};
  return job;
}

/// Nanoseconds of a pixel with a surface.
Result<double> measure(const RenderContext& context) {
  RenderStats total;
  const TileRunSink sink{[](Step, const FilmTile&) { return Status(); },
                         [](const SampleState&) { return Status(); }};
  for (std::int32_t tile = 0; tile < context.grid.count(); tile += kTileStep) {
    BATON_ASSIGN(const RenderStats stats,
                 run_tile(context, tile_run(context.job, tile, Run(0)), {}, sink, {}));
    total.merge(stats);
  }
  return total.cpu_seconds / static_cast<double>(total.pixels - total.pixels_background) * 1e9;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

Status compare(const JobSpec& light, const fs::path& folder, int frames, int turns) {
  fmt::print("{:>5} {:<26} {:>6} {:>6} {:>6} {:>6} {:>10}\n", "sites", "images", "ratio", "least",
             "most", "goal", "ns a pixel");
  for (const int sites : {1, 4}) {
    std::array<std::shared_ptr<const RenderContext>, 3> contexts;
    for (const Images images : {Images::none, Images::flat, Images::varied}) {
      JobSpec job = sheet_job(light, folder, images);
      job.image.sites = sites;
      job.frames.clear();
      for (int frame = 1; frame <= frames; ++frame) job.frames.emplace_back(frame);
      job.state.checkpoint_every = frames;
      BATON_ASSIGN(contexts[static_cast<std::size_t>(images)],
                   load_render_context(job, Digest{1, 1}));
    }
    std::array<std::vector<double>, 3> ratios, times;
    for (int turn = 0; turn < turns; ++turn) {
      for (std::size_t i = 0; i < contexts.size(); ++i) {
        BATON_ASSIGN(const double time, measure(*contexts[i]));
        times[i].push_back(time);
        ratios[i].push_back(time / times[0].back());
      }
    }
    constexpr std::array kNames{"none", "three of one colour", "three"};
    for (std::size_t i = 0; i < contexts.size(); ++i) {
      fmt::print("{:>5} {:<26} {:>6.3f} {:>6.3f} {:>6.3f} {:>6} {:>10.0f}\n", sites, kNames[i],
                 median(ratios[i]), *std::min_element(ratios[i].begin(), ratios[i].end()),
                 *std::max_element(ratios[i].begin(), ratios[i].end()),
                 i == 2 ? fmt::format("{:.1f}", kGoal) : "-", median(times[i]));
    }
    std::fflush(stdout);
  }
  return {};
}

int run(const std::string& path, int frames, int turns) {
  const Result<JobSpec> light = load_job(path);
  if (!light) {
    fmt::print(stderr, "{}\n", light.error().message);
    return 65;
  }
  const fs::path folder = fs::temp_directory_path() / fmt::format("baton_textures_{}", getpid());
  fs::create_directories(folder);
#if !defined(NDEBUG) || defined(BATON_CHECKED)
  fmt::print("note: assertions are on, the times are not the product's\n");
#endif
  fmt::print("1920 x 1080, pool, {} frames, {} turns, three textures of {} x {}, {}\n", frames,
             turns, kTexels, kTexels, instruction_set());
  Status done = make_files(folder);
  if (done) done = compare(*light, folder, frames, turns);
  fs::remove_all(folder);
  if (done) return 0;
  fmt::print(stderr, "{}\n", done.error().message);
  return 70;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  const auto count = [&](int i, int otherwise) {
    return argc > i ? std::max(1, std::atoi(argv[i])) : otherwise;
  };
  return baton::run(argc > 1 ? argv[1] : "jobs/examples/demo.json", count(2, 3), count(3, 3));
}

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/state/sample_planes.h"
#include "common/state/source_names.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kEssBins = 8;

struct StateOptions {
  std::vector<std::string> files;
  std::vector<int> pixel;  ///< empty, or x and y in the image
  bool json = false;
};

/// A state file and what its pixels add up to.
struct StateReport {
  SampleState state;
  std::vector<SectionInfo> sections;
  std::uint64_t file_bytes = 0;
  std::array<std::uint64_t, kSourceNames.size()> sources{};
  /// Pixels with a surface, by ESS / N in (0, 1].
  std::array<std::uint64_t, kEssBins> ess_histogram{};
};

/// (sum W)^2 / sum W^2 over the particles of pixel `pixel`; 0 when all weights are 0.
double pixel_ess(const SampleState& state, std::size_t pixel) {
  double squares = 0;
  const auto n = static_cast<std::size_t>(state.num_particles);
  for (const double weight : ConstSamplePlanes(state).weight.subspan(pixel * n, n))
    squares += weight * weight;
  return squares > 0 ? double{1} * state.num_populations * state.num_populations / squares : 0;
}

Result<StateReport> load_state(const std::string& file) {
  StateReport report;
  BATON_TRY(expect_file(file));
  BATON_ASSIGN(const Bytes bytes, read_file(file, limits::kMaxBlobBytes));
  BATON_ASSIGN(report.sections, state_sections(bytes, file));
  BATON_ASSIGN(report.state, decode_state(bytes, file));
  report.file_bytes = bytes.size();

  for (std::size_t pixel = 0; pixel < report.state.num_pixels(); ++pixel) {
    const PixelSource source =
        report.state.source[pixel * static_cast<std::size_t>(report.state.num_populations)];
    ++report.sources[static_cast<std::size_t>(source)];
    if (source == PixelSource::background || report.state.num_particles == 0) continue;
    const double ratio = pixel_ess(report.state, pixel) / report.state.num_particles;
    const auto bin = static_cast<std::size_t>(ratio * kEssBins);
    ++report.ess_histogram[std::min(bin, kEssBins - 1)];
  }
  return report;
}

double bytes_per_pixel(const StateReport& report) {
  return static_cast<double>(report.file_bytes) / static_cast<double>(report.state.num_pixels());
}

ordered_json report_json(const StateReport& report) {
  const SampleState& state = report.state;
  ordered_json sections = ordered_json::array();
  for (const SectionInfo& s : report.sections) {
    sections.push_back(
        {{"tag", tag_text(s.tag)}, {"storedBytes", s.stored_bytes}, {"rawBytes", s.raw_bytes}});
  }
  ordered_json sources = ordered_json::object();
  for (std::size_t i = 0; i < kSourceNames.size(); ++i)
    sources[std::string(kSourceNames[i])] = report.sources[i];
  return {{"picture", state.picture.hex()},
          {"frameIndex", state.step.value()},
          {"tile", state.tile},
          {"rect", {state.rect.x0, state.rect.y0, state.rect.x1, state.rect.y1}},
          {"numParticles", state.num_particles},
          {"fileBytes", report.file_bytes},
          {"bytesPerPixel", bytes_per_pixel(report)},
          {"sections", std::move(sections)},
          {"sources", std::move(sources)},
          {"essRatioHistogram", report.ess_histogram}};
}

void print_report(const StateReport& report) {
  const SampleState& state = report.state;
  const PixelRect& rect = state.rect;
  say("picture    {}\n", state.picture.hex());
  say("tile       {}, pixels [{}, {}) x [{}, {})\n", state.tile, rect.x0, rect.x1, rect.y0,
      rect.y1);
  say("frame      index {}\n", state.step);
  say("particles  {} a pixel\n", state.num_particles);
  say("size       {} bytes, {:.1f} a pixel\n", report.file_bytes, bytes_per_pixel(report));
  for (const SectionInfo& s : report.sections) {
    say("section    {} {:>10} bytes stored, {:>10} raw\n", tag_text(s.tag), s.stored_bytes,
        s.raw_bytes);
  }
  for (std::size_t i = 0; i < kSourceNames.size(); ++i) {
    say("source     {:<10} {:>8}  {:>6}\n", kSourceNames[i], report.sources[i],
        percent_text(report.sources[i], state.num_pixels()));
  }

  // A bar of 40 characters is all pixels with a surface.
  if (state.num_particles == 0) return;
  const std::uint64_t lit = state.num_pixels() - report.sources[0];
  for (std::size_t i = 0; i < kEssBins; ++i) {
    const std::uint64_t count = report.ess_histogram[i];
    say("ess / N    {:.3f}..{:.3f} {:>8}  {:>6} {}\n", double(i) / kEssBins,
        double(i + 1) / kEssBins, count, percent_text(count, lit),
        std::string(lit == 0 ? 0 : count * 40 / lit, '#'));
  }
}

/// One pixel's particles.
ordered_json pixel_json(const SampleState& state, std::int32_t x, std::int32_t y) {
  const auto pixel = static_cast<std::size_t>(std::int64_t{y - state.rect.y0} * state.rect.width() +
                                              x - state.rect.x0);
  const std::size_t row = pixel * static_cast<std::size_t>(state.num_populations);  // the first one
  ordered_json particles = ordered_json::array();
  const ConstSamplePlanes samples(state);
  const auto n = static_cast<std::size_t>(state.num_particles);
  for (std::size_t i = pixel * n; i < (pixel + 1) * n; ++i) {
    const Vec3 w = decode_octahedral(samples.direction[i]);
    particles.push_back(
        {{"direction", {w.x, w.y, w.z}}, {"weight", samples.weight[i]}, {"site", samples.site[i]}});
  }
  return {{"x", x},
          {"y", y},
          {"source", source_name(state.source[row])},
          {"lns", samples.lns[row]},
          {"lnsFresh", samples.lns_fresh[row]},
          {"ess", pixel_ess(state, pixel)},
          {"particles", std::move(particles)}};
}

void print_pixel(const ordered_json& pixel) {
  say("pixel      {}, {}: {}, Lns {}, Lns when fresh {}, ESS {:.2f}\n", pixel["x"].get<int>(),
      pixel["y"].get<int>(), pixel["source"].get<std::string>(), pixel["lns"].get<float>(),
      pixel["lnsFresh"].get<float>(), pixel["ess"].get<double>());
  for (const ordered_json& particle : pixel["particles"]) {
    const auto w = particle["direction"].get<std::vector<float>>();
    say("particle   weight {:.6f}  direction {:+.5f} {:+.5f} {:+.5f}  site {}\n",
        particle["weight"].get<float>(), w[0], w[1], w[2], particle["site"].get<int>());
  }
}

Result<ExitCode> show(const StateOptions& options) {
  BATON_ASSIGN(const StateReport report, load_state(options.files.front()));
  std::optional<ordered_json> pixel;
  if (!options.pixel.empty()) {
    const PixelRect& rect = report.state.rect;
    const int x = options.pixel[0];
    const int y = options.pixel[1];
    if (!rect.contains(x, y)) {
      return Error{ErrorKind::usage,
                   fmt::format("--pixel: expected x in [{}, {}) and y in [{}, {}), got {},{}",
                               rect.x0, rect.x1, rect.y0, rect.y1, x, y)};
    }
    pixel = pixel_json(report.state, x, y);
  }

  if (options.json) {
    ordered_json result = report_json(report);
    if (pixel) result["pixel"] = *pixel;
    fmt::print("{}\n", json_text(result, 2));
  } else {
    print_report(report);
    if (pixel) print_pixel(*pixel);
  }
  return ExitCode::ok;
}

/// Goes through all files, then tells of the bad ones.
Result<ExitCode> verify(const StateOptions& options) {
  std::string faults;
  for (const std::string& file : options.files) {
    const Result<StateReport> report = load_state(file);
    if (report) say("{}: ok, {:.1f} bytes a pixel\n", file, bytes_per_pixel(*report));
    if (!report) faults += (faults.empty() ? "" : "\n") + report.error().message;
  }
  if (!faults.empty()) return Error{ErrorKind::corrupt, faults};
  return ExitCode::ok;
}

}  // namespace

void add_state_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<StateOptions>();
  CLI::App* state = app.add_subcommand("state", "Looks into sample state files");
  state->require_subcommand(1);
  state->footer(
      "Examples, for the states that a job keeps in its work folder:\n"
      "  baton state show frames/.baton/store/ab/cdef.blob --pixel 12,40\n"
      "  baton state verify frames/.baton/store/*/*.blob");

  CLI::App* show_command = state->add_subcommand("show", "Sections, sizes, effective sample sizes");
  show_command->add_option("FILE", options->files, "state file")->required()->expected(1);
  show_command->add_option("--pixel", options->pixel, "x,y in the image: its particles too")
      ->delimiter(',')
      ->expected(2);
  show_command->add_flag("--json", options->json, "for machines");
  show_command->callback([options, &code] { code = finish(show(*options)); });

  CLI::App* verify_command = state->add_subcommand("verify", "Checks every byte of files");
  verify_command->add_option("FILE", options->files, "state files")->required();
  verify_command->callback([options, &code] { code = finish(verify(*options)); });
}

}  // namespace baton

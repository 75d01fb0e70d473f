#include "worker/run/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "common/image/image_io.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"
#include "common/scene/settle/settle_motion.h"
#include "common/state/sample_planes.h"
#include "common/state/source_names.h"
#include "worker/pass/render_context.h"
#include "worker/run/local_render.h"

namespace baton {
namespace {

Result<FrameIndex> find_frame(const JobSpec& job, FrameNumber number) {
  const auto found = std::lower_bound(job.frames.begin(), job.frames.end(), number);
  if (found == job.frames.end() || *found != number) {
    return Error{ErrorKind::usage,
                 fmt::format("--frame {}: the job has no such frame, its frames are {} to {}",
                             number, job.frames.front(), job.frames.back())};
  }
  return FrameIndex(static_cast<std::int32_t>(found - job.frames.begin()));
}

Status check_place(const JobSpec& job, const ReplayOptions& options) {
  const TileGrid grid(job.image);
  if (options.tile < 0 || options.tile >= grid.count()) {
    return Error{ErrorKind::usage, fmt::format("--tile {}: expected an integer in [0, {}]",
                                               options.tile, grid.count() - 1)};
  }
  const PixelRect rect = grid.rect(options.tile);
  if (options.pixel && !rect.contains(options.pixel->x, options.pixel->y)) {
    return Error{
        ErrorKind::usage,
        fmt::format("--pixel {},{}: tile {} has x in [{}, {}] and y in [{}, {}]", options.pixel->x,
                    options.pixel->y, options.tile, rect.x0, rect.x1 - 1, rect.y0, rect.y1 - 1)};
  }
  return {};
}

/// The tile as it is in a frame, after all that it depends on.
Result<RenderedTile> render(const JobSpec& job, Step step, std::int32_t tile) {
  BATON_ASSIGN(const std::string document, make_job_document(job));
  BATON_ASSIGN(const auto context, load_render_context(job, digest_of(document)));
  std::set<std::int32_t> wanted{tile};
  if (job.visibility.correlated) {
    const auto near = context->grid.tiles_near(tile, exchange_reach_px(job.visibility));
    wanted = {near.begin(), near.end()};
  }
  LocalRender render(*context);
  const std::vector<std::set<std::int32_t>> before = render.tiles_before(step, wanted);
  for (Step s; s < step; ++s) BATON_TRY(render.render_all(s, before[s.index()]));
  BATON_TRY(render.render_all(step, wanted));
  return render.finished(step, tile);
}

std::string describe_stats(const RenderStats& s) {
  const SamplingStats& did = s.sampling;
  return fmt::format(
      "pixels {} (background {}, fresh {}, carried {}, refreshed {}, restarted {}, resampled {})\n"
      "rays primary {}, shadow {}; target evaluations {}\n"
      "moves accepted: local {} of {}, independent {} of {}\n"
      "cpu {:.3f} s (light {:.3f}, primary {:.3f}, sample {:.3f}, visibility {:.3f}, shade "
      "{:.3f})\n",
      s.pixels, s.pixels_background, did.pixels_fresh, did.pixels_carried, did.pixels_refreshed,
      did.pixels_restarted, did.pixels_resampled, s.rays_primary, s.rays_shadow,
      s.target_evaluations, did.local_accepted, did.local_proposed, did.independent_accepted,
      did.independent_proposed, s.cpu_seconds, s.seconds_light, s.seconds_primary, s.seconds_sample,
      s.seconds_visibility, s.seconds_shade);
}

std::string describe_pixel(const RenderedTile& last, const PixelPosition& position) {
  const PixelRect& rect = last.film.rect;
  const auto pixel =
      static_cast<std::size_t>((position.y - rect.y0) * rect.width() + position.x - rect.x0);
  std::string text = fmt::format("pixel {},{}\n", position.x, position.y);
  const auto out = std::back_inserter(text);
  for (std::size_t channel = 0; channel < last.film.channels.size(); ++channel) {
    fmt::format_to(out, "  {:<14} {}\n", last.film.channels[channel],
                   last.film.plane(channel)[pixel]);
  }
  if (!last.state) return text;

  const SampleState& state = *last.state;
  const ConstSamplePlanes samples(state);
  const auto populations = static_cast<std::size_t>(state.num_populations);
  for (std::size_t row = pixel * populations; row < (pixel + 1) * populations; ++row) {
    fmt::format_to(out, "  state: {}, lns {}, lns when fresh {}\n", source_name(state.source[row]),
                   samples.lns[row], samples.lns_fresh[row]);
  }
  const auto num_particles = static_cast<std::size_t>(state.num_particles);
  for (std::size_t i = 0; i < num_particles; ++i) {
    const std::size_t particle = pixel * num_particles + i;
    const Vec3 w = decode_octahedral(samples.direction[particle]);
    fmt::format_to(out, "  particle {:2}: site {:2} weight {:.6f} direction {:.5f} {:.5f} {:.5f}\n",
                   i, samples.site[particle], samples.weight[particle], w.x, w.y, w.z);
  }
  return text;
}

}  // namespace

Result<std::string> replay_tile(const ReplayOptions& options) {
  BATON_ASSIGN(JobSpec written, load_job(options.job));
  BATON_ASSIGN(const JobSpec job, settle_motion(std::move(written)));
  BATON_ASSIGN(const FrameIndex frame, find_frame(job, FrameNumber(options.frame_number)));
  const Step step = Timeline(job).step_of(frame, Sweep(0));
  BATON_TRY(check_place(job, options));
  BATON_ASSIGN(const RenderedTile last, render(job, step, options.tile));

  // The tile becomes an image of its own.
  FilmTile picture = last.film;
  picture.rect = {0, 0, last.film.rect.width(), last.film.rect.height()};
  const std::filesystem::path out =
      options.out.empty() ? std::filesystem::path(fmt::format("tile{}.frame{:04}.exr", options.tile,
                                                              options.frame_number))
                          : options.out;
  BATON_TRY(write_exr(
      out, picture, {.half_float = false, .compression = job.output.compression, .metadata = {}}));

  std::string report = describe_stats(last.stats);
  if (options.pixel) report += describe_pixel(last, *options.pixel);
  return report + fmt::format("wrote {}\n", out.string());
}

std::string replay_command(const std::filesystem::path& job, FrameNumber frame, int tile) {
  return fmt::format("baton-worker replay '{}' --frame {} --tile {}", job.string(), frame, tile);
}

}  // namespace baton

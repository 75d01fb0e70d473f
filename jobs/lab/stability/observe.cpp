#include "jobs/lab/stability/observe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "common/image/noise.h"
#include "common/job/text/frame_range.h"
#include "jobs/lab/stability/parallel.h"
#include "tests/support/local_frames.h"
#include "worker/pass/render_context.h"

namespace baton::stability {
namespace {

std::span<const float> channel(const FilmTile& film, const std::string& name) {
  return {film.find(name), film.num_pixels()};
}

/// Mean of the values where `mask` is positive; 0 without any.
double masked_mean(std::span<const float> values, std::span<const float> mask) {
  double sum = 0;
  int count = 0;
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (!(mask[p] > 0)) continue;
    sum += values[p];
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

/// One rendering, frame by judged frame.
struct Run {
  std::vector<std::vector<float>> radiance, lns;
  std::vector<double> ess, acceptance;
  std::uint64_t unlawful = 0, negative = 0, pixels = 0;
  RenderStats stats;

  void resize(std::size_t num_frames) {
    radiance.resize(num_frames);
    lns.resize(num_frames);
    ess.resize(num_frames);
    acceptance.resize(num_frames);
  }
  void count_values(const FilmTile& film) {
    const auto finite = [](float v) { return std::isfinite(v); };
    unlawful += static_cast<std::uint64_t>(
        std::count_if(film.values.begin(), film.values.end(), std::not_fn(finite)));
    for (std::size_t p = 0; p < film.num_pixels(); ++p) {
      bool below = false;
      for (std::size_t c = 0; c < film.channels.size(); ++c)
        below |= film.channels[c] != kErrorChannel && film.plane(c)[p] < 0;
      negative += below ? 1 : 0;
    }
    pixels += film.num_pixels();
  }
  void keep(std::size_t slot, const FilmTile& film) {
    radiance[slot].resize(film.num_pixels());
    for (std::size_t p = 0; p < film.num_pixels(); ++p) {
      radiance[slot][p] = mean({film.plane(0)[p], film.plane(1)[p], film.plane(2)[p]});
    }
    const auto found = channel(film, "lns");
    lns[slot].assign(found.begin(), found.end());
    ess[slot] = masked_mean(channel(film, "ess"), channel(film, "A"));
    acceptance[slot] = masked_mean(channel(film, "acceptance"), channel(film, "A"));
  }
};

/// The lights of one rendering, shared by the subjects of one method, which lay out presampled
/// light alike: preparing them costs more than a tiny image does.
class SharedLights {
 public:
  /// Renders `job` with the lights of earlier jobs of the same rendering.
  Status render(const JobSpec& job, const std::vector<FrameNumber>& judged, const Subject& subject,
                Run& run) {
    BATON_ASSIGN(const auto loaded, load_render_context(job, Digest{1, 2}));
    auto& owner = owners_[{job.sampling.method, job.sampling.mis_compensation}];
    if (owner == nullptr) {
      BATON_ASSIGN(const auto first, load_render_context(job, Digest{1, 2}));
      owner = std::const_pointer_cast<RenderContext>(first);
    }
    const auto context = std::const_pointer_cast<RenderContext>(loaded);
    if (subject.method) context->method = subject.method(job);
    std::swap(context->lights, owner->lights);
    Status status = render_run(*context, judged, run);
    std::swap(context->lights, owner->lights);
    return status;
  }

 private:
  static Status render_run(const RenderContext& context, const std::vector<FrameNumber>& judged,
                           Run& run) {
    run.resize(judged.size());
    const test::FrameSink sink = [&](Step step, const FilmTile& film) {
      run.count_values(film);
      const FrameNumber number = context.job.frames[step.index()];
      const auto slot = std::lower_bound(judged.begin(), judged.end(), number);
      if (slot != judged.end() && *slot == number)
        run.keep(static_cast<std::size_t>(slot - judged.begin()), film);
      return Status();
    };
    BATON_ASSIGN(run.stats, test::render_locally(context, sink));
    return {};
  }

  /// Each with the job that its LightSequence refers to.
  std::map<std::pair<Method, bool>, std::shared_ptr<RenderContext>> owners_;
};

/// One seed with every subject. Methods that carry samples render every frame, the others only the
/// judged ones.
Status render_subjects(const JobSpec& job, const Timeline& time,
                       const std::vector<Subject>& subjects, std::vector<Run>& runs) {
  SharedLights lights;
  const std::vector<FrameNumber> judged = time.judged();
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    JobSpec own = job;
    subjects[s].configure(own);
    own.frames = judged;
    if (carries_state(own)) {
      own.frames = parse_frames(fmt::format("1-{}", time.frames)).value();
    }
    BATON_TRY(lights.render(own, judged, subjects[s], runs[s]));
  }
  return {};
}

/// Adds a rendering to a subject's observations.
void merge(Run run, Observations& out) {
  out.unlawful += run.unlawful;
  out.negative += run.negative;
  out.pixels += run.pixels;
  out.stats.merge(run.stats);
  out.radiance.resize(run.radiance.size());
  out.lns.resize(run.lns.size());
  out.ess.resize(run.ess.size());
  out.acceptance.resize(run.acceptance.size());
  for (std::size_t f = 0; f < run.lns.size(); ++f) {
    out.radiance[f].push_back(std::move(run.radiance[f]));
    out.lns[f].push_back(std::move(run.lns[f]));
    out.ess[f] += run.ess[f];
    out.acceptance[f] += run.acceptance[f];
  }
}

}  // namespace

Result<std::vector<Observations>> observe(const JobSpec& job, const Timeline& time,
                                          const std::vector<Subject>& subjects, int runs,
                                          int threads) {
  // Render side by side, seed by seed.
  std::vector<std::vector<Run>> all(static_cast<std::size_t>(runs),
                                    std::vector<Run>(subjects.size()));
  std::vector<Status> status(all.size());
  parallel_for(all.size(), threads, [&](std::size_t r) {
    JobSpec seeded = job;
    seeded.seed = r + 1;
    status[r] = render_subjects(seeded, time, subjects, all[r]);
  });

  // Put them together in the order of the seeds.
  std::vector<Observations> out(subjects.size());
  for (std::size_t r = 0; r < all.size(); ++r) {
    BATON_TRY(status[r]);
    for (std::size_t s = 0; s < subjects.size(); ++s) merge(std::move(all[r][s]), out[s]);
  }
  for (Observations& o : out) {
    for (double& ess : o.ess) ess /= runs;
    for (double& acceptance : o.acceptance) acceptance /= runs;
  }
  return out;
}

}  // namespace baton::stability

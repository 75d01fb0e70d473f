// Tests of the suite itself: what is wrong on purpose must be seen by the machinery that judges the
// product.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/limits.h"
#include "jobs/lab/stability/grid.h"
#include "jobs/lab/stability/maps.h"
#include "jobs/lab/stability/truth.h"
#include "tests/support/local_frames.h"
#include "tests/support/small_scene.h"
#include "worker/method/sequential/sequential_kernels.h"
#include "worker/method/weighted/weighted_sampler.h"

namespace baton::stability {
namespace {

/// The drift of carried samples needs many frames to show, and many runs to be told from chance.
constexpr Effort kLongEffort{40, 24, false};
/// A loss of 13 % +- 2 % where it is looked for.
constexpr Effort kLongestEffort{60, 48, false};
constexpr Effort kShortEffort{8, 12, false};
constexpr int kThreads = 2;

/// The smooth window of other_map turns over boxes.
Case turning_case() {
  return {
      .name = "machinery",
      .text = "",
      .build =
          [](const Stage& stage, const Timeline&) {
            JobSpec job = stage.boxes(other_map());
            job.environment.rotation_deg_per_frame = 1;
            return job;
          },
      .laws = {
          {Measure::unlawful, 0, 0}, {Measure::bias, 0.01, 0.05}, {Measure::lns_bias, 0.01, 0.05}}};
}

Subject fresh_subject() {
  return {kFreshSubject, [](JobSpec& job) { job.sampling.method = Method::bidirectional; }};
}

/// The second of two subjects, judged.
Cell judged(const Case& c, const Subject& subject, const Effort& effort) {
  const auto cells = run_case(c, {fresh_subject(), subject}, effort, test::test_folder(), kThreads);
  EXPECT_TRUE(cells.ok());
  return cells->back();
}

/// A sequential sampler whose number of distributions depends on how well its own particles do: it
/// takes one distribution and, where their ESS is low, starts the frame again with five. Large
/// estimates come with a low ESS, so the choice throws large estimates away.
class SelfAdaptedSampler final : public WeightedSampler {
 public:
  SelfAdaptedSampler(const JobSpec& job, float ess_ratio_min)
      : WeightedSampler(job), ess_ratio_min_(ess_ratio_min) {
    SamplingSpec spec = job.sampling;
    spec.method = Method::bidirectional;
    start_ = make_fresh_sampler(spec);
  }

 private:
  PixelDiagnostics draw(const PixelInput& input, const SetPlace& /*at*/,
                        const PixelSamples& samples) override {
    if (!input.start.has_history) return start_->sample(input, samples);
    const auto count = samples.weight.size();
    for (const int distributions : {1, 5}) {
      Particles p;
      std::copy(samples.direction.begin(), samples.direction.end(), p.direction.begin());
      std::copy(samples.site.begin(), samples.site.end(), p.site.begin());
      std::copy(samples.weight.begin(), samples.weight.end(), p.weight.begin());
      const SequentialSettings settings{.num_particles = static_cast<int>(count),
                                        .num_distributions = distributions,
                                        .local_move_cosine = std::cos(4 * kPi / 180)};
      const SequentialOutcome outcome =
          kernels::sequential_step(input.sites, input.start.old, carried_light(input), nullptr,
                                   settings, samples.lns, input.key,
                                   {p.direction.data(), p.site.data(), p.weight.data(),
                                    samples.r.data(), samples.g.data(), samples.b.data()});
      if (!outcome.alive) break;
      if (distributions == 1 && outcome.ess < ess_ratio_min_ * static_cast<float>(count)) continue;
      std::copy_n(p.direction.begin(), count, samples.direction.begin());
      std::copy_n(p.site.begin(), count, samples.site.begin());
      std::copy_n(p.weight.begin(), count, samples.weight.begin());
      samples.lns = outcome.lns;
      samples.source = PixelSource::carried;
      return {.ess = outcome.ess};
    }
    return start_->sample(input, samples);
  }

  struct Particles {
    std::array<OctDirection, limits::kMaxParticles> direction{};
    std::array<std::uint8_t, limits::kMaxParticles> site{};
    std::array<float, limits::kMaxParticles> weight{};
  };
  float ess_ratio_min_;
  std::unique_ptr<FreshSampler> start_;
};

Subject self_adapted(float ess_ratio_min) {
  return {"planted", [](JobSpec& job) { job.sampling.method = Method::sequential; },
          [ess_ratio_min](const JobSpec& job) {
            return PixelMethod{&sample_format(), [job, ess_ratio_min] {
                                 return std::make_unique<SelfAdaptedSampler>(job, ess_ratio_min);
                               }};
          }};
}

TEST(Machinery, SeesAScheduleThatIsAdaptedOnItsOwnParticles) {
  const Cell cell = judged(turning_case(), self_adapted(0.8f), kLongestEffort);
  const Numbers& n = cell.summary.numbers;
  std::printf("  adapted: %s, mean Lns^/Lns %.3f +- %.3f\n", cell.judgement.number.c_str(),
              n.lns_mean, n.lns_mean_interval);
  EXPECT_NE(cell.judgement.verdict, Verdict::holds);
  EXPECT_LT(n.lns_mean + n.lns_mean_interval, 1);
}
TEST(Machinery, AcceptsBothOfItsSchedulesWhenTheyAreFixed) {
  for (const float ess_ratio_min : {0.0f, 2.0f}) {
    const Cell cell = judged(turning_case(), self_adapted(ess_ratio_min), kLongEffort);
    const Numbers& n = cell.summary.numbers;
    std::printf("  fixed: mean Lns^/Lns %.3f +- %.3f\n", n.lns_mean, n.lns_mean_interval);
    EXPECT_EQ(cell.judgement.verdict, Verdict::holds) << cell.judgement.number;
  }
}

TEST(Machinery, SeesAGroundThatReflectsTooMuch) {
  const Subject wrong{"planted", [](JobSpec& job) {
                        job.sampling.method = Method::bidirectional;
                        job.scene.materials["ground"].base_color = Rgb{0.5f, 0.5f, 0.5f} * 1.05f;
                      }};
  EXPECT_NE(judged(turning_case(), wrong, kShortEffort).judgement.verdict, Verdict::holds);
  EXPECT_EQ(judged(turning_case(), fresh_subject(), kShortEffort).judgement.verdict,
            Verdict::holds);
}

/// A second pass after so few samples that its mask often misses a pixel; many independent frames
/// of a light that stands still.
JobSpec second_pass_job(MaskPolicy mask) {
  JobSpec job = Stage(test::test_folder()).boxes(other_map());
  job.sampling.method = Method::bidirectional;
  job.sampling.num_particles = 4;
  job.visibility = {.correlated = true, .mask = mask};
  job.state.carry = false;
  job.frames = test::frame_numbers(2500);
  return job;
}

/// Two-sided limit of |z| at level 1e-3 over 64 pixels [Sidak]; 2500 frames are normal enough.
constexpr double kPixelLimit = 4.32;

/// What the frames say of one pixel against the exact answer.
struct PixelVerdict {
  double worst_z = 0;
  double bias = 0;  ///< relative, where |z| is largest
  /// The middle pixel's smallest relative bias that reaches the limit.
  double resolution = 0;
};

/// z-test of every pixel's mean over frames; frames are independent, so no pixel's test depends on
/// how pixels correlate.
PixelVerdict judge_pixels(const JobSpec& job) {
  JobSpec one = job;
  one.frames = {FrameNumber(1)};
  const auto truth = exact_truth(one, 8, 1);
  const auto context = load_render_context(job, Digest{1, 2});
  EXPECT_TRUE(truth.ok() && context.ok());
  const std::vector<double>& expected = truth->frames[0].radiance;
  std::vector<std::vector<double>> seen(job.frames.size(), std::vector<double>(expected.size()));
  const test::FrameSink sink = [&](Step step, const FilmTile& film) {
    for (std::size_t p = 0; p < expected.size(); ++p) {
      seen[step.index()][p] = mean({film.plane(0)[p], film.plane(1)[p], film.plane(2)[p]});
    }
    return Status();
  };
  EXPECT_TRUE(test::render_locally(**context, sink).ok());

  PixelVerdict verdict;
  std::vector<double> resolution;
  const auto n = static_cast<double>(seen.size());
  for (std::size_t p = 0; p < expected.size(); ++p) {
    double sum = 0;
    double squares = 0;
    for (const std::vector<double>& frame : seen) {
      sum += frame[p];
      squares += frame[p] * frame[p];
    }
    const double m = sum / n;
    const double variance = std::max(squares / n - m * m, 0.0) / (n - 1);
    const double error = std::sqrt(variance + std::pow(truth->quadrature_error * m, 2));
    resolution.push_back(kPixelLimit * error / expected[p]);
    const double z = (m - expected[p]) / error;
    if (std::fabs(z) <= std::fabs(verdict.worst_z)) continue;
    verdict.worst_z = z;
    verdict.bias = m / expected[p] - 1;
  }
  std::nth_element(resolution.begin(), resolution.begin() + 32, resolution.end());
  verdict.resolution = resolution[32];
  std::printf("  worst z %+.1f, bias there %+.2f %%, resolves %.2f %%, quadrature %.3f %%\n",
              verdict.worst_z, 100 * verdict.bias, 100 * verdict.resolution,
              100 * truth->quadrature_error);
  return verdict;
}

// Kirk & Arvo 1991: the second pass moves energy between pixels, so a mask that is made of the
// samples that it then moves shows in single pixels, not in the mean.
TEST(Machinery, SeesAMaskThatIsMadeOfTheSamplesItDecidesAbout) {
  const PixelVerdict v = judge_pixels(second_pass_job(MaskPolicy::same_samples));
  EXPECT_GT(std::fabs(v.worst_z), kPixelLimit);
}
TEST(Machinery, AcceptsAMaskOfOtherSamples) {
  for (const MaskPolicy mask : {MaskPolicy::cross_fold, MaskPolicy::split}) {
    const PixelVerdict v = judge_pixels(second_pass_job(mask));
    EXPECT_LT(std::fabs(v.worst_z), kPixelLimit);
    EXPECT_LT(v.resolution, 0.03);
  }
}

// Brute force and the exact sum share only the ray tracer and the scalar materials.
TEST(Machinery, ExactAnswerOfAWhiteFurnaceIsTheAlbedo) {
  RgbImage white = black_map();
  for (float& value : white.rgb) value = 1;
  JobSpec job = Stage(test::test_folder()).plain(white);
  const auto truth = exact_truth(job, 4, 1);
  ASSERT_TRUE(truth.ok());
  for (const double lns : truth->frames[0].lns) EXPECT_NEAR(lns, 0.5, 1e-3);
  EXPECT_EQ(truth->frames[0].lns, truth->frames[0].radiance);
}

TEST(Laws, JudgeByTheWorstLawAndNameIt) {
  const std::vector<Law> laws{
      {Measure::unlawful, 0, 0}, {Measure::lns_median, 0.1, 0.3}, {Measure::noise, 2, 5}};
  const Numbers fresh{.noise = 0.1};
  EXPECT_EQ(judge(laws, {.lns_median = 0.95, .noise = 0.15}, fresh).verdict, Verdict::holds);
  EXPECT_EQ(judge(laws, {.lns_median = 1.2, .noise = 0.15}, fresh).verdict, Verdict::degrades);
  const Judgement noisy = judge(laws, {.lns_median = 1.2, .noise = 0.6}, fresh);
  EXPECT_EQ(noisy.verdict, Verdict::fails);
  EXPECT_EQ(noisy.number, "noise x6.0");
  EXPECT_EQ(judge(laws, {.unlawful = 1, .noise = 0.1}, fresh).verdict, Verdict::fails);
  const Judgement dark = judge({{Measure::negative, 1e-4, 1e-2}}, {.negative = 2e-4}, fresh);
  EXPECT_EQ(dark.verdict, Verdict::degrades);
  EXPECT_EQ(dark.number, "0.02 % of pixels negative");
  EXPECT_EQ(judge(laws, {.noise = std::numeric_limits<double>::quiet_NaN()}, fresh).verdict,
            Verdict::fails);
}

TEST(Laws, ABiasInsideItsIntervalIsNone) {
  const std::vector<Law> laws{{Measure::bias, 0.01, 0.05}};
  EXPECT_EQ(judge(laws, {.bias = 0.2, .bias_interval = 0.3}, {}).verdict, Verdict::holds);
  EXPECT_EQ(judge(laws, {.bias = -0.05, .bias_interval = 0.02}, {}).verdict, Verdict::degrades);
  EXPECT_EQ(judge(laws, {.bias = -0.2, .bias_interval = 0.02}, {}).verdict, Verdict::fails);
}

// Student's t tables: 9 degrees of freedom.
TEST(Laws, StudentLimitAgreesWithTheTables) {
  EXPECT_NEAR(student_limit(9, 0.05), 2.262, 1e-3);
  EXPECT_NEAR(student_limit(9, 0.001), 4.781, 1e-3);
}

TEST(Expectations, AChangeIsSeenBothWaysButNotOnTheEdge) {
  Cell cell{.case_name = "c", .subject = "s", .judgement = {}, .summary = {}};
  cell.judgement = judge({{Measure::lost, 0.01, 0.1}}, {.lost = 0.05}, {});
  EXPECT_EQ(change(cell, "degrades"), "");
  EXPECT_NE(change(cell, "holds"), "");
  EXPECT_NE(change(cell, "fails"), "");
  EXPECT_EQ(change(cell, ""), "");
  cell.judgement = judge({{Measure::lost, 0.01, 0.1}}, {.lost = 0.095}, {});
  EXPECT_EQ(change(cell, "fails"), "");
}

TEST(Expectations, SurviveAFileAndNameABadLine) {
  const auto path = test::test_folder() / "expected.csv";
  Expectations table;
  Cell cell{.case_name = "c", .subject = "s", .judgement = {}, .summary = {}};
  cell.judgement.verdict = Verdict::fails;
  table.record(cell, false);
  ASSERT_TRUE(table.write(path).ok());
  const auto back = Expectations::read(path);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->find(cell, false), "fails");
  EXPECT_EQ(back->find(cell, true), "");
  std::ofstream(path) << "case,s\nc,perhaps\n";
  const auto bad = Expectations::read(path);
  ASSERT_FALSE(bad.ok());
  EXPECT_NE(bad.error().message.find("expected.csv:2"), std::string::npos);
}

}  // namespace
}  // namespace baton::stability

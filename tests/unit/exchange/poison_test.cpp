// Nobody reads what nobody wrote: small jobs are rendered with all work space filled with one
// pattern and with another, and must come out the same.
#include "common/base/poison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "common/job/motion.h"
#include "common/job/text/job_json.h"
#include "tests/support/render_tiled.h"
#include "tests/support/second_pass.h"

namespace baton {
namespace {

constexpr int kSites[] = {1, 4, 9, 16};

/// The jobs use one thread, where the thread sanitizer has nothing to find, and takes half an hour.
#ifdef __SANITIZE_THREAD__
constexpr int kOneOf = 16;
#else
constexpr int kOneOf = 1;
#endif

class Poison : public testing::Test {
 protected:
  /// (Only checked builds fill work space; in others there is nothing to find.)
  void TearDown() override { set_poison(0); }

  /// box_job, small.
  static JobSpec small_job(Method method, int num_particles, int sites) {
    JobSpec job = test::sequence_job(traits(method).carries() ? 3 : 1);
    job.image = {.width = 8, .height = 6, .sites = sites, .tile_size = 4096};
    job.sampling.method = method;
    job.sampling.num_particles = num_particles;
    job.sampling.num_candidates = 48;
    job.sampling.refresh_candidates = 64;
    return job;
  }

  void expect_written(const JobSpec& job) {
    if (num_jobs_++ % kOneOf != 0) return;
    // NaN as a float and far outside as an index; a plain number, and as far outside.
    const Outcome a = render(job, 0xFFC1FFC1u), b = render(job, 0x42F642F6u);
    const auto equal = [&] {
      return a.first_pass.films == b.first_pass.films && a.first_pass.state == b.first_pass.state &&
             a.first_pass.samples == b.first_pass.samples && a.second_pass == b.second_pass;
    };
    ASSERT_FALSE(a.first_pass.films.empty());
    ASSERT_TRUE(equal()) << to_json(job);
  }

 private:
  struct Outcome {
    test::TileResult first_pass;
    FilmTile second_pass;
  };
  static Outcome render(const JobSpec& job, std::uint32_t pattern) {
    set_poison(pattern);
    Outcome outcome{test::render_tile(job), {}};
    if (job.visibility.correlated) outcome.second_pass = test::render_correlated(job).film;
    return outcome;
  }

  int num_jobs_ = 0;
};

TEST_F(Poison, FreshSamplesOfAnyNumber) {
  for (const Method method : {Method::environment, Method::brdf, Method::mis}) {
    for (int n = 1; n <= 18; ++n) {
      for (const int sites : kSites) expect_written(small_job(method, n, sites));
    }
  }
}

// Candidates of every remainder beside samples of every remainder, at rest and in motion.
TEST_F(Poison, ChosenAndCarriedSamplesOfAnyNumber) {
  for (const Method method :
       {Method::bidirectional, Method::sequential, Method::pool, Method::ratio, Method::restir}) {
    for (int n = 1; n <= 16; ++n) {
      for (int more = 0; more < 8; ++more) {
        const int i = n + more;
        JobSpec job = small_job(method, n, kSites[i % 4]);
        job.sampling.num_candidates = 40 + more;
        job.sampling.num_distributions = i % 3 == 0 ? 1 : 3;
        job.sampling.lns_update = i % 5 == 0 ? LnsUpdate::path_trapezoid : LnsUpdate::ratio;
        job.sampling.refresh_every = more % 4;
        job.sampling.num_neighbors = n % 3;
        if (more >= 4) test::set_in_motion(job, /*camera=*/more >= 5, /*object=*/more != 5);
        expect_written(job);
      }
    }
  }
}

TEST_F(Poison, PopulationsOfAnyNumberAndTheSecondPass) {
  for (const Method method : {Method::environment, Method::brdf, Method::mis, Method::bidirectional,
                              Method::sequential}) {
    for (const MaskPolicy mask :
         {MaskPolicy::same_samples, MaskPolicy::split, MaskPolicy::cross_fold}) {
      for (const int n : {2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 24, 34, 40}) {
        JobSpec job = small_job(method, n, kSites[n / 2 % 4]);
        job.visibility = {.correlated = true,
                          .form = static_cast<SecondPassForm>((n / 2 + static_cast<int>(mask)) % 4),
                          .mask = mask,
                          .partitions = 1 + n % 7};
        expect_written(job);
      }
    }
  }
}

TEST_F(Poison, MaterialsWithNumbersOfTheirOwn) {
  constexpr Method kDrawAnew[] = {Method::environment, Method::brdf, Method::mis,
                                  Method::bidirectional};
  for (int i = 0; i < 64; ++i) {
    JobSpec job = small_job(Method::mis, 1 + i % 16, kSites[i % 4]);
    const auto own = [&](int k) {
      return MaterialSampling{.method = kDrawAnew[(i + k) % 4],
                              .num_particles = 1 + (5 * i + 7 * k) % 19,
                              .num_candidates = 32 + (3 * i + k) % 8};
    };
    job.sampling.by_material = {{"glossy", own(0)}, {"metal", own(1)}};
    expect_written(job);
  }
}

}  // namespace
}  // namespace baton

#include <gtest/gtest.h>
#include <malloc.h>

#include "tests/support/render_tiled.h"

namespace baton {
namespace {

// malloc fills what it hands out with the complement of the byte.
struct FilledMemory {
  explicit FilledMemory(int byte) { mallopt(M_PERTURB, byte); }
  ~FilledMemory() { mallopt(M_PERTURB, 0); }
};

TEST(Populations, OfAnyNumberOfParticlesIgnoreWhatMemoryHeld) {
  for (int n = 2; n <= 40; n += 2) {
    JobSpec job = test::sequence_job(3);
    job.visibility.correlated = true;
    job.sampling.method = Method::sequential;
    job.sampling.num_particles = n;
    const auto render_over = [&](int byte) {
      const FilledMemory filled(byte);
      return test::render_tile(job).films;
    };
    ASSERT_EQ(render_over(0xFF), render_over(0x80)) << n;
  }
}

}  // namespace
}  // namespace baton

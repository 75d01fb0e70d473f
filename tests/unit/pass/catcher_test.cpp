// A ground and objects that catch shadows and are in no picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/image/shadow.h"
#include "tests/support/catcher_jobs.h"

namespace baton {
namespace {

using test::channel;
using test::render_tile;
using test::render_tiled;
using test::sequence_job;

JobSpec catcher_job(Method method, int frames) {
  JobSpec job = sequence_job(frames);
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.quality.rounds = 2;
  job.scene.ground->catcher = true;
  job.image.site_seed = 99;  // jobs of other seeds see the same points
  job.output.background = Background::transparent;
  job.output.aovs = {Aov::normal, Aov::depth, Aov::object, Aov::variance};
  return job;
}

/// The last film as frames have it.
FilmTile finished(const JobSpec& job) {
  FilmTile film = render_tile(job).films.back();
  finish_shadows(film);
  return film;
}

TEST(Catcher, SameBytesForAnyTiling) {
  for (const bool moves : {false, true}) {
    JobSpec job = catcher_job(Method::pool, 3);
    if (moves) test::set_in_motion(job, true, true);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 1), whole);
    EXPECT_EQ(render_tiled(job, 8, 2, test::keeping_nothing()), whole);
  }
}

TEST(Catcher, OfObjectsHasTheSameBytesForAnyTiling) {
  for (const Method method : {Method::pool, Method::sequential, Method::restir}) {
    JobSpec job = test::ball_job(method, 3);
    for (const bool moves : {false, true}) {
      if (moves) test::set_all_in_motion(job);
      const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
      EXPECT_EQ(render_tiled(job, 5, 1), whole);
      EXPECT_EQ(render_tiled(job, 8, 2, test::keeping_nothing()), whole);
    }
  }
}

/// All that frames without catchers have, with and without them.
void expect_same(const JobSpec& with_catcher, const JobSpec& without_catcher) {
  const std::vector<FilmTile> with = render_tile(with_catcher).films;
  const std::vector<FilmTile> without = render_tile(without_catcher).films;
  for (std::size_t f = 0; f < with.size(); ++f) {
    for (const std::string& name : without[f].channels) {
      if (name == "error") continue;  // of the pixels of the ground there is one less
      const auto a = channel(with[f], name), b = channel(without[f], name);
      EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin())) << name << " of frame " << f;
    }
  }
}

// It hides nothing, casts nothing and lights nothing: all else is as if it were not there.
TEST(Catcher, ObjectsHaveTheSameBytesWithoutIt) {
  for (const Background background : {Background::transparent, Background::environment}) {
    JobSpec job = catcher_job(Method::pool, 2);
    job.output.background = background;
    JobSpec without = job;
    without.scene.ground.reset();
    expect_same(job, without);
  }
}

TEST(Catcher, ObjectsHaveTheSameBytesWithoutOneOfObjects) {
  for (const Method method : {Method::pool, Method::sequential, Method::restir}) {
    // At rest; with a camera and light that stay, where pixels at edges see the ball pass; all.
    for (const int motion : {0, 1, 2}) {
      JobSpec job = test::ball_job(method, 3);
      if (motion == 1) job.environment.rotation_deg_per_frame = 0;
      if (motion > 0) test::set_all_in_motion(job, motion == 2);
      JobSpec without = job;
      without.scene.objects.pop_back();
      without.scene.meshes.erase("ball");
      expect_same(job, without);
    }
  }
}

// The nearest one is seen, from either side, and what it hides of another is lost.
TEST(Catcher, HidesOthersOnly) {
  JobSpec job = test::ball_job(Method::pool, 1);
  const FilmTile one = finished(job);
  JobSpec two = job;
  two.scene.objects.push_back(two.scene.objects.back());
  two.scene.objects.back().translate.y -= 0.1f;
  two.scene.objects.back().scale = {2, 1.7f, 1.7f};  // within the first one
  EXPECT_EQ(finished(two), one);
}

/// Means over seeds of shadow.G in every pixel, and their standard errors.
struct Means {
  std::vector<double> mean, error;
};
Means means_of(JobSpec job, const std::string& name) {
  constexpr int kSeeds = 24;
  Means means;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    job.seed = static_cast<std::uint64_t>(seed);
    const FilmTile film = finished(job);
    const auto values = channel(film, name);
    means.mean.resize(values.size());
    means.error.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      means.mean[i] += double{values[i]} / kSeeds;
      means.error[i] += double{values[i]} * double{values[i]} / kSeeds;
    }
  }
  for (std::size_t i = 0; i < means.mean.size(); ++i) {
    const double variance = means.error[i] - means.mean[i] * means.mean[i];
    means.error[i] = std::sqrt(std::max(variance, 0.0) / (kSeeds - 1));
  }
  return means;
}

// S / U beside brute force: a white ground with black objects over the same without. Hypothesis:
// equal means in every pixel that sees the ground alone; |z| < 5 in some 60 pixels, 24 seeds.
TEST(Catcher, ShadowsAreTheShareOfTheLightThatArrives) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::mis}) {
    JobSpec job = catcher_job(method, 1);
    job.quality.rounds = 8;
    const Means shadow = means_of(job, "shadow.G");
    JobSpec white = job;
    white.scene.ground->catcher = false;
    white.scene.materials["ground"].base_color = {1, 1, 1};
    const Means arrives = means_of(white, "G");
    const FilmTile ground = render_tile(white).films.back(), film = render_tile(job).films.back();
    white.scene.objects.clear();
    const Means whole = means_of(white, "G");
    int num_compared = 0, num_shaded = 0;
    for (std::size_t i = 0; i < shadow.mean.size(); ++i) {
      // The third object is the ground; a pixel with alpha sees a box, too.
      if (channel(ground, "object")[i] != 3 || channel(film, "A")[i] > 0) continue;
      ++num_compared;
      const double expected = arrives.mean[i] / whole.mean[i];
      const double relative =
          std::hypot(arrives.error[i] / arrives.mean[i], whole.error[i] / whole.mean[i]) * expected;
      EXPECT_NEAR(shadow.mean[i], expected, 5 * std::hypot(shadow.error[i], relative) + 2e-3)
          << static_cast<int>(method) << " pixel " << i;
      num_shaded += expected < 0.9 ? 1 : 0;
    }
    EXPECT_GT(num_compared, 25);
    EXPECT_GT(num_shaded, 5);
  }
}

// Where no light of a colour arrives, none is taken away; elsewhere as ever.
TEST(Catcher, ADarkColourTakesNothingAway) {
  JobSpec job = catcher_job(Method::pool, 1);
  RgbImage red = test::sky_map();
  for (std::size_t i = 0; i < red.rgb.size(); i += 3) red.rgb[i + 1] = red.rgb[i + 2] = 0;
  job.environment.keys = {{.frame = 1, .map = test::write_map("red.exr", red)}};
  const FilmTile film = finished(job);
  EXPECT_TRUE(std::ranges::all_of(channel(film, "shadow.G"), [](float s) { return s == 1; }));
  EXPECT_TRUE(std::ranges::any_of(channel(film, "shadow.R"), [](float s) { return s < 0.8f; }));
}

/// RGB + (1 - A) plate shadow of a job, with a plate that is the empty ground, beside the picture
/// with a real ground. Hypothesis: equal means; |z| < 5 in every pixel without sky and without what
/// `left_out` shows, 24 seeds. Returns how many of them are at edges.
int expect_picture_above_plate(JobSpec job, const FilmTile* left_out = nullptr) {
  const Means objects = means_of(job, "G"), shadow = means_of(job, "shadow.G");
  const FilmTile film = render_tile(job).films.back();
  job.scene.ground->catcher = false;
  const Means expected = means_of(job, "G");
  job.scene.objects.clear();
  const FilmTile whole = render_tile(job).films.back();
  const Means plate = means_of(job, "G");
  int num_edges = 0;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    if (channel(whole, "A")[i] < 1) continue;  // sees the sky, which the plate lacks
    if (left_out != nullptr && channel(*left_out, "A")[i] > 0) continue;
    const double a = double{channel(film, "A")[i]};
    num_edges += a > 0 && a < 1 ? 1 : 0;
    const double ground = (1 - a) * plate.mean[i];
    const double over = objects.mean[i] + ground * shadow.mean[i];
    const double error = std::hypot(objects.error[i], expected.error[i], ground * shadow.error[i]) +
                         (1 - a) * plate.error[i];
    EXPECT_NEAR(over, expected.mean[i], 5 * error + 2e-3 * expected.mean[i]) << "pixel " << i;
  }
  return num_edges;
}

TEST(Catcher, AboveItsPlateItIsThePicture) {
  JobSpec job = catcher_job(Method::pool, 1);
  // Black: a real ground keeps light from below from them.
  for (const char* const name : {"glossy", "metal"})
    job.scene.materials[name] = {.kind = MaterialKind::diffuse, .base_color = {0, 0, 0}};
  job.quality = {.rounds = 1, .sweeps = 8};  // at edges, some miss the ground, and some the box
  EXPECT_GT(expect_picture_above_plate(job), 5);
}

/// A white box and a black one beside each other, under a sky that is black below the horizon: what
/// a real ground keeps from them.
JobSpec lit_by_objects(int bounces) {
  JobSpec job = catcher_job(Method::pool, 1);
  job.scene.materials["glossy"] = {.kind = MaterialKind::diffuse, .base_color = {0.9f, 0.9f, 0.9f}};
  job.scene.materials["metal"] = {.kind = MaterialKind::diffuse, .base_color = {0, 0, 0}};
  RgbImage sky = test::sky_map();
  std::fill(sky.rgb.begin() + static_cast<std::ptrdiff_t>(sky.rgb.size() / 2), sky.rgb.end(), 0.0f);
  job.environment.keys = {{.frame = 1, .map = test::write_map("upper.exr", sky)}};
  job.quality = {.rounds = 4, .sweeps = 4};
  job.light = {.bounces = bounces, .filter_glossy = false};
  return job;
}

// What the white box reflects to the ground is in the plate's shadows, at the black box's edges,
// too.
TEST(Catcher, ReceivesWhatObjectsReflect) {
  const JobSpec job = lit_by_objects(1);
  JobSpec white = job;
  std::erase_if(white.scene.objects, [](const auto& object) { return object.material == "metal"; });
  const FilmTile box = render_tile(white).films.back();
  EXPECT_GT(expect_picture_above_plate(job, &box), 2);
  const Means shadow = means_of(job, "shadow.G"), without = means_of(lit_by_objects(0), "shadow.G");
  int num_lit = 0;
  for (std::size_t i = 0; i < shadow.mean.size(); ++i)
    num_lit += shadow.mean[i] - without.mean[i] > 0.03 ? 1 : 0;
  EXPECT_GT(num_lit, 5);
}

// Objects are as without what catches their light.
TEST(Catcher, ObjectsHaveTheSameBytesWithLightBetweenSurfaces) {
  for (const Method method : {Method::pool, Method::sequential}) {
    JobSpec job = test::ball_job(method, 2);
    job.light.bounces = 2;
    JobSpec without = job;
    without.scene.objects.pop_back();
    without.scene.meshes.erase("ball");
    expect_same(job, without);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 8, 2, test::keeping_nothing()), whole);
  }
  JobSpec job = lit_by_objects(2);
  job.scene.materials["metal"] = job.scene.materials["glossy"];
  // The camera sees the sides with which they face each other.
  job.scene.objects[0].rotate_deg = {0, -40, 0};
  job.scene.objects[1].rotate_deg = {0, 40, 0};
  JobSpec without = job;
  without.scene.ground.reset();
  expect_same(job, without);
}

}  // namespace
}  // namespace baton

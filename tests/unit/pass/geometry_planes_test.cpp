// AOVs of what sites see.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "common/image/cryptomatte.h"
#include "common/job/aov.h"
#include "common/scene/camera.h"
#include "tests/support/alive_box.h"
#include "tests/support/render_tiled.h"

namespace baton {
namespace {

using test::channel;
using test::render_tile;
using test::render_tiled;
using test::sequence_job;

JobSpec geometry_job(int frames) {
  JobSpec job = sequence_job(frames);
  job.output.aovs = {Aov::normal, Aov::depth,  Aov::albedo,        Aov::position,       Aov::z,
                     Aov::motion, Aov::object, Aov::crypto_object, Aov::crypto_material};
  job.quality.rounds = 2;
  return job;
}

TEST(GeometryPlanes, SameBytesForAnyTiling) {
  JobSpec job = geometry_job(3);
  job.quality.sweeps = 2;
  for (const bool moves : {false, true}) {
    if (moves) test::set_in_motion(job, true, true);
    if (moves) test::set_deforming(job, 0.7f, 0.5f);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 1), whole);
    EXPECT_EQ(render_tiled(job, 5, 1, test::keeping_nothing()), whole);
  }
}

// Where one site of each pixel sees a surface, position, depth along the view and distance agree.
TEST(GeometryPlanes, PositionsLieWhereTheyAreSeen) {
  JobSpec job = geometry_job(1);
  job.image.sites = 1;
  job.quality.rounds = 1;
  const FilmTile film = render_tile(job).films.back();
  const Camera camera(job.camera, job.image.width, job.image.height);
  int num_seen = 0;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    if (channel(film, "object")[i] == 0) continue;
    ++num_seen;
    const Vec3 p{channel(film, "P.X")[i], channel(film, "P.Y")[i], channel(film, "P.Z")[i]};
    const auto place = camera.project(p);
    ASSERT_TRUE(place);
    EXPECT_NEAR((*place)[0], static_cast<float>(static_cast<int>(i) % job.image.width) + 0.5f,
                2e-3f);
    EXPECT_NEAR((*place)[1], static_cast<float>(static_cast<int>(i) / job.image.width) + 0.5f,
                2e-3f);
    EXPECT_NEAR(channel(film, "depth")[i], length(p - job.camera.position), 1e-4f);
    EXPECT_NEAR(channel(film, "Z")[i], camera.distance_ahead(p), 1e-4f);
    for (const char* const still : {"forward.u", "forward.v", "backward.u", "backward.v"})
      EXPECT_EQ(channel(film, still)[i], 0);
  }
  EXPECT_GT(num_seen, 80);
}

// The camera slides to the right by d a frame: a point at depth z moves d / (z pixel) to the left,
// and was as far to the right one frame ago; the sky stays.
TEST(GeometryPlanes, MotionIsInPixelsToTheNextFrameAndTheLast) {
  JobSpec job = geometry_job(3);
  job.image.sites = 1;
  job.quality.rounds = 1;
  job.motion.max_px = 8;
  job.motion.curve = KeyCurve::linear;
  constexpr float kStep = 0.05f;
  for (const int frame : {0, 4}) {
    const Vec3 aside{kStep * static_cast<float>(frame), 0, 0};
    job.camera.keys.push_back({.frame = static_cast<double>(frame),
                               .position = Vec3{0, 1, 4} + aside,
                               .look_at = Vec3{0, 1, 0} + aside});
  }
  const FilmTile film = render_tile(job).films.at(1);
  const double pixel =
      2 * std::tan(0.5 * double{job.camera.vertical_fov_deg} * kPi / 180) / job.image.height;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    const float z = channel(film, "Z")[i];
    const double moved = z > 0 ? -kStep / (z * pixel) : 0;
    EXPECT_NEAR(channel(film, "forward.u")[i], moved, 2e-3) << i;
    EXPECT_NEAR(channel(film, "backward.u")[i], -moved, 2e-3) << i;
    EXPECT_NEAR(channel(film, "forward.v")[i], 0, 2e-3) << i;
  }
}

// From 8 above a pixel is 0.1 wide on the ground. Frames 0 and 3 are no frames of the job.
TEST(GeometryPlanes, MotionOfASheetThatStretches) {
  JobSpec job = geometry_job(2);
  job.image = {.width = 32, .height = 24, .sites = 1, .tile_size = 4096};
  job.camera = {.position = {0, 8, 0},
                .look_at = {0, 0, 0},
                .up = {0, 0, -1},
                .vertical_fov_deg = 2 * std::atan(1.2f / 8) * 180 / kPi};
  job.quality.rounds = 1;
  job.motion.max_px = 8;
  test::show_stretching_sheet(job);
  const std::vector<FilmTile> films = render_tile(job).films;
  for (int frame = 1; frame <= 2; ++frame) {
    const FilmTile& film = films.at(static_cast<std::size_t>(frame - 1));
    int on_sheet = 0;
    for (std::size_t i = 0; i < film.num_pixels(); ++i) {
      const float along = (channel(film, "P.X")[i] + 0.6f) / 0.1f;
      const bool sheet = channel(film, "object")[i] == 1;
      on_sheet += sheet ? 1 : 0;
      EXPECT_NEAR(channel(film, "forward.u")[i], sheet && frame == 1 ? along : 0, 0.03f) << i;
      EXPECT_NEAR(channel(film, "backward.u")[i], sheet && frame == 2 ? -along / 2 : 0, 0.03f) << i;
      EXPECT_NEAR(channel(film, "forward.v")[i], 0, 2e-3) << i;
    }
    EXPECT_EQ(on_sheet, 36 * frame);
  }
}

// Parts that are named alike are one object: no ID stands twice in a pixel.
TEST(GeometryPlanes, ObjectsOfOneNameAreOneInMattes) {
  JobSpec job = geometry_job(1);
  job.output.background = Background::transparent;
  job.scene.objects.push_back(job.scene.objects[0]);
  job.scene.objects.back().translate.x += 0.4f;
  for (ObjectSpec& object : job.scene.objects) object.name = "all";
  job.scene.ground.reset();
  const FilmTile film = render_tile(job).films.back();
  const std::vector<std::string>& channels = traits(Aov::crypto_object).channels;
  int seen = 0;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    const float share = channel(film, channels[1])[i];
    EXPECT_EQ(channel(film, channels[3])[i], 0);
    EXPECT_NEAR(share, channel(film, "A")[i], 1e-6);
    if (share > 0) {
      EXPECT_EQ(channel(film, channels[0])[i], cryptomatte_id("all"));
      ++seen;
    }
  }
  EXPECT_GT(seen, 5);
}

TEST(GeometryPlanes, MattesCoverWhatIsSeen) {
  JobSpec job = geometry_job(1);
  job.output.background = Background::transparent;
  const FilmTile film = render_tile(job).films.back();
  std::set<std::uint32_t> ids, expected;
  for (const std::string& name : object_names(job))
    expected.insert(std::bit_cast<std::uint32_t>(cryptomatte_id(name)));
  const std::vector<std::string>& channels = traits(Aov::crypto_object).channels;
  int num_shared = 0;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    double sum = 0;
    for (std::size_t c = 0; c < channels.size(); c += 2) {
      const float share = channel(film, channels[c + 1])[i];
      if (share > 0) ids.insert(std::bit_cast<std::uint32_t>(channel(film, channels[c])[i]));
      sum += double{share};
    }
    EXPECT_NEAR(sum, double{channel(film, "A")[i]}, 1e-6);
    num_shared += channel(film, channels[3])[i] > 0 ? 1 : 0;
  }
  EXPECT_EQ(ids, expected);
  EXPECT_GT(num_shared, 5) << "pixels of two objects";
}

}  // namespace
}  // namespace baton

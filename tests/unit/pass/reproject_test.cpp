#include "worker/pass/reproject.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>

#include "common/job/text/frame_range.h"
#include "common/state/memory_plane.h"
#include "tests/support/alive_box.h"
#include "tests/support/small_scene.h"
#include "worker/pass/pixel_order.h"

namespace baton {
namespace {

/// Two frames of a job and a state of the first in which each pixel's Lns is its number + 1, with
/// 16 particles spread over the sites: what `take` returns tells where it came from.
class Follower {
 public:
  /// believes_rigid: points are looked for as if no mesh had another shape in the frame before.
  explicit Follower(const JobSpec& job, bool believes_rigid = false)
      : context_(*load_render_context(job, Digest{1, 2})) {
    const PixelRect rect = context_->grid.rect(0);
    before_ = *context_->geometry->at(Step(0));
    now_ = *context_->geometry->at(Step(1));
    if (believes_rigid) {
      auto planted = std::make_shared<FrameGeometry>(*before_);
      planted->pose.shapes = now_->pose.shapes;
      before_ = planted;
    }
    surfaces_ = trace_primary(context_->job, *now_, rect);
    const TileSurfaces old = trace_primary(context_->job, *before_, rect);
    auto state = std::make_shared<SampleState>();
    state->resize(sample_format(), rect, 16);
    const SamplePlanes samples(*state);
    for (std::size_t i = 0; i < state->num_pixels(); ++i) {
      const auto hits = old.pixel(i);
      const bool seen =
          std::any_of(hits.begin(), hits.end(), [](const SurfaceHit& hit) { return hit.hit; });
      state->source[i] = seen ? PixelSource::fresh : PixelSource::background;
      samples.lns[i] = static_cast<float>(i + 1);
      for (std::size_t j = 0; j < 16; ++j) {
        samples.weight[16 * i + j] = 1.0f / 16;
        samples.site[16 * i + j] = static_cast<std::uint8_t>(j % hits.size());
      }
    }
    states_ = {state};
    follow();
  }

  /// What became of pixel (x, y): its history, and the pixel that it came from with the share of
  /// its weight.
  struct Found {
    PixelHistory history = PixelHistory::none;
    float lns = 0;
    std::array<std::uint8_t, 16> site{};
    std::array<float, 16> weight{};
  };
  const Found& at(int x, int y) const {
    return found_[static_cast<std::size_t>(y * context_->job.image.width + x)];
  }
  int source_x(int x, int y) const {
    return (static_cast<int>(std::lround(at(x, y).lns)) - 1) % context_->job.image.width;
  }
  std::span<const SurfaceHit> hits(int x, int y) const {
    return surfaces_.pixel(static_cast<std::size_t>(y * context_->job.image.width + x));
  }
  /// Share of the pixels that see a surface for which `test` holds.
  double share(const std::function<bool(int x, int y)>& test) const {
    int surface = 0, good = 0;
    for (int y = 0; y < context_->job.image.height; ++y) {
      for (int x = 0; x < context_->job.image.width; ++x) {
        if (!hits(x, y)[0].hit) continue;
        ++surface;
        good += test(x, y) ? 1 : 0;
      }
    }
    return static_cast<double>(good) / surface;
  }

 private:
  void follow() {
    Reprojection reprojection(*context_, *now_, *before_, states_);
    const std::size_t num_pixels = states_[0]->num_pixels();
    std::vector<std::uint32_t> slots(num_pixels);
    std::iota(slots.begin(), slots.end(), 0u);
    reprojection.look_up(surfaces_, slots, context_->frames[1]);
    found_.resize(num_pixels);
    SampleState state;
    state.resize(sample_format(), states_[0]->rect, 16);
    const SamplePlanes samples(state);
    for (std::size_t i = 0; i < num_pixels; ++i) {
      OldSurfaces old;
      CatcherAlbedo none;
      found_[i].history = reprojection.take(i, i, none, state, old);
      found_[i].lns = samples.lns[i];
      std::copy_n(samples.site.data() + 16 * i, 16, found_[i].site.data());
      std::copy_n(samples.weight.data() + 16 * i, 16, found_[i].weight.data());
    }
  }

  std::shared_ptr<const RenderContext> context_;
  std::shared_ptr<const FrameGeometry> before_, now_;
  TileSurfaces surfaces_;
  std::vector<StatePtr> states_;
  std::vector<Found> found_;
};

/// Looks straight down on the ground from 8 above: 32 x 24 pixels of 0.1.
JobSpec ground_job(int sites) {
  JobSpec job = test::box_job();
  job.frames = parse_frames("1-2").value();
  job.image = {.width = 32, .height = 24, .sites = sites, .tile_size = 4096};
  job.scene.objects.clear();
  job.camera = {.position = {0, 8, 0},
                .look_at = {0, 0, 0},
                .up = {0, 0, -1},
                .vertical_fov_deg = 2 * std::atan(1.2f / 8) * 180 / kPi};
  job.motion.max_px = 3;
  return job;
}
/// The camera moves by `px` pixels to the right.
JobSpec pan_job(int sites, float px) {
  JobSpec job = ground_job(sites);
  job.camera.keys = {
      {.frame = 1, .position = {0, 8, 0}, .look_at = {0, 0, 0}, .up = {0, 0, -1}},
      {.frame = 2, .position = {0.1f * px, 8, 0}, .look_at = {0.1f * px, 0, 0}, .up = {0, 0, -1}}};
  return job;
}

TEST(Reprojection, WholePixelsAreFollowedExactly) {
  const Follower two(pan_job(1, 2));
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      if (x >= 30) {
        EXPECT_EQ(two.at(x, y).history, PixelHistory::none) << "comes into the image";
      } else {
        EXPECT_EQ(two.at(x, y).history, PixelHistory::moved);
        EXPECT_EQ(two.source_x(x, y), x + 2);
      }
    }
  }
}

TEST(Reprojection, NothingIsFollowedBeyondTheReach) {
  const Follower far(pan_job(4, 4));
  EXPECT_EQ(far.share([&](int x, int y) { return far.at(x, y).history != PixelHistory::none; }), 0);
}

TEST(Reprojection, HalfAPixelIsFollowedOnAverage) {
  // Without loss: all but the border has history. Without smear: the history moves by half a pixel
  // on average. With 32 x 24 pixels the share of those that come from next door has a standard
  // error of 0.018.
  for (const int sites : {4, 16}) {
    const Follower half(pan_job(sites, 0.5f));
    EXPECT_GT(
        half.share([&](int x, int y) { return half.at(x, y).history == PixelHistory::moved; }),
        31.0 / 32 - 1e-6);
    const double next_door = half.share([&](int x, int y) {
      const int source = half.source_x(x, y);
      return half.at(x, y).history == PixelHistory::moved && source == x + 1;
    });
    EXPECT_NEAR(next_door, 0.5, 0.09) << sites;
    EXPECT_EQ(half.share([&](int x, int y) {
      return half.at(x, y).history == PixelHistory::moved && half.source_x(x, y) != x &&
             half.source_x(x, y) != x + 1;
    }),
              0);
  }
}

TEST(Reprojection, ACameraThatStaysLeavesEverythingAsItWas) {
  const Follower still(pan_job(4, 0));
  EXPECT_EQ(still.share([&](int x, int y) {
    return still.at(x, y).history == PixelHistory::same && still.source_x(x, y) == x;
  }),
            1);
}

/// A box of side 0.6 (6 pixels) on the ground that moves by 3 pixels to the right, seen from above.
JobSpec sliding_job(int sites) {
  JobSpec job = ground_job(sites);
  job.scene.objects = {
      {.mesh = "box", .material = "metal", .scale = {0.6f, 0.1f, 0.6f}, .place_on_ground = true}};
  job.scene.objects[0].keys = {{.frame = 1}, {.frame = 2, .translate = {0.3f, 0, 0}}};
  return job;
}

TEST(Reprojection, AnObjectTakesItsHistoryAlongAndUncoversGround) {
  const Follower box(sliding_job(1));
  // The box covers x in [13, 19) before and [16, 22) after; y in [9, 15).
  for (int y = 10; y < 14; ++y) {
    for (int x = 17; x < 21; ++x) {
      ASSERT_EQ(box.hits(x, y)[0].instance, 0u);
      EXPECT_EQ(box.at(x, y).history, PixelHistory::moved);
      EXPECT_EQ(box.source_x(x, y), x - 3);
    }
    EXPECT_EQ(box.at(14, y).history, PixelHistory::none) << "uncovered";
  }
  EXPECT_EQ(box.at(3, 3).history, PixelHistory::same);
  EXPECT_EQ(box.source_x(3, 3), 3);
}

// What was not there has no history, and leaves none.
TEST(Reprojection, AnObjectComesAndGoes) {
  JobSpec job = sliding_job(1);
  for (const bool comes : {true, false}) {
    job.scene.objects[0].keys = {{.frame = 1}, {.frame = 2}};
    job.scene.objects[0].keys[comes ? 0 : 1].scale = {0, 0, 0};
    const Follower box(job);
    for (int y = 10; y < 14; ++y) {
      for (int x = 14; x < 18; ++x) {
        EXPECT_EQ(box.hits(x, y)[0].instance == 0u, comes);
        EXPECT_EQ(box.at(x, y).history, PixelHistory::none);
      }
    }
    EXPECT_EQ(box.at(3, 3).history, PixelHistory::same);
  }
}

TEST(Reprojection, SitesInheritFromSitesThatSawTheSame) {
  // At the edges of the box a pixel's sites see two objects; whatever is inherited stays with its
  // object.
  JobSpec job = sliding_job(16);
  job.scene.objects[0].scale = {0.65f, 0.1f, 0.65f};
  const Follower box(job);
  int mixed = 0;
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      const Follower::Found& found = box.at(x, y);
      if (found.history == PixelHistory::none) continue;
      float sum = 0;
      for (std::size_t j = 0; j < 16; ++j) {
        sum += found.weight[j];
        EXPECT_TRUE(box.hits(x, y)[found.site[j]].hit);
      }
      EXPECT_NEAR(sum, 1, 1e-5f);
      EXPECT_EQ(found.lns, std::round(found.lns)) << "a sample is lost";
      const auto hits = box.hits(x, y);
      mixed += std::any_of(hits.begin(), hits.end(),
                           [&](const SurfaceHit& hit) { return hit.instance != hits[0].instance; });
    }
  }
  EXPECT_GT(mixed, 8);
}

TEST(Reprojection, TolerancesDecideWhatIsTheSameSurface) {
  // A box that turns by 30 degrees about an axis in its top: normals differ by 0 after the motion
  // is taken back.
  JobSpec job = sliding_job(1);
  job.scene.objects[0].keys[1] = {.frame = 2, .rotate_deg = {0, 0, 12}};
  const Follower turned(job);
  EXPECT_EQ(turned.at(16, 12).history, PixelHistory::moved);
  // Rising out of the plane by its own motion is no difference either; ground is not box, though at
  // one depth.
  job.motion.normal_tolerance_deg = 0.1f;
  job.motion.depth_tolerance = 1e-3f;
  EXPECT_EQ(Follower(job).at(16, 12).history, PixelHistory::moved);
}

// The camera moves by a block. Of a box and the catcher beside it, whose edge goes through the
// fourth block, each block inherits what the pixels of its kind had in the block to its right.
TEST(Reprojection, BlocksTakeTheirMemoryAlong) {
  JobSpec job = pan_job(1, 4);
  job.motion.max_px = 5;
  job.scene.ground->catcher = true;
  job.scene.objects = {
      {.mesh = "box", .material = "metal", .translate = {1.8f, 0, 0}, .scale = {3.2f, 1e-4f, 4}}};
  const auto context = *load_render_context(job, Digest{1, 2});
  const auto before = *context->geometry->at(Step(0)), now = *context->geometry->at(Step(1));
  const PixelRect rect = context->grid.rect(0);
  const TileSurfaces surfaces = trace_primary(context->job, *now, rect);
  auto old = std::make_shared<SampleState>();
  old->resize(memory_format(true), rect, 0);
  const TileSurfaces seen = trace_primary(context->job, *before, rect);
  for (std::size_t i = 0; i < old->num_pixels(); ++i)
    old->source[i] = seen.sees_catcher(i) ? PixelSource::catcher : PixelSource::carried;
  const PixelBlocks blocks(rect);
  for (std::size_t block = 0; block < blocks.count(); ++block) {
    for (const std::size_t plane : {0, 1}) {
      const auto number = static_cast<std::uint8_t>(2 * block + 2 + 100 * plane);
      block_memory_plane(*old, plane)[block].cells[3] = {number, number};
    }
  }

  const StatePtr states[] = {old};
  Reprojection reprojection(*context, *now, *before, states);
  SampleState state;
  state.resize(memory_format(true), rect, 0);
  const RoundPixels pixels = RoundPixels::all(state.num_pixels());
  const PixelOrder order(rect, pixels, PixelOrder::Blocks::of_memory, 64);
  for (std::size_t i = 0; i < order.num_batches(); ++i) {
    reprojection.look_up(surfaces, order.batch(i), context->frames[1]);
    reprojection.inherit_blocks(surfaces, order.batch(i), state);
  }
  EXPECT_FALSE(surfaces.sees_catcher(14));
  EXPECT_TRUE(surfaces.sees_catcher(13));
  for (std::size_t block = 0; block < blocks.count(); ++block) {
    const PixelRect at = blocks.pixels(block);
    const bool has_source = at.x1 < 32;
    const std::array<bool, 2> sees{has_source && at.x1 > 14, has_source && at.x0 < 14};
    for (const std::size_t plane : {0, 1}) {
      const auto half = static_cast<std::uint8_t>(sees[plane] ? block + 2 + 50 * plane : 0);
      EXPECT_EQ(block_memory_plane(state, plane)[block].cells[3], (VisibilityCell{half, half}))
          << block << " plane " << plane;
    }
  }
}

JobSpec stretching_job() {
  JobSpec job = ground_job(1);
  test::show_stretching_sheet(job);
  job.motion.max_px = 6;
  return job;
}

TEST(Reprojection, ADeformingSurfaceIsFollowedOnItsTriangles) {
  const Follower sheet(stretching_job());
  const Follower rigid(stretching_job(), true);
  int missed = 0;
  for (int y = 10; y < 14; ++y) {
    for (int x = 10; x < 22; ++x) {
      ASSERT_EQ(sheet.hits(x, y)[0].instance, 0u);
      EXPECT_EQ(sheet.at(x, y).history, PixelHistory::moved);
      EXPECT_EQ(sheet.source_x(x, y), 10 + (x - 10) / 2) << x;
      missed +=
          rigid.at(x, y).history == PixelHistory::none || rigid.source_x(x, y) != 10 + (x - 10) / 2;
    }
  }
  // Looked for where it is now, it is found where it has not moved alone.
  EXPECT_EQ(missed, 4 * 11);
  EXPECT_EQ(sheet.at(3, 3).history, PixelHistory::same);
}

}  // namespace
}  // namespace baton

#include "worker/pass/site_rays.h"

#include <algorithm>
#include <cmath>

#include "common/job/plan/sequence.h"
#include "common/math/low_discrepancy.h"
#include "worker/pass/site_kernels.h"
#include "worker/sampling/pixel_filter.h"

namespace baton {

Rng site_random(const JobSpec& job, std::int32_t x, std::int32_t y) {
  const std::uint64_t seed = job.image.site_seed > 0 ? job.image.site_seed : job.seed;
  return {pixel_key(seed, 0, job.image.width, x, y), PassId::site_position};
}

SiteRays::Grid::Grid(std::int32_t coarse, std::int32_t sites) {
  const auto root = [](std::int32_t square) {
    return static_cast<std::int32_t>(std::sqrt(static_cast<float>(square)));
  };
  const std::int32_t side = root(coarse), cuts = root(sites / coarse);
  width = 1.0f / static_cast<float>(side * cuts);
  // Sites 0, 1, ... of the coarse grid come first: what needs few takes those.
  for (std::int32_t site = 0; site < sites; ++site) {
    const std::int32_t cell = site % coarse, cut = site / coarse;
    x.push_back(static_cast<float>(cell % side * cuts + cut % cuts));
    y.push_back(static_cast<float>(cell / side * cuts + cut / cuts));
  }
}

SiteRays::SiteRays(const JobSpec& job, const Camera& camera, std::int32_t round)
    : job_(job),
      camera_(camera),
      plane_(camera.plane()),
      round_(std::max(round, 0)),
      own_sites_(rounds_have_own_sites(job)),
      shift_(sobol_2d(own_sites_ ? static_cast<std::uint32_t>(round_) : 0)) {}

const SiteRays::Grid& SiteRays::grid_of(std::int32_t num_sites) {
  const auto count = static_cast<std::size_t>(num_sites);
  const auto found =
      std::ranges::find(grids_, count, [](const Grid& grid) { return grid.x.size(); });
  if (found != grids_.end()) return *found;
  constexpr std::size_t kVectors = 16;
  x_.resize(std::max(x_.size(), count + kVectors));
  y_.resize(x_.size());
  return grids_.emplace_back(job_.image.sites, num_sites);
}

void SiteRays::append(std::int32_t x, std::int32_t y, std::int32_t num_sites,
                      std::vector<Ray>& rays) {
  const std::array<float, 2> pixel{static_cast<float>(x), static_cast<float>(y)};
  const Rng rng = site_random(job_, x, y);
  const auto count = static_cast<std::size_t>(num_sites);
  const Grid& grid = grid_of(num_sites);
  const bool lone =
      num_sites == 1 && !has_fine_sites(job_) && (job_.quality.rounds == 1 || !own_sites_);
  if (lone && job_.image.filter == PixelFilter::box) {
    x_[0] = y_[0] = 0.5f;
  } else {
    kernels::place_sites({grid.x, grid.y, grid.width}, rng, shift_, x_, y_);
    for (std::size_t i = 0; i < count && job_.image.filter != PixelFilter::box; ++i) {
      const auto at = filter_position(job_.image.filter, {x_[i], y_[i]});
      x_[i] = at[0];
      y_[i] = at[1];
    }
  }

  if (!camera_.has_lens()) {
    rays.resize(rays.size() + count);
    return kernels::camera_rays(plane_, pixel, x_, y_, std::span(rays).last(count));
  }
  const Philox4x32::Counter lens = rng.bits(1, 0);
  std::uint32_t point = own_sites_ ? static_cast<std::uint32_t>(round_ * num_sites) : 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto u = sobol_2d(point++);
    rays.push_back(camera_.ray(pixel[0] + x_[i], pixel[1] + y_[i],
                               {uniform_float(u[0] ^ lens[0]), uniform_float(u[1] ^ lens[1])}));
  }
}

}  // namespace baton

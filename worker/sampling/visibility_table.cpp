#include "worker/sampling/visibility_table.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {
namespace {

/// Rays of bins that are taken together, and those of them that were free.
struct Tally {
  std::int32_t seen = 0, free = 0;

  void add(VisibilityCell cell) {
    seen += cell.seen;
    free += cell.free;
  }
  void add(const Tally& other) {
    seen += other.seen;
    free += other.free;
  }
  float share(float prior_rays, float guess) const {
    return (static_cast<float>(free) + prior_rays * guess) /
           (static_cast<float>(seen) + prior_rays);
  }
};

/// Of one kind of bins: 2 x 2 of them together, and 4 x 4.
struct Levels {
  static constexpr std::size_t kFine = BlockMemory::kSide / 2, kCoarse = kFine / 2;
  std::array<Tally, kFine * kFine> fine;
  std::array<Tally, kCoarse * kCoarse> coarse;
  Tally all;

  explicit Levels(const VisibilityCell* cells) {
    constexpr std::size_t kSide = BlockMemory::kSide;
    for (std::size_t y = 0; y < kFine; ++y) {
      for (std::size_t x = 0; x < kFine; ++x) {
        const VisibilityCell* const first = cells + 2 * y * kSide + 2 * x;
        Tally& sum = fine[y * kFine + x];
        for (const std::size_t at : {std::size_t{0}, std::size_t{1}, kSide, kSide + 1})
          sum.add(first[at]);
        coarse[y / 2 * kCoarse + x / 2].add(sum);
      }
    }
    for (const Tally& sum : coarse) all.add(sum);
  }

  void expect(const VisibilityCell* cells, float prior_rays, float guess, float* expected) const {
    constexpr std::size_t kSide = BlockMemory::kSide;
    const float of_kind = all.share(prior_rays, guess);
    std::array<float, kCoarse * kCoarse> of_coarse;
    for (std::size_t i = 0; i < coarse.size(); ++i)
      of_coarse[i] = coarse[i].share(prior_rays, of_kind);
    std::array<float, kSide * kSide> prior;
    for (std::size_t y = 0; y < kFine; ++y) {
      for (std::size_t x = 0; x < kFine; ++x) {
        const float of_fine =
            fine[y * kFine + x].share(prior_rays, of_coarse[y / 2 * kCoarse + x / 2]);
        float* const first = prior.data() + 2 * y * kSide + 2 * x;
        first[0] = first[1] = first[kSide] = first[kSide + 1] = of_fine;
      }
    }
    for (std::size_t i = 0; i < kSide * kSide; ++i) {
      expected[i] = (static_cast<float>(cells[i].free) + prior_rays * prior[i]) /
                    (static_cast<float>(cells[i].seen) + prior_rays);
    }
  }
};

}  // namespace

void VisibilityTable::read(const BlockMemory& memory, float prior_rays) {
  const VisibilityCell* const plain = memory.cells.data();
  const VisibilityCell* const lamps = plain + BlockMemory::kBins;
  const Levels of_plain(plain), of_lamps(lamps);
  Tally all = of_plain.all;
  all.add(of_lamps.all);
  knows_rays = all.seen > 0;
  is_uniform = all.free == 0 || all.free == all.seen;
  everywhere = all.share(1, 0.5f);
  if (is_uniform) return;
  const float guess = std::max(everywhere, 0.5f);
  of_plain.expect(plain, prior_rays, guess, expected.data());
  of_lamps.expect(lamps, prior_rays, guess, expected.data() + BlockMemory::kBins);
}

PixelVisibility::PixelVisibility(const VisibilityTable& block, const PixelMemory& own,
                                 float prior_rays)
    : of_block(block) {
  const float prior = prior_rays * RayTally::kRay;
  for (std::size_t kind = 0; kind < share.size(); ++kind) {
    const RayTally& rays = own.rays[kind];
    share[kind] = (rays.free + prior) / (rays.expected + prior);
  }
}

void remember_rays(std::span<const std::uint16_t> tag, std::uint64_t free, BlockMemory& block,
                   PixelMemory& pixel) {
  BATON_CHECK(tag.size() <= 64);
  for (std::size_t j = 0; j < tag.size(); ++j) {
    const RayTag ray{tag[j]};
    const bool is_free = (free >> j & 1) != 0;
    VisibilityCell& cell = block.cells[ray.bin()];
    if (cell.seen == VisibilityCell::kMostSeen) {
      cell.seen /= 2;
      cell.free /= 2;
    }
    ++cell.seen;
    cell.free = static_cast<std::uint8_t>(cell.free + (is_free ? 1 : 0));

    RayTally& own = pixel.rays[ray.bin() / BlockMemory::kBins];
    own.expected = static_cast<std::uint16_t>(own.expected + ray.expected());
    own.free = static_cast<std::uint16_t>(own.free + (is_free ? RayTally::kRay : 0));
    if (std::max(own.expected, own.free) > RayTally::kMost) {
      own.expected /= 2;
      own.free /= 2;
    }
  }
}

}  // namespace baton

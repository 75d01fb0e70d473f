#include "common/state/join_states.h"

#include <fmt/format.h>

#include <algorithm>

namespace baton {
namespace {

/// Whether two states are of one frame and have the same things.
bool are_alike(const SampleState& a, const SampleState& b) {
  return a.picture == b.picture && a.step == b.step && a.num_particles == b.num_particles &&
         a.num_populations == b.num_populations && a.format == b.format;
}

/// Copies `count` pixels of a row with their sources.
void copy_row(const SampleState& from, std::size_t first_from, SampleState& to, std::size_t first,
              std::size_t count) {
  const auto populations = static_cast<std::size_t>(to.num_populations);
  std::copy_n(from.source.data() + first_from * populations, count * populations,
              to.source.data() + first * populations);
  to.copy_pixels(from, first_from, first, count);
}

std::size_t pixel_at(const PixelRect& rect, std::int32_t x, std::int32_t y) {
  return static_cast<std::size_t>(y - rect.y0) * static_cast<std::size_t>(rect.width()) +
         static_cast<std::size_t>(x - rect.x0);
}

/// Copies what blocks carry, each from the part that it lies in. Returns how many lie in none
/// whole, which carry nothing then.
std::size_t copy_blocks(std::span<const SampleState* const> parts, SampleState& to) {
  if (to.block_planes.empty()) return 0;
  const PixelBlocks blocks(to.rect);
  std::size_t num_cut = 0;
  for (std::size_t block = 0; block < blocks.count(); ++block) {
    const PixelRect pixels = blocks.pixels(block);
    const auto part = std::ranges::find_if(
        parts, [&](const SampleState* state) { return state->rect.contains(pixels); });
    if (part == parts.end()) {
      ++num_cut;
    } else {
      to.copy_block(**part, PixelBlocks((*part)->rect).at(pixels.x0, pixels.y0), block);
    }
  }
  return num_cut;
}

}  // namespace

Result<SampleState> join_states(std::span<const SampleState* const> parts, const PixelRect& rect,
                                std::int32_t tile) {
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, fmt::format("joining states for tile {}: {}", tile, what)};
  };
  if (parts.empty()) return fail("there are none");
  const SampleState& model = *parts.front();
  SampleState joined;
  joined.picture = model.picture;
  joined.step = model.step;
  joined.tile = tile;
  joined.resize(*model.format, rect, model.num_particles, model.num_populations);

  std::int64_t num_covered = 0;
  for (const SampleState* const part : parts) {
    if (!are_alike(model, *part)) {
      return fail(fmt::format("tile {} is of another picture, frame or layout than tile {}",
                              part->tile, model.tile));
    }
    const PixelRect& from = part->rect;
    const PixelRect shared{std::max(rect.x0, from.x0), std::max(rect.y0, from.y0),
                           std::min(rect.x1, from.x1), std::min(rect.y1, from.y1)};
    if (shared.x0 >= shared.x1) continue;
    for (std::int32_t y = shared.y0; y < shared.y1; ++y) {
      const auto width = static_cast<std::size_t>(shared.x1 - shared.x0);
      copy_row(*part, pixel_at(from, shared.x0, y), joined, pixel_at(rect, shared.x0, y), width);
      num_covered += shared.x1 - shared.x0;
    }
  }
  if (num_covered != rect.area())
    return fail(fmt::format("they cover {} of {} pixels", num_covered, rect.area()));
  if (const std::size_t num_cut = copy_blocks(parts, joined); num_cut > 0) {
    return fail(fmt::format("{} of {} blocks of {} x {} pixels lie in none of them whole", num_cut,
                            joined.num_blocks(), PixelBlocks::kSide, PixelBlocks::kSide));
  }
  return joined;
}

}  // namespace baton

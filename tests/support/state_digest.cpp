// state_digest FOLDER: for every frame whose states lie in the folder or below, one line: frame
// index, number of pixels, and a digest of the samples of all its pixels in image order. Tile
// borders and the job's digest do not count, so that jobs that differ in the tile size alone can be
// compared. Files that are no states are skipped.

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <utility>

#include "common/base/digest.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/state/sample_planes.h"

namespace {

using PixelKey = std::pair<std::int32_t, std::int32_t>;  // y, x
using FramePixels = std::map<PixelKey, baton::Bytes>;

/// Adds the samples of each pixel of one tile to its frame.
void add_pixels(const baton::SampleState& state, FramePixels& pixels) {
  const auto num_particles = static_cast<std::size_t>(state.num_particles);
  const baton::ConstSamplePlanes samples(state);
  for (std::size_t pixel = 0; pixel < state.num_pixels(); ++pixel) {
    baton::ByteWriter writer;
    const auto populations = static_cast<std::size_t>(state.num_populations);
    for (std::size_t row = pixel * populations; row < (pixel + 1) * populations; ++row) {
      writer.put(samples.lns[row]);
      writer.put(samples.lns_fresh[row]);
      writer.put(static_cast<std::uint8_t>(state.source[row]));
    }
    for (std::size_t i = pixel * num_particles; i < (pixel + 1) * num_particles; ++i) {
      writer.put(samples.direction[i]);
      writer.put(samples.weight[i]);
      writer.put(samples.site[i]);
    }
    const auto width = static_cast<std::size_t>(state.rect.width());
    const auto x = static_cast<std::int32_t>(pixel % width) + state.rect.x0;
    const auto y = static_cast<std::int32_t>(pixel / width) + state.rect.y0;
    pixels[{y, x}] = writer.take();
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 64;

  std::map<std::int32_t, FramePixels> frames;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[1])) {
    if (!entry.is_regular_file()) continue;
    const auto bytes = baton::read_file(entry.path(), baton::limits::kMaxBlobBytes);
    if (!bytes) continue;
    const auto state = baton::decode_state(*bytes, entry.path().string());
    if (state) add_pixels(*state, frames[state->step.value()]);
  }

  for (const auto& [frame, pixels] : frames) {
    baton::ByteWriter all;
    for (const auto& [key, bytes] : pixels) {
      all.put(key.first);
      all.put(key.second);
      all.put_raw(bytes);
    }
    fmt::print("{} {} {}\n", frame, pixels.size(), baton::digest_of(all.bytes()).hex());
  }
  return 0;
}

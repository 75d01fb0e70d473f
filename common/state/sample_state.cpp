#include "common/state/sample_state.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/state/memory_plane.h"
#include "common/state/state_format.h"

namespace baton {
namespace {

constexpr SectionTag kMagic{'B', 'S', 'T', '1'};
constexpr SectionTag kMeta{'M', 'E', 'T', 'A'};
constexpr SectionTag kSource{'S', 'R', 'C', '_'};
constexpr SectionTag kPopulations{'P', 'O', 'P', 'S'};

constexpr std::size_t kMetaBytes = 2 * sizeof(std::uint64_t) + 7 * sizeof(std::int32_t);

Bytes encode_meta(const SampleState& state) {
  ByteWriter writer;
  writer.put(state.picture.high);
  writer.put(state.picture.low);
  for (const std::int32_t value : {state.step.value(), state.tile, state.rect.x0, state.rect.y0,
                                   state.rect.x1, state.rect.y1, state.num_particles}) {
    writer.put(value);
  }
  return writer.take();
}

/// Fills the header but for what has its own section.
Status decode_meta(const SectionFile& file, const std::string& name, const StateFormat& format,
                   SampleState& state) {
  BATON_ASSIGN(const ByteView payload, section_payload(file, kMeta, kMetaBytes, name));
  ByteReader reader(payload);
  state.picture.high = reader.get<std::uint64_t>();
  state.picture.low = reader.get<std::uint64_t>();
  state.step = Step(reader.get<std::int32_t>());
  for (std::int32_t* value : {&state.tile, &state.rect.x0, &state.rect.y0, &state.rect.x1,
                              &state.rect.y1, &state.num_particles}) {
    *value = reader.get<std::int32_t>();
  }

  // Check what sizes the planes before anything is allocated.
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, fmt::format("{}: section META: {}", name, what)};
  };
  const PixelRect& rect = state.rect;
  if (state.step < Step(0) || state.step >= Step(limits::kMaxFrames) || state.tile < 0) {
    return fail(fmt::format("frame index {}, tile {}", state.step, state.tile));
  }
  if (!rect.fits_within(limits::kMaxImageSide, limits::kMaxOverscan)) {
    return fail(fmt::format("rectangle [{}, {}) x [{}, {}), expected a non-empty one within {}..{}",
                            rect.x0, rect.x1, rect.y0, rect.y1, -limits::kMaxOverscan,
                            limits::kMaxImageSide + limits::kMaxOverscan));
  }
  const int fewest = format.fewest_particles();
  if (state.num_particles < fewest || state.num_particles > limits::kMaxParticles) {
    return fail(fmt::format("{} particles, expected {} to {}", state.num_particles, fewest,
                            limits::kMaxParticles));
  }
  return {};
}

/// Reads how many populations there are: one when nothing is said.
Status decode_populations(const SectionFile& file, const std::string& name, SampleState& state) {
  state.num_populations = 1;
  if (file.find(kPopulations) == nullptr) return {};
  BATON_ASSIGN(const ByteView payload,
               section_payload(file, kPopulations, sizeof(std::int32_t), name));
  state.num_populations = ByteReader(payload).get<std::int32_t>();
  if (state.num_populations == 2 && state.num_particles % 2 == 0) return {};
  return Error{
      ErrorKind::bad_input,
      fmt::format("{}: section POPS: {} populations of {} particles, expected 2 of an even number",
                  name, state.num_populations, state.num_particles)};
}

/// Fills `state.source`; sizes all planes, which must not be larger than a file may be.
Status decode_sources(const SectionFile& file, const std::string& name, const StateFormat& format,
                      SampleState& state) {
  const auto populations = static_cast<std::size_t>(state.num_populations);
  const std::uint64_t bytes =
      state.num_pixels() * format.most_stored_bytes(state.num_particles, state.num_populations) +
      state.num_blocks() * format.most_stored_block_bytes();
  if (bytes > limits::kMaxBlobBytes) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("{}: {} pixels of {} particles take {} bytes, past the limit of {}", name,
                    state.num_pixels(), state.num_particles, bytes, limits::kMaxBlobBytes)};
  }
  BATON_ASSIGN(const ByteView payload,
               section_payload(file, kSource, state.num_pixels() * populations, name));
  state.resize(format, state.rect, state.num_particles, state.num_populations);
  for (std::size_t row = 0; row < payload.size(); ++row) {
    const auto value = std::to_integer<std::uint8_t>(payload[row]);
    if (value >= kNumPixelSources) {
      return StateReader(file, name, state)
          .wrong_value(kSource, row / populations,
                       fmt::format("source {}, expected 0 to 5", value));
    }
    state.source[row] = static_cast<PixelSource>(value);
  }
  return {};
}

Result<SampleState> decode_sections(const SectionFile& file, const std::string& name,
                                    const StateFormat& format) {
  std::vector<SectionTag> known = format.tags();
  known.insert(known.end(), {kMeta, kSource, kPopulations});
  BATON_TRY(check_known_sections(file, known, name));

  // Read what sizes the planes, then the planes.
  SampleState state;
  BATON_TRY(decode_meta(file, name, format, state));
  BATON_TRY(decode_populations(file, name, state));
  BATON_TRY(decode_sources(file, name, format, state));
  BATON_TRY(format.decode(StateReader(file, name, state), state));
  return state;
}

/// Whose sections the file has. Those that no format knows are refused by the plainest one.
const StateFormat& format_of(const SectionFile& file) {
  if (file.find({'C', 'A', 'T', 'M'}) != nullptr) return memory_format(true);
  for (const StateFormat* format : {static_cast<const StateFormat*>(&memory_format()),
                                    static_cast<const StateFormat*>(&weighed_sample_format())}) {
    std::vector<SectionTag> own = format->tags();
    const std::vector<SectionTag> plain = sample_format().tags();
    std::erase_if(
        own, [&](const SectionTag& tag) { return std::ranges::find(plain, tag) != plain.end(); });
    if (std::ranges::any_of(own, [&](const SectionTag& tag) { return file.find(tag) != nullptr; }))
      return *format;
  }
  return sample_format();
}

/// Copies what `count` pixels or blocks have in a plane.
void copy_values(const StatePlane& from, std::size_t first_from, StatePlane& to, std::size_t first,
                 std::size_t count) {
  const std::size_t bytes = to.each_bytes;
  std::copy_n(from.bytes.data() + first_from * bytes, count * bytes,
              to.bytes.data() + first * bytes);
}

void forget_values(std::vector<StatePlane>& planes, std::size_t at) {
  for (StatePlane& plane : planes)
    std::fill_n(plane.bytes.data() + at * plane.each_bytes, plane.each_bytes, std::byte{0});
}

}  // namespace

void SampleState::resize(const StateFormat& new_format, const PixelRect& new_rect,
                         std::int32_t new_num_particles, std::int32_t new_num_populations) {
  BATON_CHECK(new_rect.width() > 0 && new_rect.height() > 0 && new_num_particles >= 0);
  BATON_CHECK(new_num_populations > 0 && new_num_particles % new_num_populations == 0);
  format = &new_format;
  rect = new_rect;
  num_particles = new_num_particles;
  num_populations = new_num_populations;
  source.assign(num_pixels() * static_cast<std::size_t>(num_populations), PixelSource::background);
  const auto make = [](std::vector<StatePlane>& made, const std::vector<std::size_t>& sizes,
                       std::size_t count) {
    made.resize(sizes.size());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      made[i].each_bytes = sizes[i];
      made[i].bytes.assign(count * sizes[i], std::byte{0});
    }
  };
  make(planes, format->pixel_bytes(num_particles, num_populations), num_pixels());
  make(block_planes, format->block_bytes(), num_blocks());
}

std::size_t SampleState::size_bytes() const {
  std::size_t sum = source.size() * sizeof(PixelSource);
  for (const StatePlane& plane : planes) sum += plane.bytes.size();
  for (const StatePlane& plane : block_planes) sum += plane.bytes.size();
  return sum;
}

void SampleState::copy_pixels(const SampleState& from, std::size_t first_from, std::size_t first,
                              std::size_t count) {
  for (std::size_t i = 0; i < planes.size(); ++i)
    copy_values(from.planes[i], first_from, planes[i], first, count);
}

void SampleState::copy_block(const SampleState& from, std::size_t block_from, std::size_t block) {
  for (std::size_t i = 0; i < block_planes.size(); ++i)
    copy_values(from.block_planes[i], block_from, block_planes[i], block, 1);
}

void SampleState::forget_pixel(std::size_t pixel) { forget_values(planes, pixel); }

void SampleState::forget_block(std::size_t block) { forget_values(block_planes, block); }

void SampleState::set_source(std::size_t pixel, PixelSource new_source) {
  const auto count = static_cast<std::size_t>(num_populations);
  std::fill_n(source.data() + pixel * count, count, new_source);
}

PixelSource SampleState::latest_source(std::size_t pixel) const {
  const auto count = static_cast<std::size_t>(num_populations);
  const PixelSource* const first = source.data() + pixel * count;
  return *std::max_element(first, first + count);
}

Bytes encode_state(const SampleState& state) {
  const auto sizes = state.format->pixel_bytes(state.num_particles, state.num_populations);
  BATON_CHECK(state.source.size() ==
              state.num_pixels() * static_cast<std::size_t>(state.num_populations));
  BATON_CHECK(state.planes.size() == sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i)
    BATON_CHECK(state.planes[i].bytes.size() == state.num_pixels() * sizes[i]);

  StateWriter writer(state);
  const ByteView sources = std::as_bytes(std::span(state.source));
  writer.add(kMeta, 1, encode_meta(state));
  writer.add(kSource, 1, Bytes(sources.begin(), sources.end()));
  state.format->encode(state, writer);
  if (state.num_populations > 1) {
    ByteWriter populations;
    populations.put(state.num_populations);
    writer.add(kPopulations, 1, populations.take());
  }
  return encode_sections(kMagic, kStateVersion, writer.sections());
}

Result<SampleState> decode_state(ByteView bytes, const std::string& name,
                                 const StateFormat& format) {
  BATON_ASSIGN(const SectionFile file, decode_section_file(bytes, kMagic, kStateVersion, name));
  return decode_sections(file, name, format);
}

Result<SampleState> decode_state(ByteView bytes, const std::string& name) {
  BATON_ASSIGN(const SectionFile file, decode_section_file(bytes, kMagic, kStateVersion, name));
  return decode_sections(file, name, format_of(file));
}

Result<std::vector<SectionInfo>> state_sections(ByteView bytes, const std::string& name) {
  return list_sections(bytes, kMagic, kStateVersion, name);
}

}  // namespace baton

#include "common/state/sample_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "common/base/limits.h"
#include "common/base/section_file.h"
#include "common/state/memory_sections.h"

namespace baton {
namespace {

constexpr SectionTag kMagic{'B', 'S', 'T', '1'};
constexpr SectionTag kMeta{'M', 'E', 'T', 'A'};
constexpr SectionTag kSource{'S', 'R', 'C', '_'};
constexpr SectionTag kLns{'L', 'N', 'S', '_'};
constexpr SectionTag kLnsFresh{'L', 'N', 'S', 'F'};
constexpr SectionTag kDirection{'D', 'I', 'R', '_'};
constexpr SectionTag kWeight{'W', 'G', 'T', '_'};
constexpr SectionTag kSite{'S', 'I', 'T', 'E'};
constexpr SectionTag kPopulations{'P', 'O', 'P', 'S'};
constexpr SectionTag kConfidence{'C', 'O', 'N', 'F'};
constexpr std::array kTags{kMeta,
                           kSource,
                           kLns,
                           kLnsFresh,
                           kDirection,
                           kWeight,
                           kSite,
                           kPopulations,
                           kMemorySummary,
                           kMemoryMasks,
                           kMemoryCells,
                           kMemoryLightNoise,
                           kMemoryLobeNoise,
                           kConfidence};

constexpr std::size_t kMetaBytes = 2 * sizeof(std::uint64_t) + 7 * sizeof(std::int32_t);
/// How far the sum of a pixel's weights may be from 1.
constexpr double kWeightSumTolerance = 1e-3;

/// 0-based indices of the pixels that carry samples, ascending.
std::vector<std::size_t> surface_pixels(const SampleState& state) {
  std::vector<std::size_t> pixels;
  const auto populations = static_cast<std::size_t>(state.num_populations);
  for (std::size_t i = 0; i < state.num_pixels(); ++i) {
    if (state.source[i * populations] != PixelSource::background) pixels.push_back(i);
  }
  return pixels;
}

/// The sections of a state file. Values of surface pixels are gathered only where there are others.
class StateSections {
 public:
  explicit StateSections(const SampleState& state)
      : num_pixels_(state.num_pixels()), pixels_(surface_pixels(state)) {}

  const std::vector<std::size_t>& pixels() const { return pixels_; }

  /// A section with bytes of its own.
  void add(const SectionTag& tag, std::size_t stride, Bytes payload) {
    owned_.push_back(std::move(payload));
    views_.push_back(
        {.tag = tag, .stride = static_cast<std::uint8_t>(stride), .payload = owned_.back()});
  }
  /// A section with `per_pixel` values of each surface pixel.
  template <class T>
  void gather(const SectionTag& tag, const std::vector<T>& values, std::size_t per_pixel) {
    if (pixels_.size() == num_pixels_) {
      views_.push_back(
          {.tag = tag, .stride = sizeof(T), .payload = std::as_bytes(std::span(values))});
      return;
    }
    const std::span all(values);
    Bytes payload;
    payload.reserve(pixels_.size() * per_pixel * sizeof(T));
    for (const std::size_t pixel : pixels_) {
      const ByteView row = std::as_bytes(all.subspan(pixel * per_pixel, per_pixel));
      payload.insert(payload.end(), row.begin(), row.end());
    }
    add(tag, sizeof(T), std::move(payload));
  }
  /// Has the section that was added last stored as it is.
  void keep_plain() {
    views_.back().stride = 1;
    views_.back().packing = Packing::none;
  }
  ByteView last_payload() const { return views_.back().payload; }
  Bytes encode() const { return encode_sections(kMagic, kStateVersion, views_); }

 private:
  const std::size_t num_pixels_;
  const std::vector<std::size_t> pixels_;
  std::deque<Bytes> owned_;
  std::vector<SectionView> views_;
};

/// How many of `pixels` start and end with the same weight, as all do after a resampling.
std::size_t num_resampled(const SampleState& state, const std::vector<std::size_t>& pixels) {
  const auto count = static_cast<std::size_t>(state.num_particles);
  if (count == 0) return 0;
  return static_cast<std::size_t>(std::ranges::count_if(pixels, [&](std::size_t pixel) {
    const float* const weights = state.weight.data() + pixel * count;
    return weights[0] == weights[count - 1];
  }));
}

/// Inverse of gather: values of all other pixels are left as they are.
template <class T>
Status scatter(const SectionFile& file, const SectionTag& tag,
               const std::vector<std::size_t>& pixels, std::size_t per_pixel,
               const std::string& name, std::vector<T>& values) {
  const std::size_t row_bytes = per_pixel * sizeof(T);
  BATON_ASSIGN(const ByteView payload, section_payload(file, tag, pixels.size() * row_bytes, name));
  if (row_bytes == 0) return {};
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    std::memcpy(values.data() + pixels[i] * per_pixel, payload.data() + i * row_bytes, row_bytes);
  }
  return {};
}

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

/// Fills everything of `state` but its arrays.
Status decode_meta(const SectionFile& file, const std::string& name, SampleState& state) {
  BATON_ASSIGN(const ByteView payload, section_payload(file, kMeta, kMetaBytes, name));
  ByteReader reader(payload);
  state.picture.high = reader.get<std::uint64_t>();
  state.picture.low = reader.get<std::uint64_t>();
  state.step = Step(reader.get<std::int32_t>());
  for (std::int32_t* value : {&state.tile, &state.rect.x0, &state.rect.y0, &state.rect.x1,
                              &state.rect.y1, &state.num_particles}) {
    *value = reader.get<std::int32_t>();
  }

  // Check what sizes the arrays before anything is allocated.
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
  const int fewest = file.find(kMemorySummary) != nullptr ? 0 : 1;
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

/// Checks the values of one population of a surface pixel. The error has no file name yet.
Status check_population(const SampleState& state, std::size_t pixel, std::size_t k) {
  // Lns: radiance.
  const std::size_t row = pixel * static_cast<std::size_t>(state.num_populations) + k;
  for (const auto& [tag, value] :
       {std::pair{kLns, state.lns[row]}, {kLnsFresh, state.lns_fresh[row]}}) {
    if (!(std::isfinite(value) && value >= 0)) {
      return value_error(state, tag, pixel,
                         fmt::format("{}, expected a finite number >= 0", value));
    }
  }

  // Particles: each weight and site, then the sum.
  const auto num_particles = static_cast<std::size_t>(state.num_particles);
  const std::size_t count = num_particles / static_cast<std::size_t>(state.num_populations);
  double sum = 0;
  for (std::size_t i = k * count; i < (k + 1) * count; ++i) {
    const float weight = state.weight[pixel * num_particles + i];
    const int site = state.site[pixel * num_particles + i];
    if (!(std::isfinite(weight) && weight >= 0)) {
      return value_error(
          state, kWeight, pixel,
          fmt::format("particle {} has weight {}, expected a finite number >= 0", i, weight));
    }
    if (site >= limits::kMaxSites) {
      return value_error(
          state, kSite, pixel,
          fmt::format("particle {} has site {}, expected 0 to {}", i, site, limits::kMaxSites - 1));
    }
    sum += weight;
  }
  if (sum != 0 && std::fabs(sum - 1) > kWeightSumTolerance) {
    return value_error(state, kWeight, pixel,
                       fmt::format("weights sum to {}, expected 1 or 0", sum));
  }
  return {};
}

/// Fills `state.source`; resizes all arrays, which must not be larger than a file may be.
Status decode_sources(const SectionFile& file, const std::string& name, SampleState& state) {
  const auto populations = static_cast<std::size_t>(state.num_populations);
  const std::uint64_t bytes =
      state.num_pixels() *
      SampleState::bytes_per_pixel(static_cast<std::size_t>(state.num_particles), populations,
                                   file.find(kMemorySummary) != nullptr,
                                   file.find(kConfidence) != nullptr);
  if (bytes > limits::kMaxBlobBytes) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("{}: {} pixels of {} particles take {} bytes, past the limit of {}", name,
                    state.num_pixels(), state.num_particles, bytes, limits::kMaxBlobBytes)};
  }
  BATON_ASSIGN(const ByteView payload,
               section_payload(file, kSource, state.num_pixels() * populations, name));
  state.resize(state.rect, state.num_particles, state.num_populations);
  for (std::size_t row = 0; row < payload.size(); ++row) {
    const std::size_t pixel = row / populations;
    const auto value = std::to_integer<std::uint8_t>(payload[row]);
    if (value > static_cast<std::uint8_t>(PixelSource::catcher)) {
      const Error error =
          value_error(state, kSource, pixel, fmt::format("source {}, expected 0 to 5", value));
      return Error{error.kind, fmt::format("{}: section {}", name, error.message)};
    }
    state.source[row] = static_cast<PixelSource>(value);
  }
  return {};
}

}  // namespace

std::size_t SampleState::size_bytes() const {
  return num_pixels() * bytes_per_pixel(static_cast<std::size_t>(num_particles),
                                        static_cast<std::size_t>(num_populations), false,
                                        !confidence.empty()) +
         memory.size() * sizeof(PixelMemory);
}

void SampleState::resize(const PixelRect& new_rect, std::int32_t new_num_particles,
                         std::int32_t new_num_populations) {
  BATON_CHECK(new_rect.width() > 0 && new_rect.height() > 0 && new_num_particles >= 0);
  BATON_CHECK(new_num_populations > 0 && new_num_particles % new_num_populations == 0);
  rect = new_rect;
  num_particles = new_num_particles;
  num_populations = new_num_populations;
  const std::size_t pixels = num_pixels();
  const std::size_t particles = pixels * static_cast<std::size_t>(num_particles);
  const std::size_t rows = pixels * static_cast<std::size_t>(num_populations);
  lns.assign(rows, 0.0f);
  lns_fresh.assign(rows, 0.0f);
  source.assign(rows, PixelSource::background);
  direction.assign(particles, 0);
  weight.assign(particles, 0.0f);
  site.assign(particles, 0);
  memory.clear();
  confidence.clear();
}

Bytes encode_state(const SampleState& state) {
  const std::size_t num_pixels = state.num_pixels();
  const auto num_particles = static_cast<std::size_t>(state.num_particles);
  const auto populations = static_cast<std::size_t>(state.num_populations);
  BATON_CHECK(state.lns.size() == num_pixels * populations &&
              state.lns_fresh.size() == state.lns.size());
  BATON_CHECK(state.source.size() == state.lns.size() &&
              state.direction.size() == num_pixels * num_particles);
  BATON_CHECK(state.weight.size() == state.direction.size() &&
              state.site.size() == state.direction.size());
  BATON_CHECK(state.memory.empty() || state.memory.size() == num_pixels);
  BATON_CHECK(state.confidence.empty() || state.confidence.size() == num_pixels);

  StateSections sections(state);
  const ByteView sources = std::as_bytes(std::span(state.source));
  sections.add(kMeta, 1, encode_meta(state));
  sections.add(kSource, 1, Bytes(sources.begin(), sources.end()));
  sections.gather(kLns, state.lns, populations);
  sections.gather(kLnsFresh, state.lns_fresh, populations);

  // Directions are as good as random, sites nearly so, and so are weights unless most pixels were
  // just resampled: finding repetitions costs more time than it saves bytes.
  sections.gather(kDirection, state.direction, num_particles);
  sections.keep_plain();
  sections.gather(kWeight, state.weight, num_particles);
  if (2 * num_resampled(state, sections.pixels()) < sections.pixels().size()) sections.keep_plain();
  sections.gather(kSite, state.site, num_particles);
  const auto is_set = [](std::byte site) { return site != std::byte{0}; };
  if (std::ranges::any_of(sections.last_payload(), is_set)) sections.keep_plain();

  if (populations > 1) {
    ByteWriter writer;
    writer.put(state.num_populations);
    sections.add(kPopulations, 1, writer.take());
  }
  if (!state.memory.empty()) {
    MemoryPayloads memory = encode_memory(state.memory, sections.pixels());
    sections.add(kMemorySummary, kMemorySummaryStride, std::move(memory.summaries));
    sections.add(kMemoryMasks, 1, std::move(memory.masks));
    sections.add(kMemoryCells, kMemoryCellStride, std::move(memory.cells));
    sections.keep_plain();
    sections.add(kMemoryLightNoise, kMemoryCellStride, std::move(memory.light_noise));
    sections.add(kMemoryLobeNoise, kMemoryCellStride, std::move(memory.lobe_noise));
  }
  if (!state.confidence.empty()) sections.gather(kConfidence, state.confidence, 1);
  return sections.encode();
}

Result<SampleState> decode_state(ByteView bytes, const std::string& name) {
  BATON_ASSIGN(const SectionFile file, decode_section_file(bytes, kMagic, kStateVersion, name));
  BATON_TRY(check_known_sections(file, kTags, name));

  // Read what sizes the arrays, then the arrays.
  SampleState state;
  BATON_TRY(decode_meta(file, name, state));
  BATON_TRY(decode_populations(file, name, state));
  BATON_TRY(decode_sources(file, name, state));
  const std::vector<std::size_t> pixels = surface_pixels(state);
  const auto num_particles = static_cast<std::size_t>(state.num_particles);
  const auto populations = static_cast<std::size_t>(state.num_populations);
  BATON_TRY(scatter(file, kLns, pixels, populations, name, state.lns));
  BATON_TRY(scatter(file, kLnsFresh, pixels, populations, name, state.lns_fresh));
  BATON_TRY(scatter(file, kDirection, pixels, num_particles, name, state.direction));
  BATON_TRY(scatter(file, kWeight, pixels, num_particles, name, state.weight));
  BATON_TRY(scatter(file, kSite, pixels, num_particles, name, state.site));
  BATON_TRY(decode_memory(file, pixels, name, state));
  if (file.find(kConfidence) != nullptr) {
    state.add_confidence();
    BATON_TRY(scatter(file, kConfidence, pixels, 1, name, state.confidence));
  }

  // Check every value.
  for (const std::size_t pixel : pixels) {
    for (std::size_t k = 0; k < populations; ++k) {
      if (const Status checked = check_population(state, pixel, k); !checked) {
        return Error{checked.error().kind,
                     fmt::format("{}: section {}", name, checked.error().message)};
      }
    }
  }
  return state;
}

Result<std::vector<SectionInfo>> state_sections(ByteView bytes, const std::string& name) {
  return list_sections(bytes, kMagic, kStateVersion, name);
}

}  // namespace baton

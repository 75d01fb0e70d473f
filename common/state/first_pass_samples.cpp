#include "common/state/first_pass_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "common/base/limits.h"
#include "common/base/section_file.h"

namespace baton {
namespace {

constexpr SectionTag kMagic{'B', 'F', 'S', '1'};
constexpr std::uint16_t kVersion = 1;
constexpr SectionTag kMeta{'M', 'E', 'T', 'A'};
constexpr SectionTag kFlags{'F', 'L', 'G', '_'};
constexpr SectionTag kCount{'C', 'N', 'T', '_'};
constexpr SectionTag kLns{'L', 'N', 'S', '_'};
constexpr SectionTag kSlot{'S', 'L', 'O', 'T'};
constexpr SectionTag kSite{'S', 'I', 'T', 'E'};
constexpr SectionTag kDirection{'D', 'I', 'R', '_'};
constexpr SectionTag kEnergy{'E', 'N', 'R', 'G'};
constexpr std::array kTags{kMeta, kFlags, kCount, kLns, kSlot, kSite, kDirection, kEnergy};
constexpr std::size_t kMetaBytes = 2 * sizeof(std::uint64_t) + 8 * sizeof(std::int32_t);

template <class T>
Section section(const SectionTag& tag, const std::vector<T>& values) {
  const ByteView bytes = std::as_bytes(std::span(values));
  return {tag, true, sizeof(T), Bytes(bytes.begin(), bytes.end())};
}

template <class T>
Status read(const SectionFile& file, const SectionTag& tag, std::size_t count,
            const std::string& name, std::vector<T>& values) {
  BATON_ASSIGN(const ByteView payload, section_payload(file, tag, count * sizeof(T), name));
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), payload.data(), payload.size());
  return {};
}

/// Fills everything but the arrays.
Status decode_meta(const SectionFile& file, const std::string& name, FirstPassSamples& s) {
  BATON_ASSIGN(const ByteView payload, section_payload(file, kMeta, kMetaBytes, name));
  ByteReader reader(payload);
  s.picture.high = reader.get<std::uint64_t>();
  s.picture.low = reader.get<std::uint64_t>();
  s.step = Step(reader.get<std::int32_t>());
  for (std::int32_t* value : {&s.tile, &s.rect.x0, &s.rect.y0, &s.rect.x1, &s.rect.y1, &s.num_slots,
                              &s.num_populations}) {
    *value = reader.get<std::int32_t>();
  }
  const bool good = s.step >= Step(0) && s.step < Step(limits::kMaxFrames) && s.tile >= 0 &&
                    s.rect.fits_within(limits::kMaxImageSide, limits::kMaxOverscan) &&
                    s.num_slots >= 1 && s.num_slots <= limits::kMaxParticles &&
                    (s.num_populations == 1 || s.num_populations == 2) &&
                    s.num_slots % s.num_populations == 0;
  if (good) return {};
  return Error{ErrorKind::bad_input,
               fmt::format("{}: section META: frame index {}, tile {}, rectangle [{}, {}) x [{}, "
                           "{}), {} samples in {} "
                           "populations, expected values within the limits",
                           name, s.step, s.tile, s.rect.x0, s.rect.x1, s.rect.y0, s.rect.y1,
                           s.num_slots, s.num_populations)};
}

/// Checks the values of the samples, pixel by pixel.
Status check_values(const FirstPassSamples& s, const std::string& name) {
  const auto fail = [&](const SectionTag& tag, const std::string& what) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: section {}: {}", name, tag_text(tag), what)};
  };
  const auto bad_number = [](float v) { return !(std::isfinite(v) && v >= 0); };
  if (std::any_of(s.flags.begin(), s.flags.end(), [](std::uint8_t f) { return f > 7; }))
    return fail(kFlags, "an unknown flag");
  if (std::any_of(s.lns.begin(), s.lns.end(), bad_number))
    return fail(kLns, "expected finite numbers >= 0");
  if (std::any_of(s.energy.begin(), s.energy.end(), bad_number))
    return fail(kEnergy, "expected finite numbers >= 0");
  if (std::any_of(s.site.begin(), s.site.end(),
                  [](std::uint8_t site) { return site >= limits::kMaxSites; }))
    return fail(kSite, fmt::format("expected sites 0 to {}", limits::kMaxSites - 1));
  std::size_t i = 0;
  for (const std::uint8_t count : s.count) {
    int last = -1;
    for (const std::size_t end = i + count; i < end; ++i) {
      if (s.slot[i] <= last || s.slot[i] >= s.num_slots)
        return fail(kSlot, fmt::format("expected ascending slots below {}", s.num_slots));
      last = s.slot[i];
    }
  }
  return {};
}

}  // namespace

void FirstPassSamples::keep_possible(std::int32_t radius) {
  // A pixel is possible near a failed ray, or so near the border that a failed ray outside may
  // reach it.
  const std::int32_t width = rect.width();
  const std::int32_t height = rect.height();
  const auto failed = [&](std::int32_t x, std::int32_t y) {
    return (flags[static_cast<std::size_t>(y * width + x)] & ~kSurface) != 0;
  };
  const auto possible = [&](std::int32_t x, std::int32_t y) {
    if (x < radius || y < radius || x >= width - radius || y >= height - radius) return true;
    for (std::int32_t v = y - radius; v <= y + radius; ++v) {
      for (std::int32_t u = x - radius; u <= x + radius; ++u) {
        if (failed(u, v)) return true;
      }
    }
    return false;
  };

  // Move what stays to the front.
  std::size_t from = 0;
  std::size_t to = 0;
  for (std::int32_t y = 0; y < height; ++y) {
    for (std::int32_t x = 0; x < width; ++x) {
      std::uint8_t& n = count[static_cast<std::size_t>(y * width + x)];
      const std::size_t end = from + n;
      if (!possible(x, y)) {
        from = end;
        n = 0;
      }
      for (; from < end; ++from, ++to) {
        slot[to] = slot[from];
        site[to] = site[from];
        direction[to] = direction[from];
        energy[to] = energy[from];
      }
    }
  }
  slot.resize(to);
  site.resize(to);
  direction.resize(to);
  energy.resize(to);
}

Bytes encode_first_pass_samples(const FirstPassSamples& s) {
  ByteWriter meta;
  meta.put(s.picture.high);
  meta.put(s.picture.low);
  for (const std::int32_t value : {s.step.value(), s.tile, s.rect.x0, s.rect.y0, s.rect.x1,
                                   s.rect.y1, s.num_slots, s.num_populations}) {
    meta.put(value);
  }
  SectionFile file{
      kMagic,
      kVersion,
      {{kMeta, true, 1, meta.take()}, section(kFlags, s.flags), section(kCount, s.count)}};
  if (!s.lns.empty()) file.sections.push_back(section(kLns, s.lns));
  file.sections.push_back(section(kSlot, s.slot));
  file.sections.push_back(section(kSite, s.site));
  file.sections.push_back(section(kDirection, s.direction));
  file.sections.push_back(section(kEnergy, s.energy));
  return encode_section_file(file);
}

Result<FirstPassSamples> decode_first_pass_samples(ByteView bytes, const std::string& name) {
  BATON_ASSIGN(const SectionFile file, decode_section_file(bytes, kMagic, kVersion, name));
  BATON_TRY(check_known_sections(file, kTags, name));
  FirstPassSamples s;
  BATON_TRY(decode_meta(file, name, s));

  // The counts size everything else.
  BATON_TRY(read(file, kFlags, s.num_pixels(), name, s.flags));
  BATON_TRY(read(file, kCount, s.num_pixels(), name, s.count));
  const std::size_t num_samples = std::accumulate(s.count.begin(), s.count.end(), std::size_t{0});
  if (file.find(kLns) != nullptr) {
    BATON_TRY(read(file, kLns, s.num_pixels() * static_cast<std::size_t>(s.num_populations), name,
                   s.lns));
  }
  BATON_TRY(read(file, kSlot, num_samples, name, s.slot));
  BATON_TRY(read(file, kSite, num_samples, name, s.site));
  BATON_TRY(read(file, kDirection, num_samples, name, s.direction));
  BATON_TRY(read(file, kEnergy, num_samples, name, s.energy));
  BATON_TRY(check_values(s, name));
  return s;
}

}  // namespace baton

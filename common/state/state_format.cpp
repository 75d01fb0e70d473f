#include "common/state/state_format.h"

#include <fmt/format.h>

#include <numeric>

namespace baton {
namespace {

std::vector<std::size_t> surface_pixels(const SampleState& state) {
  std::vector<std::size_t> pixels;
  const auto populations = static_cast<std::size_t>(state.num_populations);
  for (std::size_t i = 0; i < state.num_pixels(); ++i) {
    if (state.source[i * populations] != PixelSource::background) pixels.push_back(i);
  }
  return pixels;
}

}  // namespace

StateWriter::StateWriter(const SampleState& state)
    : num_pixels_(state.num_pixels()), pixels_(surface_pixels(state)) {}

void StateWriter::add(const SectionTag& tag, std::size_t stride, Bytes payload) {
  owned_.push_back(std::move(payload));
  views_.push_back(
      {.tag = tag, .stride = static_cast<std::uint8_t>(stride), .payload = owned_.back()});
}

void StateWriter::gather(const SectionTag& tag, std::size_t stride, const StatePlane& plane) {
  if (pixels_.size() == num_pixels_) {
    views_.push_back(
        {.tag = tag, .stride = static_cast<std::uint8_t>(stride), .payload = plane.bytes});
    return;
  }
  Bytes payload;
  payload.reserve(pixels_.size() * plane.each_bytes);
  for (const std::size_t pixel : pixels_) {
    const ByteView row = ByteView(plane.bytes).subspan(pixel * plane.each_bytes, plane.each_bytes);
    payload.insert(payload.end(), row.begin(), row.end());
  }
  add(tag, stride, std::move(payload));
}

void StateWriter::keep_plain() {
  views_.back().stride = 1;
  views_.back().packing = Packing::none;
}

StateReader::StateReader(const SectionFile& file, const std::string& name, const SampleState& state)
    : file_(file), name_(name), rect_(state.rect), pixels_(surface_pixels(state)) {}

Status StateReader::scatter(const SectionTag& tag, StatePlane& plane) const {
  const std::size_t size = plane.each_bytes;
  BATON_ASSIGN(const ByteView from, payload(tag, pixels_.size() * size));
  if (size == 0) return {};
  for (std::size_t i = 0; i < pixels_.size(); ++i)
    std::memcpy(plane.bytes.data() + pixels_[i] * size, from.data() + i * size, size);
  return {};
}

Error StateReader::wrong_value(const SectionTag& tag, std::size_t pixel,
                               const std::string& what) const {
  const auto width = static_cast<std::size_t>(rect_.width());
  return {ErrorKind::bad_input,
          fmt::format("{}: section {}: pixel ({}, {}): {}", name_, tag_text(tag),
                      rect_.x0 + pixel % width, rect_.y0 + pixel / width, what)};
}

std::size_t StateFormat::most_stored_bytes(std::int32_t num_particles,
                                           std::int32_t num_populations) const {
  const auto sizes = pixel_bytes(num_particles, num_populations);
  return std::accumulate(sizes.begin(), sizes.end(),
                         static_cast<std::size_t>(num_populations) * sizeof(PixelSource));
}

}  // namespace baton

#pragma once

// A small state and the inside of its file, for tests that spoil it.
#include <gtest/gtest.h>

#include <string>

#include "common/base/section_file.h"
#include "common/state/sample_planes.h"

namespace baton {

inline constexpr SectionTag kMagic{'B', 'S', 'T', '1'};

/// A background pixel and a surface pixel of two particles.
inline SampleState tiny_state() {
  SampleState state;
  state.picture = {0x0011223344556677ull, 0x8899aabbccddeeffull};
  state.step = Step(5);
  state.tile = 7;
  state.resize(sample_format(), {10, 20, 12, 21}, 2);
  const SamplePlanes samples(state);
  state.source[1] = PixelSource::carried;
  samples.lns[1] = 1.5f;
  samples.lns_fresh[1] = 2.0f;
  samples.direction[2] = 0x80017fffu;
  samples.direction[3] = 0x12345678u;
  samples.weight[2] = 0.25f;
  samples.weight[3] = 0.75f;
  samples.site[2] = 3;
  samples.site[3] = 15;
  return state;
}

/// The container inside a state, to change it with good checksums.
inline SectionFile sections_of(const SampleState& state) {
  return *decode_section_file(encode_state(state), kMagic, kStateVersion, "t.bst");
}

/// The error that decoding `file` gives; its message is empty when decoding works.
inline Error error_of(const SectionFile& file) {
  const Result<SampleState> decoded = decode_state(encode_section_file(file), "t.bst");
  return decoded ? Error{ErrorKind::internal, ""} : decoded.error();
}

inline Section& section(SectionFile& file, const std::string& tag) {
  for (Section& s : file.sections) {
    if (tag_text(s.tag) == tag) return s;
  }
  ADD_FAILURE() << "no section " << tag;
  return file.sections.front();
}

}  // namespace baton

#pragma once

#include <cstring>
#include <deque>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/section_file.h"
#include "common/state/sample_state.h"

namespace baton {

/// The sections of a state file while it is written. Values of surface pixels are gathered only
/// where there are others.
class StateWriter {
 public:
  explicit StateWriter(const SampleState& state);

  /// 0-based indices of the pixels that carry something, ascending.
  const std::vector<std::size_t>& pixels() const { return pixels_; }
  /// Adds a section with bytes of its own. stride: bytes of an element.
  void add(const SectionTag& tag, std::size_t stride, Bytes payload);
  /// Adds a section with what each surface pixel has in a plane.
  void gather(const SectionTag& tag, std::size_t stride, const StatePlane& plane);
  /// Has the section that was added last stored as it is.
  void keep_plain();
  ByteView last_payload() const { return views_.back().payload; }
  std::span<const SectionView> sections() const { return views_; }

 private:
  const std::size_t num_pixels_;
  const std::vector<std::size_t> pixels_;
  std::deque<Bytes> owned_;
  std::vector<SectionView> views_;
};

/// A state file while it is read. All errors name file and section.
class StateReader {
 public:
  StateReader(const SectionFile& file, const std::string& name, const SampleState& state);

  const std::vector<std::size_t>& pixels() const { return pixels_; }
  bool has(const SectionTag& tag) const { return file_.find(tag) != nullptr; }
  /// The payload of a section that must have so many bytes.
  Result<ByteView> payload(const SectionTag& tag, std::size_t size_bytes) const {
    return section_payload(file_, tag, size_bytes, name_);
  }
  /// Inverse of StateWriter::gather; all other pixels are left as they are.
  Status scatter(const SectionTag& tag, StatePlane& plane) const;
  /// "NAME: section TAG_: pixel (x, y): WHAT", of kind bad_input.
  Error wrong_value(const SectionTag& tag, std::size_t pixel, const std::string& what) const;

 private:
  const SectionFile& file_;
  const std::string& name_;
  const PixelRect rect_;
  const std::vector<std::size_t> pixels_;
};

/// What the planes of a method's states are, and how they lie in a file. One object a format, which
/// lasts as long as the program and names it.
class StateFormat {
 public:
  virtual ~StateFormat() = default;

  /// The plane of the blocks that a pixel's rays go into: pixels that see a catcher of shadows have
  /// one of their own in jobs that have catchers.
  static constexpr std::size_t block_plane_of(bool sees_catcher) { return sees_catcher ? 1 : 0; }

  /// Fewest particles of a pixel.
  virtual std::int32_t fewest_particles() const { return 0; }
  /// Bytes of a pixel in each plane.
  virtual std::vector<std::size_t> pixel_bytes(std::int32_t num_particles,
                                               std::int32_t num_populations) const = 0;
  /// Bytes of a block in each plane of the blocks.
  virtual std::vector<std::size_t> block_bytes() const { return {}; }
  /// Bytes of a block in a file before packing, at most.
  virtual std::size_t most_stored_block_bytes() const { return 0; }
  /// Bytes of a pixel in a file before packing, at most, its source among them.
  virtual std::size_t most_stored_bytes(std::int32_t num_particles,
                                        std::int32_t num_populations) const;
  /// Tags of its sections, beside those of the header.
  virtual std::vector<SectionTag> tags() const = 0;
  /// Adds its sections to those of the header.
  virtual void encode(const SampleState& state, StateWriter& out) const = 0;
  /// Fills the planes, which are all zero, and checks every value.
  virtual Status decode(const StateReader& from, SampleState& state) const = 0;

  /// The site of now that inherits what particle `particle` found at a site of then.
  using HeirOf = std::function<std::uint8_t(std::uint8_t site, std::size_t particle)>;
  /// Moves what a pixel carries to other sites.
  virtual void move_to_sites(SampleState& /*state*/, std::size_t /*pixel*/,
                             const HeirOf& /*heir_of*/) const {}

  /// A block of the frame before, and how many pixels of a block of now come from it, of those
  /// that a plane of the blocks is of.
  struct BlockSource {
    const SampleState* state;
    std::size_t block;
    std::size_t plane;
    std::int32_t num_pixels;
  };
  /// Fills what a block carries, all zero, where surfaces have moved.
  virtual void inherit_block(std::span<const BlockSource> /*sources*/, SampleState& /*state*/,
                             std::size_t /*block*/) const {}
};

}  // namespace baton

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/job/job_spec.h"
#include "common/math/padded_array.h"
#include "common/math/philox.h"
#include "worker/exchange/pixel_mask.h"
#include "worker/exchange/reflected.h"

namespace baton {

/// The second pass of correlated visibility [Ghosh & Heidrich 2006, section 4]: each free sample of
/// a masked pixel x is offered, once in each partition of the image into squares, to another masked
/// pixel x' of its square. Accepted with probability a, its energy is seen from x' along the same
/// direction, else from x; both shares are booked as expectations. Knows no scene: surfaces, light
/// and rays are behind ExchangeScene.
///
/// `corrected`: a = V'(w) min(1, p~'(w) / p~(w)). The mutation keeps the direction, so its density
/// is t(x -> x') delta(w' - w) with t symmetric, and the flow t p~ V a = t V V' min(p~, p~') is the
/// same both ways: for a mask that does not depend on these samples no pixel gains or loses.
/// `published` [eq. 7, 8]: a = V'(w) min(1, Lns' / Lns), and what is refused is lost.
/// `published-kept`: it is kept. Both are biased where the products of a square differ: by sum_x' t
/// min(Lns, Lns') int V V' (p' - p) for the kept form.

/// A free sample of the first pass. Its colour per energy is radiance / target of `reflected`.
struct GiverSample {
  /// Its position among the samples of the pixel, [0, num_slots).
  std::uint32_t slot = 0;
  float energy = 0;  ///< u_j, mean over RGB; positive
  /// Its contribution at its own site; target above kSmallestTarget.
  Reflected reflected;
};

/// A pixel whose samples are offered.
struct Giver {
  std::int32_t x = 0, y = 0;
  std::uint32_t rank = 0;      ///< as in Offer
  std::size_t end_sample = 0;  ///< out: where its samples end in the batch
};

/// "May this sample be seen from there?"
struct Offer {
  std::uint32_t sample = 0;  ///< position in the batch
  /// Pixel: PixelMask::ranks of the pixels to recompute.
  std::uint32_t receiver = 0;
  std::uint32_t surface = 0;  ///< receiver * num_sites + site
};

/// The answer is what the receiver reflects of the sample's light; nothing without a surface, below
/// a horizon, or when the way is blocked. Kernels write past the end of their output by this many.
inline constexpr std::size_t kReceptionPadding = kVectorPadding;
/// Smaller targets count as none: their reciprocal may not be finite.
inline constexpr float kSmallestTarget = 1e-37f;

class ExchangeScene {
 public:
  virtual ~ExchangeScene() = default;
  /// Puts the free samples of some pixels, one pixel after the other, in place of the last batch.
  virtual void load_samples(std::span<Giver> givers, std::vector<GiverSample>& batch) = 0;
  /// Answers offers of samples of the batch. receptions: kReceptionPadding longer than the offers.
  virtual void receive(std::span<const Offer> offers, std::span<Reflected> receptions) = 0;
  /// (ranks) Lns of the pixels as their samples have it; for the published forms only.
  virtual std::span<const float> lns() const = 0;
};

struct ExchangeSettings {
  SecondPassForm form = SecondPassForm::corrected;
  std::uint32_t num_slots = 16;  ///< samples per pixel
  std::uint32_t num_sites = 1;
  /// Tells the random numbers of several exchanges apart.
  std::uint32_t fold = 0;
  std::uint64_t job_seed = 0;
  std::int32_t frame = 0;
  std::int32_t image_width = 0;
};

/// Adds the second-pass radiance of the `recompute` pixels of `inner` to `radiance` (inner pixels,
/// row by row). Pixels of `exchange` (a part of `recompute`, the same rectangle) give and receive;
/// the others keep what they have. Both masks must reach one square's side - 1 past `inner`, or to
/// the border of the image. The sums do not depend on `inner`.
void exchange_energy(const ExchangeSettings& settings, const SquarePartitions& partitions,
                     const PixelMask& exchange, const PixelMask& recompute, const PixelRect& inner,
                     ExchangeScene& scene, std::span<Rgb> radiance);

}  // namespace baton

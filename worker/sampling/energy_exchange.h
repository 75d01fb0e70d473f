#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/job/job_spec.h"
#include "common/math/philox.h"
#include "worker/sampling/pixel_mask.h"
#include "worker/sampling/reflected.h"

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
  std::uint32_t slot = 0;  ///< its position among the samples of the pixel, [0, num_slots)
  float energy = 0;        ///< u_j, mean over RGB; positive
  float lns = 0;           ///< of its pixel; read by the published forms only
  Reflected reflected;     ///< at its own site; target above kSmallestTarget
};

/// "May this sample be seen from there?"
struct Offer {
  std::uint32_t sample = 0;    ///< position in the batch
  std::uint32_t receiver = 0;  ///< pixel: position in the rectangle of the exchange mask
  std::uint32_t site = 0;      ///< site of the receiver, [0, num_sites)
};

/// The answer is what the receiver reflects of the sample's light; nothing without a surface, below
/// a horizon, or when the way is blocked. Kernels write past the end of their output by this many.
inline constexpr std::size_t kReceptionPadding = 16;
/// Smaller targets count as none: their reciprocal may not be finite.
inline constexpr float kSmallestTarget = 1e-37f;

class ExchangeScene {
 public:
  virtual ~ExchangeScene() = default;
  /// Appends the free samples of a pixel to the batch.
  virtual void append_samples(std::int32_t x, std::int32_t y, std::vector<GiverSample>& batch) = 0;
  /// Answers offers of samples of the batch. receptions: kReceptionPadding longer than the offers.
  virtual void receive(std::span<const Offer> offers, std::span<Reflected> receptions) = 0;
  /// Lns of a pixel (position in the rectangle of the exchange mask) as its givers have it; asked
  /// for by the published forms only.
  virtual float lns(std::uint32_t receiver) const = 0;
};

struct ExchangeSettings {
  SecondPassForm form = SecondPassForm::corrected;
  std::uint32_t num_slots = 16;  ///< samples per pixel
  std::uint32_t num_sites = 1;
  std::uint32_t fold = 0;  ///< tells the random numbers of several exchanges apart
  std::uint64_t job_seed = 0;
  std::uint32_t frame = 0;
  std::int32_t image_width = 0;
};

/// One use of the first pass's populations: whose failed rays make the mask, whose free samples are
/// exchanged.
struct Fold {
  int mask_population = -1;   ///< -1: all
  int giver_population = -1;  ///< -1: all
  float energy_scale = 1;
};
/// The folds of a policy; the picture is their sum when energies are those of all populations
/// together.
std::span<const Fold> folds_of(MaskPolicy policy);

/// Adds the second-pass radiance of the `recompute` pixels of `inner` to `radiance` (inner pixels,
/// row by row). Pixels of `exchange` (a part of `recompute`, the same rectangle) give and receive;
/// the others keep what they have. Both masks must reach one square's side - 1 past `inner`, or to
/// the border of the image. The sums do not depend on `inner`.
void exchange_energy(const ExchangeSettings& settings, const SquarePartitions& partitions,
                     const PixelMask& exchange, const PixelMask& recompute, const PixelRect& inner,
                     ExchangeScene& scene, std::span<Rgb> radiance);

}  // namespace baton

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/job/job_spec.h"
#include "worker/accel/geometry_sequence.h"
#include "worker/bounce/bounce_group.h"
#include "worker/light/presampled_light.h"

namespace baton {

struct SurfaceCandidate;

/// What a pixel's paths begin with.
struct BounceStart {
  /// At least one of them sees a surface, or a catcher.
  const SiteBlock& sites;
  std::span<const SurfaceHit> hits;  ///< (S) what they are made of
  /// Candidates for the light of all surfaces on the way; must outlive the walk.
  const PresampledLight& presampled;
  RngKey key;  ///< of the pixel in its round
  /// Who shares what it finds.
  BounceGroup group = {};
  /// A draw that no image has (noise_probe.h): with points of its own.
  bool is_aside = false;
};

/// Light that reaches pixels over other surfaces: paths of at most `bounces` surfaces beside the
/// one that is seen. A pixel draws directions of its sites' BRDFs in a round, by one
/// low-discrepancy sequence over paths and rounds, so they may not depend on what earlier rounds
/// found. A surface that a path meets is lit by a few candidates of the presampled light, of which
/// some are kept and traced [Talbot et al. 2005], where it is glossy also by one of its BRDF
/// (balance heuristic); it adds what it emits; and under Russian roulette the path goes on. What
/// misses all surfaces adds nothing: the method has counted it.
///
/// Pixels share what they find: 16 of a block of the picture, in each round others (BounceGroup),
/// draw from one sequence. What a surface that one of them has met reflects alike to all sides is
/// handed to all that see it, in proportion to the density with which each would have met it
/// (balance heuristic over the traced visibilities); the rest goes to the one that has met it, for
/// which a pixel has more paths where the scene has metal. So the pixels of a group are in one
/// walk. Where the sites of a pixel reflect sharply, so that others meet nothing for it, its paths
/// are its own.
///
/// Unbiased, unless glossy surfaces behind rough ones are made rougher (LightSpec::filter_glossy).
class BounceWalk {
 public:
  static constexpr std::uint32_t kPaths = limits::kBouncePaths,
                                 kSharedPaths = limits::kSharedBouncePaths;

  /// spec.bounces > 0. geometry: of the frame, must outlive the object.
  BounceWalk(const LightSpec& spec, const FrameGeometry& geometry);

  /// Starts the paths of pixel `pixel` of a walk.
  void add(std::uint32_t pixel, const BounceStart& start);
  /// Follows all paths that were started, and forgets them. light: of the round. found: (pixels),
  /// is added to: the mean over the sites of each pixel, those without a surface included.
  void follow(const EnvironmentView& light, std::span<Rgb> found);

  /// Rays traced so far, of all kinds.
  std::uint64_t num_rays() const { return num_rays_; }

 private:
  /// What is the same for the paths of a pixel.
  struct Start {
    const PresampledLight* presampled;
    RngKey key;
  };
  /// What the first piece of a path brings: all that comes along it; that but for what is shared,
  /// which is handed out in an exchange; or only the rest.
  enum class Kind : std::uint8_t { alone, member, rest };
  /// The first piece of a path, and what comes along it.
  struct First {
    std::uint32_t pixel;  ///< of the walk
    /// Light of the pixel per radiance.
    Rgb weight;
    Kind kind;
    Rgb radiance{};
    /// Part of it that the surface at the end sends alike to all sides. Where rays from that start,
    /// and its geometric normal.
    Rgb shared{};
    Vec3 origin{}, ng{};
  };
  /// A path on its way to the next surface.
  struct Path {
    Ray ray;
    /// Radiance of its first piece, and the part of it that is shared, per radiance along the ray.
    Rgb throughput, shared;
    /// Of the cone that textures are averaged over: its width at the origin, and its growth per
    /// distance.
    float width = 0, spread = 0;
    /// Density of the roughest scattering so far, 1/sr.
    float least_pdf = 0;
    std::uint32_t first = 0;   ///< index into firsts_
    std::uint32_t number = 0;  ///< of the path in its pixel
    std::uint32_t start = 0;   ///< index into starts_
  };
  /// A shadow ray's light.
  struct Lit {
    std::uint32_t first;  ///< index into firsts_
    Rgb radiance, shared;
  };
  /// A surface that takes part in an exchange.
  struct Member {
    Vec3 origin;
    std::uint32_t pixel;  ///< of the walk
    std::int32_t first;   ///< index of its path, or -1: it has none
  };
  /// The members of a group, at one of their paths.
  struct Exchange {
    BounceGroup group;
    std::uint32_t path;
    bool is_aside;
    std::vector<Member> members;
    SiteBlock sites;  ///< what members see
  };
  struct Surfaces;

  void add_own(std::uint32_t pixel, const BounceStart& start, std::uint32_t first_path, Kind kind);
  void add_member(std::uint32_t pixel, const BounceStart& start);
  void push_path(std::uint32_t pixel, const SurfaceHit& hit, const Vec3& direction, float pdf,
                 std::uint32_t number, const Rgb& weight, Kind kind);
  bool is_wanted(std::size_t path, std::int32_t bounce) const;
  Exchange& exchange_of(const BounceStart& start, std::uint32_t path);
  void shade(std::span<const std::size_t> met, std::int32_t bounce, const EnvironmentView& light);
  void light_up(const Surfaces& at, std::int32_t bounce, const EnvironmentView& light);
  void keep_some(const Surfaces& at, std::size_t i, std::span<const SurfaceCandidate> candidates,
                 float u);
  void go_on(const Surfaces& at, std::int32_t bounce);
  void share(const Exchange& exchange, std::span<Rgb> found);
  Rng random_of(const Path& path) const;

  const LightSpec& spec_;
  bool has_metal_ = false;  ///< much is reflected otherwise than alike
  const FrameGeometry& geometry_;
  std::vector<Start> starts_;
  std::vector<First> firsts_;
  std::vector<Path> paths_, next_;
  /// The first num_exchanges_; the others are memory.
  std::vector<Exchange> exchanges_;
  std::size_t num_exchanges_ = 0;
  std::vector<Ray> rays_;
  std::vector<SurfaceHit> hits_;
  ShadowRays shadows_;
  std::vector<Lit> lit_;  ///< (shadows_) what each adds if it is free
  std::uint64_t num_rays_ = 0;
};

}  // namespace baton

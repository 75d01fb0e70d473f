#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/digest.h"
#include "common/job/file_sequence.h"
#include "common/job/method.h"
#include "common/job/scene_spec.h"
#include "common/math/pixel_rect.h"
#include "common/math/vec3.h"

namespace baton {

/// Everything a job says, with every default filled in. Plain data: JSON is known only to
/// job_json.cpp. Units: lengths in scene units, angles in degrees, colours linear RGB. Paths are
/// absolute after parsing.

// ---- image --------------------------------------------------------------------------------------
/// From where in a pixel, and around it, its light comes. Widths are those of Cycles at 1.5.
enum class PixelFilter : std::uint8_t {
  box,              ///< the pixel
  gaussian,         ///< sigma .375 px, to 2.25 from the centre
  blackman_harris,  ///< to 1.5 pixels from the centre
};

/// Pixels that are rendered around an image, [0, limits::kMaxOverscan] each.
struct Overscan {
  int left = 0, top = 0, right = 0, bottom = 0;

  bool operator==(const Overscan&) const = default;
  PixelRect around(const PixelRect& rect) const {
    return {rect.x0 - left, rect.y0 - top, rect.x1 + right, rect.y1 + bottom};
  }
};

struct ImageSpec {
  /// Pixels of the whole image, [1, limits::kMaxImageSide].
  int width = 640;
  int height = 360;  ///< pixels
  int sites = 1;     ///< primary rays per pixel: 1, 4, 9 or 16
  /// Sites where geometry is fine, at most: `sites` times a power of 4. 0: `sites`.
  int max_sites = 0;
  PixelFilter filter = PixelFilter::box;
  /// Side of a farm tile in pixels; no pixel depends on it.
  int tile_size = 64;
  /// The part that is shown, inside the whole; none: all.
  std::optional<PixelRect> region{};
  Overscan overscan{};  ///< around what is shown
  /// Seed of the sites' places in their pixels; 0: the job's seed.
  std::uint64_t site_seed = 0;

  bool operator==(const ImageSpec&) const = default;
  /// Pixels are always addressed by their place in the whole image, the display window of frames.
  PixelRect whole() const { return {0, 0, width, height}; }
  /// What people see of frames.
  PixelRect shown() const { return region.value_or(whole()); }
  /// The pixels that are rendered: the data window of frames.
  PixelRect rendered() const { return overscan.around(shown()); }
  /// Most sites that a pixel has.
  int most_sites() const { return std::max(sites, max_sites); }
  /// The whole image with its overscan; every region lies inside with its own.
  PixelRect extent() const { return overscan.around(whole()); }
};

/// The image with its sides times `scale`, (0, 1]; region and overscan grow to whole pixels.
ImageSpec scaled(const ImageSpec& image, double scale);

// ---- motion -------------------------------------------------------------------------------------
/// How keys are joined. linear: straight lines. smooth: Catmull-Rom splines through the keys.
/// Quaternions are slerped either way; before the first key and after the last one the pose stays.
enum class KeyCurve : std::uint8_t { linear, smooth };

/// How samples follow what moves; says nothing when nothing does (common/job/motion.h).
struct MotionSpec {
  KeyCurve curve = KeyCurve::smooth;
  /// How far history is followed per frame, in either direction; 0: derived from the scene.
  int max_px = 0;
  /// History is taken from within this share of the depth off the surface, (0, 1].
  float depth_tolerance = 0.02f;
  /// History is taken from where shading normals differ by at most so much, [0, 180].
  float normal_tolerance_deg = 25;

  bool operator==(const MotionSpec&) const = default;
};

// ---- camera -------------------------------------------------------------------------------------
struct CameraKey {
  double frame = 1;
  Vec3 position{};
  Vec3 look_at{};
  Vec3 up{0, 1, 0};
  std::optional<float> vertical_fov_deg{};  ///< none: the camera's

  bool operator==(const CameraKey&) const = default;
};

/// See CameraSpec::node.
inline constexpr const char* kFirstCamera = "*";

enum class Projection : std::uint8_t { perspective, orthographic };

/// With keys, these say where the camera is and what it looks at.
struct CameraSpec {
  Vec3 position{0, 0, 5};
  Vec3 look_at{0, 0, 0};
  Vec3 up{0, 1, 0};
  float vertical_fov_deg = 40;  ///< perspective: (0, 180)
  Projection projection = Projection::perspective;
  float orthographic_height = 2;  ///< height of the image, > 0
  /// How far the image is moved to the right and up, in its heights.
  std::array<float, 2> shift{};
  float aperture = 0;             ///< diameter of the lens; 0: a pinhole
  float focus_distance = 0;       ///< along the view; 0: as far as look_at
  std::vector<CameraKey> keys{};  ///< ascending frames
  std::optional<GltfMotion> gltf{};
  /// The camera of scene.gltf that is taken, by the name of its node; kFirstCamera: the first one.
  std::string node{};
  /// What the job says instead of the file, of a camera that `gltf` or `node` names; one at most.
  std::optional<float> own_vertical_fov_deg{}, own_orthographic_height{};

  bool operator==(const CameraSpec&) const = default;
};

// ---- environment --------------------------------------------------------------------------------
enum class MapFilter : std::uint8_t { nearest, bilinear };

/// The map at one frame number; between keys the texels are interpolated linearly, outside they
/// stay.
struct EnvironmentKey {
  double frame = 1;
  std::string map;  ///< lat-long .exr or .hdr

  bool operator==(const EnvironmentKey&) const = default;
};

/// A number at a frame number; linear between keys, constant outside.
struct NumberKey {
  double frame = 1;
  double value = 0;

  bool operator==(const NumberKey&) const = default;
};

/// A map that the camera sees and that lights nothing.
struct CameraMapSpec {
  /// Lat-long .exr or .hdr; empty: the camera sees the map that lights.
  std::string file{};
  float scale = 1;  ///< radiance factor, (0, inf)

  bool operator==(const CameraMapSpec&) const = default;
};

/// The light around the scene. Numbered frames are keys at every frame with `interpolate` false:
/// the last key at or before the frame is taken.
struct EnvironmentSpec {
  std::vector<EnvironmentKey> keys;  ///< sorted by frame, at least one
  bool interpolate = true;
  MapFilter filter = MapFilter::bilinear;
  float scale = 1;                      ///< radiance factor, [0, inf)
  std::vector<NumberKey> scale_keys{};  ///< further factors, >= 0; ascending frames
  /// Wider maps are reduced to so many columns, [0, limits::kMaxEnvironmentSide]; 0: none.
  int max_width = 0;
  Vec3 rotation_axis{0, 1, 0};
  std::int32_t rotation_start_frame = 1;
  /// Angle at rotation_start_frame, whichever frames the job has.
  double rotation_start_deg = 0;
  double rotation_deg_per_frame = 0;
  /// Degrees, in place of start and rate; ascending frames.
  std::vector<NumberKey> rotation_keys{};
  CameraMapSpec camera_map{};  ///< turned like the others

  bool operator==(const EnvironmentSpec&) const = default;
};

// ---- light between surfaces --------------------------------------------------------------------
struct LightSpec {
  /// Most surfaces that light meets on its way, beside the one that is seen, [0,
  /// limits::kMaxBounces]. A job file that does not say has limits::kPresetBounces (preset_job).
  int bounces = 0;
  /// Glossy surfaces that are seen by way of rough ones are rougher (worker/bounce).
  bool filter_glossy = true;

  bool operator==(const LightSpec&) const = default;
};

// ---- sampling -----------------------------------------------------------------------------------
enum class ResamplingScheme : std::uint8_t { systematic, stratified, multinomial, residual };
/// How `sequential` carries the normalising constant: by the ratio of the weights, or by path
/// sampling with a left, right or trapezoidal sum over the intermediate distributions.
enum class LnsUpdate : std::uint8_t { ratio, path_left, path_right, path_trapezoid };
/// How the pixels of one material are sampled, where that differs from the rest of the image;
/// members as in SamplingSpec. Samples are drawn anew in each frame, so nothing is handed over
/// between settings.
struct MaterialSampling {
  Method method = Method::bidirectional;  ///< one that draws anew
  int num_particles = 16;
  int num_candidates = 128;
  float brdf_fraction = 0.25f;

  bool operator==(const MaterialSampling&) const = default;
};

struct SamplingSpec {
  Method method = Method::pool;  ///< *holds* in every case of jobs/lab
  /// N: shadow rays per pixel, [1, limits::kMaxParticles].
  int num_particles = 16;
  /// M: SIR candidates, [N, limits::kMaxCandidates].
  int num_candidates = 128;
  /// Share of candidates, [0, 1]. mis: from the BRDF; SIR: at most, from glossy lobes; 1: from the
  /// whole BRDF.
  float brdf_fraction = 0.25f;
  bool mis_compensation = false;  ///< [Karlik et al. 2019]; mis
  /// P: intermediate distributions per frame, [1, limits::kMaxDistributions].
  int num_distributions = 5;
  /// Metropolis-Hastings moves per distribution, [1, limits::kMaxMoves].
  int num_moves = 1;
  LnsUpdate lns_update = LnsUpdate::ratio;
  /// Resample when ESS < ess_ratio_min * N, [0, 1].
  float ess_ratio_min = 0.5f;
  ResamplingScheme resampling = ResamplingScheme::systematic;
  float local_move_deg = 4;                     ///< half-angle of local moves, (0, 90]
  float local_move_fraction = 0.125f;           ///< share of moves that are local, [0, 1]
  Method start_method = Method::bidirectional;  ///< draws anew; for fresh pixels
  /// sequential: each pixel starts afresh once in so many frames, staggered; 0: never.
  int refresh_every = 8;
  /// sequential: a pixel whose carried Lns has left [Lns / rho, Lns * rho] of its last start, rho
  /// in (1, 1e6], starts afresh with refresh_candidates; none: never. The rule depends on the
  /// samples, so it is a (small) bias.
  std::optional<float> refresh_ratio{};
  int refresh_candidates = 800;  ///< [N, limits::kMaxCandidates]
  /// restir: a carried set counts as at most so many fresh ones, [1, limits::kMaxHistoryLimit].
  int history_limit = 20;
  /// restir: pixels of the frame before whose samples a pixel weighs, [0, limits::kMaxNeighbors].
  int num_neighbors = 0;
  /// restir: how far they are from the pixel's history, pixels, [1, limits::kMaxNeighborRadius].
  int neighbor_radius = 30;
  /// restir: only samples whose ray was free are carried on. Unbiased while nothing moves or turns
  /// and no neighbours are asked.
  bool reuse_visibility = false;
  /// automatic: RMSE over mean radiance to reach, (0, 10].
  std::optional<float> target_error{};
  /// automatic: CPU seconds of the whole job to stay within, (0, 1e9].
  std::optional<float> time_budget{};
  /// Paired samples per pixel of `reference`, [2, 2^24].
  int reference_samples = 1024;
  /// By name of a material of the scene: replaces method, N, M and brdf_fraction in the pixels
  /// whose first site with a surface sees it. Not with methods that carry samples, nor with a
  /// second pass.
  std::map<std::string, MaterialSampling> by_material{};

  bool operator==(const SamplingSpec&) const = default;
};

// ---- quality ------------------------------------------------------------------------------------
/// How much of the job's sampling a frame is the mean of.
struct QualitySpec {
  /// K: renderings of a frame, each with other random numbers and sites, [1, limits::kMaxRounds].
  int rounds = 1;
  /// How often the sequence is rendered, K rounds a frame each time; a frame is the mean of its
  /// sweeps. rounds * sweeps <= limits::kMaxRounds.
  int sweeps = 1;
  /// Pixels that are cleaner get fewer of the rounds (worker/pass/adaptive_rounds.h); > 0.
  std::optional<float> adaptive_threshold{};
  /// Films stay after the job, for one of more sweeps.
  bool refinable = false;
  /// The farm adds sweeps until no frame is noisier, in Cycles' measure; > 0.
  std::optional<float> noise_threshold{};
  /// The farm adds no sweep that would end later, s; > 0.
  std::optional<float> time_limit{};
  /// The farm adds no sweep past so many rounds; >= rounds, 0: no limit.
  int max_rounds = 0;

  /// Whether the farm may add sweeps.
  bool may_grow() const { return noise_threshold || time_limit || max_rounds > 0; }

  bool operator==(const QualitySpec&) const = default;
};

// ---- visibility ---------------------------------------------------------------------------------
/// What a second pass does with the pixels whose shadow rays did not all agree.
enum class SecondPassForm : std::uint8_t { corrected, published, published_kept, extra_samples };
/// Which samples decide that a pixel takes part in the second pass, and which are then used.
enum class MaskPolicy : std::uint8_t { same_samples, split, cross_fold };

/// Correlated visibility [Ghosh & Heidrich 2006], after any sampling method but `reference`.
struct VisibilitySpec {
  bool correlated = false;  ///< make the second pass
  SecondPassForm form = SecondPassForm::corrected;
  MaskPolicy mask = MaskPolicy::cross_fold;
  /// Side of the squares in which energy is exchanged, pixels, [2, limits::kMaxExchangeSide].
  int tile_size = 5;
  /// C: offers per free sample, [1, limits::kMaxPartitions].
  int partitions = 16;
  /// The mask grows by so many pixels, [0, limits::kMaxDilation].
  int dilate = 0;

  bool operator==(const VisibilitySpec&) const = default;
};

// ---- output, state, farm ------------------------------------------------------------------------
/// What is seen where no object is: the map, nothing, or an image that the frame is laid over.
enum class Background : std::uint8_t { environment, transparent, plate };
/// Where frames tell what catches shadows: in channels shadow.*, or as black in A.
enum class ShadowForm : std::uint8_t { channels, alpha };
enum class Aov : std::uint8_t {
  lns,
  visibility,
  ess,
  acceptance,
  source,
  normal,
  depth,
  variance,
  mask,
  acceptance_local,
  acceptance_independent,
  resampled,
  rounds,
  material,
  albedo,
  position,
  z,
  motion,
  object,
  crypto_object,
  crypto_material,
  unshadowed,
  blocked,
  direct,
  indirect
};
enum class PixelType : std::uint8_t { half_float, full_float };
/// How channels are called in frames: as most compositors expect them, or as Blender's passes.
enum class FrameNaming : std::uint8_t { plain, blender };

struct OutputSpec {
  std::string directory;                   ///< absolute
  std::string pattern = "frame.####.exr";  ///< '#'s are the zero-padded frame number
  Background background = Background::environment;
  /// Image files, as large as the frame or larger; with Background::plate.
  std::optional<FileSequence> plate{};
  ShadowForm shadows = ShadowForm::channels;
  std::vector<Aov> aovs;  ///< in the order of the enum, no duplicates
  PixelType pixel_type = PixelType::half_float;
  std::string compression = "zip";  ///< none, rle, zips, zip, piz
  /// Rate of movies, said in the header of frames, [1, 1000].
  double frames_per_second = 24;
  FrameNaming naming = FrameNaming::plain;
  bool clamp_negative = true;  ///< colours below zero become 0 in frames
  /// Frames only to look at: those of a later look take their places.
  bool is_look = false;

  bool operator==(const OutputSpec&) const = default;
};

/// Whether frames are laid over images.
inline bool has_plate(const OutputSpec& output) {
  return output.background == Background::plate && output.plate;
}

enum class StateKeep : std::uint8_t { last, all };

struct StateSpec {
  bool carry = true;  ///< pass samples from frame to frame
  /// Frames between checkpoints and, at rest, of a lease, [1, 1000].
  int checkpoint_every = 12;
  /// pool: rounds before the first frame that are not seen, [0, limits::kMaxPreroll].
  int preroll = 4;
  StateKeep keep = StateKeep::last;  ///< `all`: every checkpoint stays

  bool operator==(const StateSpec&) const = default;
};

struct JobSpec {
  int specification_version = 1;
  std::string name;
  int priority = 50;  ///< [0, 100], higher is rendered first
  std::map<std::string, std::string> metadata;
  std::vector<FrameNumber> frames{FrameNumber(1)};  ///< ascending, no duplicates
  ImageSpec image;
  CameraSpec camera;
  SceneSpec scene;
  EnvironmentSpec environment;
  LightSpec light;
  MotionSpec motion;
  SamplingSpec sampling;
  QualitySpec quality;
  VisibilitySpec visibility;
  OutputSpec output;
  StateSpec state;
  int max_retries_per_task = 3;
  int max_seconds_per_task = 3600;  ///< a task that takes longer has failed
  /// The job fails when so many tasks have failed for good.
  int max_failed_tasks = 1;
  /// After so many failures a worker rests from the job.
  int max_failures_per_worker = 8;
  std::uint64_t seed = 1;

  /// Not said by the user, nor part of the JSON: where runs begin that a former job of the same
  /// picture made otherwise than every checkpoint_every frames (ascending, from 0). After the last
  /// of them they begin at multiples again. Said by the coordinator; only who makes what depends on
  /// it.
  std::vector<Step> leading_runs{};

  bool operator==(const JobSpec&) const = default;
};

}  // namespace baton

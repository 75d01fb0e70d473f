#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "common/base/limits.h"
#include "common/job/job_spec.h"
#include "common/job/text/job_archive.h"

namespace baton {

/// Colours and factors.
inline constexpr NumberRange kUnitRange{0, 1};
/// Positions: far beyond it float32 has no digits left for the image.
inline constexpr NumberRange kCoordinateRange{-1e9, 1e9};
/// Radiance.
inline constexpr NumberRange kLightRange{0, 1e9};
inline constexpr NumberRange kFrameRange{0, limits::kMaxFrameNumber};
/// Of keys of motion, which vectors from and to the frames beside a frame show.
inline constexpr NumberRange kPoseRange{-1, limits::kMaxFrameNumber + 1};
/// Factors that may be zero.
inline constexpr NumberRange kFactorRange{0, 1e9};
/// Lengths and factors above zero.
inline constexpr NumberRange kPositiveRange{.min = 0, .max = 1e9, .min_open = true};
/// Angles in degrees.
inline constexpr NumberRange kAngleRange{-1e6, 1e6};

/// Names of the enumerations in JSON, by value.
inline constexpr std::array<std::string_view, 4> kMaterialKinds{"diffuse", "phong",
                                                                "metallicRoughness", "measured"};
inline constexpr std::array<std::string_view, 3> kTextureWraps{"repeat", "clamp", "mirror"};
inline constexpr std::array<std::string_view, 2> kTextureFilters{"linear", "nearest"};
inline constexpr std::array<std::string_view, 2> kMapFilters{"nearest", "bilinear"};
inline constexpr std::array<std::string_view, 3> kPixelFilters{"box", "gaussian",
                                                               "blackman-harris"};
inline constexpr std::array<std::string_view, 4> kResamplingSchemes{"systematic", "stratified",
                                                                    "multinomial", "residual"};
inline constexpr std::array<std::string_view, 4> kSecondPassForms{
    "corrected", "published", "published-kept", "extra-samples"};
inline constexpr std::array<std::string_view, 3> kMaskPolicies{"same-samples", "split",
                                                               "cross-fold"};
inline constexpr std::array<std::string_view, 4> kLnsUpdates{"ratio", "pathLeft", "pathRight",
                                                             "pathTrapezoid"};
inline constexpr std::array<std::string_view, 3> kBackgrounds{"environment", "transparent",
                                                              "plate"};
inline constexpr std::array<std::string_view, 2> kShadowForms{"channels", "alpha"};
inline constexpr std::array<std::string_view, 2> kFilesBeyond{"hold", "loop"};
inline constexpr std::array<std::string_view, 3> kUpAxes{"x", "y", "z"};
inline constexpr std::array<std::string_view, 2> kPixelTypes{"half", "float"};
inline constexpr std::array<std::string_view, 5> kCompressions{"none", "rle", "zips", "zip", "piz"};
inline constexpr std::array<std::string_view, 2> kFrameNamings{"plain", "blender"};
inline constexpr std::array<std::string_view, 2> kKeyCurves{"linear", "smooth"};
inline constexpr std::array<std::string_view, 2> kStateKeeps{"last", "all"};

/// A fault unless the frames of `keys` ascend; name: of the list.
template <class K>
void check_ascending(JobArchive& a, const char* name, const std::vector<K>& keys) {
  const auto wrong = std::adjacent_find(
      keys.begin(), keys.end(), [](const K& x, const K& y) { return !(x.frame < y.frame); });
  if (wrong == keys.end()) return;
  a.fault(name, "ascending frames without duplicates",
          fmt::format("{} after {}", (wrong + 1)->frame, wrong->frame));
}

/// The JSON shape of a job and every check that needs nothing but the job. Documented, key by key,
/// in jobs/schema/job.schema.json.
void fields(JobArchive& a, JobSpec& job);

/// scene_fields.cpp
void fields(JobArchive& a, SceneSpec& scene);
/// material_fields.cpp
void fields(JobArchive& a, MaterialSpec& material);
/// image_fields.cpp
void fields(JobArchive& a, ImageSpec& image);
/// motion_fields.cpp
void fields(JobArchive& a, CameraSpec& camera);
void fields(JobArchive& a, MotionSpec& motion);
/// Keys of an object, or where they come from.
void motion_fields(JobArchive& a, ObjectSpec& object);
/// Twelve numbers that need not be there.
void matrix_field(JobArchive& a, Key key, std::optional<Matrix34>& matrix);
/// A path whose name ends in one of `extensions`.
void asset_path(JobArchive& a, Key key, std::string& path,
                std::initializer_list<std::string_view> extensions);
/// Numbered files; `extensions`: as of asset_path.
void fields(JobArchive& a, FileSequence& sequence,
            std::initializer_list<std::string_view> extensions);
void fields(JobArchive& a, EnvironmentSpec& environment, const std::vector<FrameNumber>& frames);

}  // namespace baton

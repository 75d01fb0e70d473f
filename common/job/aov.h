#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/job/job_spec.h"

namespace baton {

/// Layers of ID mattes (common/image/cryptomatte.h), and how many things of a pixel they keep.
inline constexpr const char* kCryptoObject = "CryptoObject";
inline constexpr const char* kCryptoMaterial = "CryptoMaterial";
inline constexpr std::size_t kCryptoRanks = 6;

/// What is known of an AOV without a frame.
struct AovTraits {
  std::string_view name;              ///< in JSON
  std::vector<std::string> channels;  ///< names in the EXR file, for compositors
  bool is_float = false;              ///< 32 bits whatever output.pixelType says
  /// It follows from what the sites see, not from samples.
  bool of_geometry = false;
  /// Bytes of a pixel with a surface in a packed film, as measured.
  double film_bytes = 4;
};
const AovTraits& traits(Aov aov);
/// By value of the enumeration.
std::vector<std::string_view> aov_names();
/// Whether the job's frames have it.
bool has_aov(const JobSpec& job, Aov aov);

/// Why an AOV shows nothing of this job: it is the same everywhere. Empty: it shows something.
std::string_view why_empty(Aov aov, const JobSpec& job);

/// The job's objects for people, the ground last: as they are named, or else by their meshes,
/// "bunny", "bunny.2" ..., with the next number that no name and no mesh has. Equal ones are those
/// of objects that are named alike.
std::vector<std::string> object_names(const JobSpec& job);
/// Whether the mattes of objects, where both have them, show the same of the same objects.
bool mattes_alike(const JobSpec& a, const JobSpec& b);
/// Its materials in the order of their numbers.
std::vector<std::string> material_names(const JobSpec& job);

}  // namespace baton

#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/job/time.h"

namespace baton {

/// A job as people know it: drawn when it is first submitted, the same while its documents change.
/// Those are its *versions*, each named by its digest.
struct JobId {
  std::uint64_t number = 0;

  auto operator<=>(const JobId&) const = default;
  /// No job has it.
  bool empty() const { return number == 0; }
  /// 16 lower-case hexadecimal digits.
  std::string hex() const;
  /// The first 8 digits, for people.
  std::string short_hex() const { return hex().substr(0, 8); }
  /// Inverse of hex(); nullopt when `text` is not 16 hexadecimal digits.
  static std::optional<JobId> from_hex(std::string_view text);
  /// A new one that nobody can foresee.
  static JobId draw();
};

/// When what happened to a job: milliseconds since 1970, UTC; 0: it has not, or nobody knows.
struct JobTimes {
  std::int64_t submitted_ms = 0;  ///< first
  std::int64_t started_ms = 0;    ///< the first task was granted
  std::int64_t ended_ms = 0;      ///< last; 0 while it is open

  bool operator==(const JobTimes&) const = default;
};

/// Who a job is: what stays while its documents change.
struct JobIdentity {
  JobId id;
  std::int32_t version = 1;  ///< of the document in work, counted from 1
  JobTimes times;

  bool operator==(const JobIdentity&) const = default;
};

}  // namespace baton

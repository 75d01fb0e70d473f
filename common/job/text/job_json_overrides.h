#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/job/text/job_json.h"

namespace baton {

/// Puts what is said in place of a job file into its JSON, before that is parsed.
class JobOverrides {
 public:
  /// An override whose path is no path is never applied.
  explicit JobOverrides(const std::vector<JobOverride>& overrides);

  /// Sets the values that lie below `path` in `value`, which stands there; missing objects are
  /// made. What is in the way of a path stays, such as the name of a file that has the scene.
  void apply(const std::string& path, nlohmann::json& value);
  /// Who said what stands at a path: the option, or "" for the file.
  std::string source_of(const std::string& path) const;
  /// One line for each value that found no place.
  std::vector<std::string> faults() const;

 private:
  struct Step {
    std::string key;
    bool is_index = false;
  };
  struct Entry {
    /// Path as faults write it: `$.scene.objects[0].fitHeight`.
    std::string path;
    std::vector<Step> steps;  ///< empty: the path is none
    nlohmann::json value;
    std::string option;
    /// The first part of the path that the file does not have; "": not applied.
    std::string made;
  };

  static std::vector<Step> steps_of(const std::string& path);

  std::vector<Entry> entries_;
};

}  // namespace baton

#pragma once

#include <filesystem>
#include <list>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/text/job_archive.h"
#include "common/job/text/job_json_overrides.h"

namespace baton {

/// Fills a specification from JSON and collects every fault on the way.
class JobJsonReader final : public JobArchive {
 public:
  /// name: goes first in faults. base_directory: what relative paths are relative to.
  /// overrides: what is said in place of the text's values.
  JobJsonReader(std::string name, const std::filesystem::path& base_directory,
                const std::vector<JobOverride>& overrides = {});

  /// A text that somebody else has written: no part of it may be in a file, which nobody has seen.
  void forbid_files() { may_read_files_ = false; }
  /// Visits the root object. One error lists every fault, one per line.
  Status read(nlohmann::json root, const Body& body);
  /// Paths of the optional values that the text does not give.
  const std::set<std::string>& defaulted() const { return defaulted_; }

  using JobArchive::fault;
  using JobArchive::number;
  bool boolean(Key key, bool& value) override;
  bool integer(Key key, int& value, int min, int max) override;
  bool integer(Key key, std::uint64_t& value) override;
  bool number(Key key, double& value, NumberRange range) override;
  bool numbers(Key key, std::span<double> values, NumberRange range, bool lone) override;
  bool text(Key key, std::string& value) override;
  bool path(Key key, std::string& value) override;
  bool word(Key key, std::string& value, std::span<const std::string_view> words) override;
  bool words(Key key, std::vector<std::string>& values,
             std::span<const std::string_view> words) override;
  bool texts(Key key, std::map<std::string, std::string>& values, int max_count) override;
  bool object(Key key, const Body& body, ObjectForm form) override;
  void fault(std::string_view key, const std::string& message) override;
  bool explains_faults() const override;

 protected:
  bool list_of(Key key, std::size_t count, int max_count, const IndexBody& resize,
               const IndexBody& body) override;
  bool named_of(Key key, const std::vector<std::string>& names, int max_count, const NameBody& body,
                ObjectForm form) override;

 private:
  /// The object being visited.
  struct Place {
    const nlohmann::json* object = nullptr;
    std::string path;           ///< from the root of the job
    std::size_t file_root = 0;  ///< length of the path of the root of `file`
    std::string file;           ///< named in faults
    std::filesystem::path base_directory;
    std::vector<std::string> keys;  ///< asked for so far
  };

  const nlohmann::json* find(Key key);
  std::string path_of(std::string_view key) const;
  void fault_at(const std::string& path, const std::string& message);
  bool read_number(const std::string& path, const nlohmann::json& json, double& value,
                   NumberRange range);
  bool read_text(const std::string& path, const nlohmann::json& json, std::string& value);
  bool read_word(const std::string& path, const nlohmann::json& json, std::string& value,
                 std::span<const std::string_view> words);
  void visit(const nlohmann::json& json, Place place, const Body& body, ObjectForm form);
  void visit_file(const nlohmann::json& json, const std::string& path, const Body& body);
  void report_unknown_keys();

  bool may_read_files_ = true;
  Place place_;
  std::list<nlohmann::json> documents_;  ///< other files; places point into them
  JobOverrides overrides_;
  std::set<std::string> defaulted_;
  std::vector<std::string> faults_;
};

}  // namespace baton

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace baton {

/// Faults of a study, each at most once, in the order in which they were found.
class StudyFaults {
 public:
  explicit StudyFaults(std::string name) : name_(std::move(name)) {}

  void add(const std::string& path, const std::string& message);
  void add_line(const std::string& line);
  bool any() const { return !lines_.empty(); }
  std::string text() const;

 private:
  std::string name_;
  std::vector<std::string> lines_;
};

/// One object of a study file being read. Each visit says what is wrong with the key, if anything.
class StudyObject {
 public:
  /// json, faults: must outlive it. A value that is no object is a fault and reads as an empty one.
  StudyObject(const nlohmann::json& json, std::string path, StudyFaults& faults);

  /// 1 to 30 bytes without '/', '"' and ',', as it goes into file names and tables; "" when it is
  /// missing or wrong.
  std::string name(const char* key);
  /// The path that `key` gives, absolute; empty when it is missing or wrong.
  std::filesystem::path file(const char* key, const std::filesystem::path& base_directory);
  int integer(const char* key, int otherwise, int min, int max);
  /// A text, or "" without the key.
  std::string text(const char* key);
  /// An object that is merged into a job [RFC 7396]; empty without the key.
  nlohmann::json patch(const char* key);
  /// The elements of a list; required: at least one.
  const nlohmann::json& list(const char* key, bool required);
  bool has(const char* key) const { return json_->contains(key); }

  /// Every key that was not asked for is a fault.
  void finish();

  std::string path_of(const char* key) const;
  const std::string& path() const { return path_; }

 private:
  const nlohmann::json* find(const char* key);

  const nlohmann::json* json_;
  std::string path_;
  StudyFaults& faults_;
  std::vector<std::string> keys_;
};

}  // namespace baton

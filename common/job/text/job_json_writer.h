#pragma once

#include <nlohmann/json.hpp>

#include "common/job/text/job_archive.h"

namespace baton {

/// Makes JSON of a specification: every value, keys in the order of the visit.
class JobJsonWriter final : public JobArchive {
 public:
  const nlohmann::ordered_json& json() const { return root_; }

  using JobArchive::number;
  bool boolean(Key key, bool& value) override;
  bool flag(Key key, bool& value) override { return value && boolean(key, value); }
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
  void fault(std::string_view, const std::string&) override {}
  bool explains_faults() const override { return false; }

 protected:
  bool list_of(Key key, std::size_t count, int max_count, const IndexBody& resize,
               const IndexBody& body) override;
  bool named_of(Key key, const std::vector<std::string>& names, int max_count, const NameBody& body,
                ObjectForm form) override;

 private:
  /// The object that `body` writes.
  nlohmann::ordered_json nested(const Body& body);

  nlohmann::ordered_json root_ = nlohmann::ordered_json::object();
};

}  // namespace baton

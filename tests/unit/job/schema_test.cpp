#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/job/text/job_fields.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {

using nlohmann::json;

/// What may stand at each path: "image.width" -> {"integer [1, 32768]"}. `[]` is any element, `*`
/// any name.
using Shape = std::map<std::string, std::set<std::string>>;

std::string show(NumberRange range) {
  return fmt::format("{}{}, {}{}", range.min_open ? '(' : '[', range.min, range.max,
                     range.max_open ? ')' : ']');
}

template <class Words>
std::string show_words(const Words& words) {
  std::string text;
  for (const auto& word : words) text += " " + std::string(word);
  return text;
}

/// Visits a job only to write down its shape. Each named item is visited four times, so that
/// each kind of material is seen.
class ShapeArchive final : public JobArchive {
 public:
  Shape shape;

  using JobArchive::number;
  bool boolean(Key key, bool&) override { return add(key, "boolean"); }
  bool integer(Key key, int&, int min, int max) override {
    return add(key, "integer " + show(NumberRange{double(min), double(max)}));
  }
  bool integer(Key key, std::uint64_t&) override {
    return add(key, "integer [0, 1.8446744073709552e+19]");
  }
  bool number(Key key, double&, NumberRange range) override {
    return add(key, "number " + show(range));
  }
  bool numbers(Key key, std::span<double>, NumberRange range, bool lone) override {
    if (lone) add(key, "number " + show(range));
    return add(key, "numbers " + show(range));
  }
  bool text(Key key, std::string&) override { return add(key, "text"); }
  bool path(Key key, std::string&) override { return add(key, "text"); }
  bool word(Key key, std::string& value, std::span<const std::string_view> words) override {
    value = words[round_ % words.size()];
    for (const std::string_view word : words) add(key, "word " + std::string(word));
    return true;
  }
  bool words(Key key, std::vector<std::string>&, std::span<const std::string_view> words) override {
    return add(key, "words" + show_words(words));
  }
  bool texts(Key key, std::map<std::string, std::string>&, int max_count) override {
    return add(key, fmt::format("texts, at most {}", max_count));
  }
  bool object(Key key, const Body& body, ObjectForm form) override {
    if (form.file || form.shorthand != nullptr) add(key, "text");
    add(key, "object");
    nest(std::string(".") + key.name, body);
    return true;
  }
  void fault(std::string_view, const std::string&) override {}
  bool explains_faults() const override { return false; }

 protected:
  bool list_of(Key key, std::size_t, int max_count, const IndexBody& resize,
               const IndexBody& body) override {
    add(key, fmt::format("list, at most {}", max_count));
    resize(1);
    nest(std::string(".") + key.name + "[]", [&] { body(0); });
    return true;
  }
  bool named_of(Key key, const std::vector<std::string>&, int max_count, const NameBody& body,
                ObjectForm form) override {
    add(key, fmt::format("named, at most {}", max_count));
    const std::string item = std::string(key.name) + ".*";
    if (form.shorthand != nullptr) add(item.c_str(), "text");
    add(item.c_str(), "object");
    for (round_ = 0; round_ < 4; ++round_) nest("." + item, [&] { body("any"); });
    round_ = 0;
    return true;
  }

 private:
  bool add(Key key, const std::string& what) {
    shape[path_ + "." + key.name].insert(what);
    return true;
  }
  void nest(const std::string& step, const Body& body) {
    const std::string outer = path_;
    path_ += step;
    body();
    path_ = outer;
  }

  std::string path_;
  std::size_t round_ = 0;
};

NumberRange schema_range(const json& schema) {
  const bool min_open = schema.contains("exclusiveMinimum");
  const bool max_open = schema.contains("exclusiveMaximum");
  return {schema.at(min_open ? "exclusiveMinimum" : "minimum").get<double>(),
          schema.at(max_open ? "exclusiveMaximum" : "maximum").get<double>(), min_open, max_open};
}

/// The shape that the JSON Schema describes.
void add_schema(const json& root, const json& schema, const std::string& path, Shape& shape) {
  std::set<std::string>& here = shape[path];
  if (schema.contains("$ref")) {
    const json::json_pointer pointer(schema.at("$ref").get<std::string>().substr(1));
    return add_schema(root, root.at(pointer), path, shape);
  }
  if (schema.contains("oneOf") && !schema.contains("properties")) {
    for (const json& branch : schema.at("oneOf")) add_schema(root, branch, path, shape);
    return;
  }
  if (schema.contains("const")) {
    here.insert("word " + schema.at("const").get<std::string>());
    return;
  }
  if (schema.contains("enum")) {
    const json& values = schema.at("enum");
    if (values.front().is_number()) {
      here.insert(schema.value("type", "integer") + " " +
                  show({values.front().get<double>(), values.back().get<double>()}));
      return;
    }
    for (const json& value : values) here.insert("word " + value.get<std::string>());
    return;
  }
  const auto type = schema.at("type").get<std::string>();
  if (type == "boolean") here.insert(type);
  if (type == "string") here.insert("text");
  if (type == "integer" || type == "number") here.insert(type + " " + show(schema_range(schema)));
  if (type == "array") {
    const json& items = schema.at("items");
    if (items.contains("enum")) {
      here.insert("words" + show_words(items.at("enum").get<std::vector<std::string>>()));
    } else if (items.contains("type")) {
      here.insert("numbers " + show(schema_range(items)));
    } else {
      here.insert(fmt::format("list, at most {}", schema.at("maxItems").get<int>()));
      shape.erase(path + "[]");
      Shape inner;
      add_schema(root, items, path + "[]", inner);
      inner.erase(path + "[]");
      shape.merge(inner);
    }
  }
  if (type == "object" && schema.contains("properties")) {
    here.insert("object");
    EXPECT_FALSE(schema.at("additionalProperties").get<bool>()) << path;
    for (const auto& [key, value] : schema.at("properties").items()) {
      add_schema(root, value, path + "." + key, shape);
    }
  } else if (type == "object") {
    const json& values = schema.at("additionalProperties");
    const int max_count = schema.at("maxProperties").get<int>();
    here.insert(
        fmt::format("{}, at most {}", values.contains("$ref") ? "named" : "texts", max_count));
    if (values.contains("$ref")) add_schema(root, values, path + ".*", shape);
  }
}

json read_schema() {
  const std::filesystem::path source = BATON_SOURCE_DIR;
  const Result<std::string> text =
      read_text_file(source / "jobs/schema/job.schema.json", limits::kMaxJobFileBytes);
  EXPECT_TRUE(text.ok()) << (text.ok() ? "" : text.error().message);
  return json::parse(text.ok() ? *text : "{}");
}

std::vector<std::string> lines(const Shape& shape) {
  std::vector<std::string> result;
  for (const auto& [path, kinds] : shape) {
    for (const std::string& kind : kinds) result.push_back(path + ": " + kind);
  }
  return result;
}

TEST(Schema, AgreesWithTheParserOnKeysTypesRangesAndWords) {
  const json schema = read_schema();
  Shape documented;
  add_schema(schema, schema, "", documented);
  documented.erase("");

  ShapeArchive parsed;
  JobSpec job;
  fields(parsed, job);
  EXPECT_EQ(lines(documented), lines(parsed.shape));
}

/// Every property anywhere in `schema`.
void expect_descriptions(const json& schema, const std::string& path) {
  for (const auto& [key, value] : schema.items()) {
    if (key == "properties") {
      for (const auto& [name, property] : value.items()) {
        const bool described = property.contains("description") || property.contains("$ref");
        EXPECT_TRUE(described) << path << "." << name;
      }
    }
    if (value.is_structured()) expect_descriptions(value, path + "/" + key);
  }
}

TEST(Schema, DescribesEveryProperty) { expect_descriptions(read_schema(), ""); }

/// Compares each default in `schema` with the value in force; returns how many there were.
int expect_defaults(const json& schema, const json& value, const std::string& path) {
  int count = 0;
  for (const auto& [key, property] : schema.at("properties").items()) {
    const std::string here = path + "." + key;
    if (!value.contains(key)) continue;
    if (property.contains("properties")) count += expect_defaults(property, value.at(key), here);
    if (!property.contains("default")) continue;
    EXPECT_EQ(property.at("default"), value.at(key)) << here;
    ++count;
  }
  return count;
}

TEST(Schema, ShowsTheDefaultsOfTheSpecification) {
  EXPECT_GE(expect_defaults(read_schema(), json::parse(to_json(preset_job())), ""), 40);
}

}  // namespace
}  // namespace baton

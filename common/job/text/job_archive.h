#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/math/vec3.h"

namespace baton {

/// A key of a JSON object and what its absence means.
struct Key {
  enum class Presence {
    optional,     ///< the value keeps its default
    required,     ///< a fault
    alternative,  ///< nothing: another key says the same
  };
  const char* name;
  Presence presence = Presence::optional;

  constexpr Key(const char* key_name,
                Presence key_presence = Presence::optional)  // NOLINT: implicit on purpose
      : name(key_name), presence(key_presence) {}
};
constexpr Key required(const char* name) { return {name, Key::Presence::required}; }
constexpr Key alternative(const char* name) { return {name, Key::Presence::alternative}; }

/// An interval of numbers; an open end is excluded.
struct NumberRange {
  double min = 0;
  double max = 0;
  bool min_open = false;
  bool max_open = false;

  constexpr bool contains(double x) const {
    return (min_open ? x > min : x >= min) && (max_open ? x < max : x <= max);
  }
};

/// The double with the shortest decimal text that reads back as `value`: 0.8f becomes 0.8, not
/// 0.800000011920929.
double decimal(float value);

/// How an object may be written besides `{...}`.
struct ObjectForm {
  const char* shorthand = nullptr;  ///< a lone text means {shorthand: text}
  /// A lone text names a JSON file with the object.
  bool file = false;
  /// Without the key: true means all defaults, false means there is no such object.
  bool present = true;
};

/// A word for several values of an enumeration.
template <class E>
struct NamedSet {
  std::string_view name;
  std::vector<E> values;
};

/// Visits the values of a specification, one call a key. The reader fills them from JSON, the
/// writer makes JSON of them, so that a key, its unit and its range are said once (job_fields.cpp,
/// scene_fields.cpp).
///
/// Each visit returns true when the value was read or written, false when it was absent or at
/// fault: then the value keeps what it had.
class JobArchive {
 public:
  using Body = std::function<void()>;
  using IndexBody = std::function<void(std::size_t index)>;
  using NameBody = std::function<void(const std::string& name)>;

  virtual ~JobArchive() = default;

  virtual bool boolean(Key key, bool& value) = 0;
  /// A boolean of which false is not written, so that jobs without it keep their digests.
  virtual bool flag(Key key, bool& value) { return boolean(key, value); }
  /// Range inclusive.
  virtual bool integer(Key key, int& value, int min, int max) = 0;
  virtual bool integer(Key key, std::uint64_t& value) = 0;
  /// Finite numbers only. NaN is not written: a value that need not be there.
  virtual bool number(Key key, double& value, NumberRange range) = 0;
  /// `count` numbers in brackets; with `lone` also one number that stands for all. NaN is not
  /// written.
  virtual bool numbers(Key key, std::span<double> values, NumberRange range, bool lone) = 0;
  /// 1 to limits::kMaxTextLength bytes, no control characters. An empty text is not written.
  virtual bool text(Key key, std::string& value) = 0;
  /// A text that becomes an absolute, lexically normal path.
  virtual bool path(Key key, std::string& value) = 0;
  /// One of `words`.
  virtual bool word(Key key, std::string& value, std::span<const std::string_view> words) = 0;
  /// Any of `words`, each at most once.
  virtual bool words(Key key, std::vector<std::string>& values,
                     std::span<const std::string_view> words) = 0;
  /// Free texts by name.
  virtual bool texts(Key key, std::map<std::string, std::string>& values, int max_count) = 0;
  /// An object whose keys `body` visits.
  virtual bool object(Key key, const Body& body, ObjectForm form = {}) = 0;

  /// Says what is wrong with a key of the object being visited ("" for the object itself).
  void fault(std::string_view key, const std::string& expected, const std::string& got);
  /// The same with the whole message: "expected ..., got ...".
  virtual void fault(std::string_view key, const std::string& message) = 0;
  /// False when further faults are at most counted: a long explanation would be wasted.
  virtual bool explains_faults() const = 0;

  bool number(Key key, float& value, NumberRange range);
  bool number(Key key, std::optional<float>& value, NumberRange range);
  bool vector(Key key, Vec3& value, NumberRange range, bool lone = false);

  /// An enumeration by the names of its values, in order.
  template <class E>
  bool choice(Key key, E& value, std::span<const std::string_view> names) {
    std::string name(names[static_cast<std::size_t>(value)]);
    if (!word(key, name, names)) return false;
    value = static_cast<E>(std::find(names.begin(), names.end(), name) - names.begin());
    return true;
  }

  /// A set of enumeration values, kept in the order of the enumeration. sets: words that stand for
  /// several of them where the set is read.
  template <class E>
  bool choices(Key key, std::vector<E>& values, std::span<const std::string_view> names,
               std::span<const NamedSet<E>> sets = {}) {
    std::vector<std::string> chosen;
    for (const E value : values) chosen.emplace_back(names[static_cast<std::size_t>(value)]);
    std::vector<std::string_view> known(names.begin(), names.end());
    for (const NamedSet<E>& set : sets) known.push_back(set.name);
    if (!words(key, chosen, known)) return false;

    const auto is_chosen = [&](std::string_view name) {
      return std::find(chosen.begin(), chosen.end(), name) != chosen.end();
    };
    values.clear();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const E value = static_cast<E>(i);
      const bool of_a_set = std::any_of(sets.begin(), sets.end(), [&](const NamedSet<E>& set) {
        return is_chosen(set.name) &&
               std::find(set.values.begin(), set.values.end(), value) != set.values.end();
      });
      if (of_a_set || is_chosen(names[i])) values.push_back(value);
    }
    return true;
  }

  /// A list of objects: body(item) visits each.
  template <class T, class F>
  bool list(Key key, std::vector<T>& items, int max_count, F body) {
    return list_of(
        key, items.size(), max_count, [&](std::size_t count) { items.resize(count); },
        [&](std::size_t i) { body(items[i]); });
  }

  /// Objects by name: body(item) visits each.
  template <class T, class F>
  bool named(Key key, std::map<std::string, T>& items, int max_count, F body,
             ObjectForm form = {}) {
    return named_from(
        key, items, T(), max_count, [&](const std::string&, T& item) { body(item); }, form);
  }

  /// As named(), where new items start as `start`, and with the name: body(name, item).
  template <class T, class F>
  bool named_from(Key key, std::map<std::string, T>& items, const T& start, int max_count, F body,
                  ObjectForm form = {}) {
    std::vector<std::string> names;
    for (const auto& item : items) names.push_back(item.first);
    return named_of(
        key, names, max_count,
        [&](const std::string& name) { body(name, items.try_emplace(name, start).first->second); },
        form);
  }

 protected:
  virtual bool list_of(Key key, std::size_t count, int max_count, const IndexBody& resize,
                       const IndexBody& body) = 0;
  virtual bool named_of(Key key, const std::vector<std::string>& names, int max_count,
                        const NameBody& body, ObjectForm form) = 0;
};

}  // namespace baton

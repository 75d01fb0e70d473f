#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "common/base/check.h"

namespace baton {

/// What kind of thing went wrong; decides the exit code (exit_codes.h) and whether a retry can
/// help.
enum class ErrorKind {
  usage,  ///< the command line is wrong
  /// A job, scene, image, state or message is not what it must be.
  bad_input,
  io,       ///< the disk or the network has failed
  corrupt,  ///< a checksum or digest does not match
  version,  ///< made by another version of the program
  timeout,
  cancelled,
  internal,  ///< a bug in this program
  no_space,  ///< a disk is full: waiting can help
};

/// An error of operation: the message names the file, the place and what was expected.
struct Error {
  ErrorKind kind = ErrorKind::internal;
  std::string message;
};

/// A value or an Error. Reading the side that is not there stops the process (broken invariant).
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : data_(std::move(value)) {}      // NOLINT: implicit on purpose
  Result(Error error) : data_(std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return data_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & {
    BATON_CHECK(ok());
    return std::get<0>(data_);
  }
  const T& value() const& {
    BATON_CHECK(ok());
    return std::get<0>(data_);
  }
  T&& value() && {
    BATON_CHECK(ok());
    return std::get<0>(std::move(data_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const {
    BATON_CHECK(!ok());
    return std::get<1>(data_);
  }

 private:
  std::variant<T, Error> data_;
};

/// Success or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    BATON_CHECK(!ok());
    return *error_;
  }

 private:
  std::optional<Error> error_;
};
using Status = Result<void>;

}  // namespace baton

/// Leaves the enclosing function with the error of `expr`, or goes on.
#define BATON_TRY(expr)                                                                   \
  do {                                                                                    \
    if (const auto& baton_status_ = (expr); !baton_status_) return baton_status_.error(); \
  } while (false)

/// Declares `decl` with the value of `expr`, or leaves the enclosing function with its error.
#define BATON_ASSIGN(decl, expr) BATON_ASSIGN_IMPL_(decl, expr, __LINE__)
#define BATON_ASSIGN_IMPL_(decl, expr, line) BATON_ASSIGN_IMPL2_(decl, expr, line)
// NOLINTBEGIN(bugprone-macro-parentheses): a declaration stands in none
#define BATON_ASSIGN_IMPL2_(decl, expr, line)                   \
  auto baton_result_##line = (expr);                            \
  if (!baton_result_##line) return baton_result_##line.error(); \
  decl = std::move(baton_result_##line).value()
// NOLINTEND(bugprone-macro-parentheses)

#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/file_descriptor.h"
#include "common/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace baton {

/// One prepared statement. Used as: bind all, step until false. One that ran may be bound and run
/// again.
class SqlStatement {
 public:
  /// Parameters are numbered from 1 in the order of the calls.
  template <std::integral T>
  SqlStatement& bind(T value) {
    return bind_integer(static_cast<std::int64_t>(value));
  }
  SqlStatement& bind(std::string_view text);
  SqlStatement& bind(ByteView blob);
  SqlStatement& bind(double value);
  SqlStatement& bind(const Digest& digest) { return bind(digest.hex()); }
  template <class E>
  requires std::is_enum_v<E> SqlStatement& bind(E value) {
    return bind_integer(static_cast<std::int64_t>(value));
  }

  /// True: a row is there. False: done.
  Result<bool> step();
  /// For statements without rows.
  Status run();
  /// Makes it ready to be bound again.
  void reset();

  /// Columns are numbered from 0. Views are valid until the next step.
  std::int64_t integer(int column) const;
  double real(int column) const;
  bool is_null(int column) const;
  std::string text(int column) const;
  ByteView blob(int column) const;

  /// The first column of all rows that are left.
  Result<std::vector<std::string>> texts();
  /// The same as digests. Error, corrupt: one is none.
  Result<std::vector<Digest>> digests();

 private:
  friend class SqlDatabase;
  SqlStatement& bind_integer(std::int64_t value);
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  SqlStatement(sqlite3_stmt* statement, std::string name)
      : statement_(statement), name_(std::move(name)) {}

  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  std::string name_;  ///< the file's, for errors
  int num_bound_ = 0;
};

/// An SQLite file that one process has to itself. Errors name the file; one that is damaged or no
/// SQLite file is ErrorKind::corrupt, one in use ErrorKind::io.
class SqlDatabase {
 public:
  /// Opens or creates the file, write-ahead logged; a commit survives a power cut.
  static Result<SqlDatabase> open(const std::filesystem::path& path);

  /// ErrorKind::io once the file's last name is gone, or another file has it: what is written to it
  /// then nobody will read.
  Status expect_named() const;

  /// Takes room on the disk for what is committed next, 16 MiB or a fortieth of a smaller disk, so
  /// that commits go on for a while on one that others have filled. Once it is taken, or where the
  /// disk promises none, nothing happens; where the disk is full now, the next call tries again.
  void reserve_room();

  /// Reads a table whole to see that its pages are sound.
  Status check(std::string_view table);

  Status execute(const std::string& sql);
  Result<SqlStatement> prepare(std::string_view sql);
  /// "PRAGMA <name>" as a number.
  Result<std::int64_t> pragma(std::string_view name);
  const std::string& name() const { return name_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  SqlDatabase(sqlite3* database, std::string name) : database_(database), name_(std::move(name)) {}

  std::unique_ptr<sqlite3, Close> database_;
  std::string name_;
  /// A path's: closing it drops none of SQLite's locks.
  FileDescriptor file_{-1};
  bool has_asked_for_room_ = false;  ///< and was answered for good
};

}  // namespace baton

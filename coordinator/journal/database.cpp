#include "coordinator/journal/database.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cerrno>
#include <optional>

#include "common/base/check.h"

namespace baton {
namespace {

/// A coordinator that was killed keeps its lock until the system has put it away.
constexpr int kLockPatienceMs = 3000;

Error database_error(int code, const std::string& name, const char* detail) {
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {ErrorKind::io, fmt::format("{}: already in use by another coordinator", name)};
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return {ErrorKind::corrupt, fmt::format("{}: damaged, or not a journal: {}", name, detail)};
    default:
      return {ErrorKind::io, fmt::format("{}: {}", name, detail)};
  }
}

}  // namespace

// ---- statements ---------------------------------------------------------------------------------

void SqlStatement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqlStatement& SqlStatement::bind_integer(std::int64_t value) {
  BATON_CHECK(sqlite3_bind_int64(statement_.get(), ++num_bound_, value) == SQLITE_OK);
  return *this;
}

SqlStatement& SqlStatement::bind(std::string_view text) {
  BATON_CHECK(sqlite3_bind_text64(statement_.get(), ++num_bound_, text.data(), text.size(),
                                  SQLITE_TRANSIENT, SQLITE_UTF8) == SQLITE_OK);
  return *this;
}

SqlStatement& SqlStatement::bind(ByteView blob) {
  BATON_CHECK(sqlite3_bind_blob64(statement_.get(), ++num_bound_, blob.data(), blob.size(),
                                  SQLITE_TRANSIENT) == SQLITE_OK);
  return *this;
}

SqlStatement& SqlStatement::bind(double value) {
  BATON_CHECK(sqlite3_bind_double(statement_.get(), ++num_bound_, value) == SQLITE_OK);
  return *this;
}

Result<bool> SqlStatement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return database_error(code, name_, sqlite3_errmsg(sqlite3_db_handle(statement_.get())));
}

Status SqlStatement::run() {
  BATON_ASSIGN(const bool row, step());
  BATON_CHECK(!row);
  reset();
  return {};
}

void SqlStatement::reset() {
  sqlite3_reset(statement_.get());
  num_bound_ = 0;
}

std::int64_t SqlStatement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double SqlStatement::real(int column) const {
  return sqlite3_column_double(statement_.get(), column);
}

bool SqlStatement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

std::string SqlStatement::text(int column) const {
  const ByteView bytes = blob(column);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Result<std::vector<std::string>> SqlStatement::texts() {
  std::vector<std::string> values;
  while (true) {
    BATON_ASSIGN(const bool row, step());
    if (!row) return values;
    values.push_back(text(0));
  }
}

Result<std::vector<Digest>> SqlStatement::digests() {
  BATON_ASSIGN(const std::vector<std::string> values, texts());
  std::vector<Digest> digests;
  for (const std::string& value : values) {
    const std::optional<Digest> digest = Digest::from_hex(value);
    if (!digest) return Error{ErrorKind::corrupt, fmt::format("{}: no digest: '{}'", name_, value)};
    digests.push_back(*digest);
  }
  return digests;
}

ByteView SqlStatement::blob(int column) const {
  const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

// ---- database -----------------------------------------------------------------------------------

void SqlDatabase::Close::operator()(sqlite3* database) const { sqlite3_close(database); }

Result<SqlDatabase> SqlDatabase::open(const std::filesystem::path& path) {
  // SQLite gives its log the rights of the file.
  { const FileDescriptor made(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600)); }
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(path.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  SqlDatabase database(handle, path.string());
  if (code != SQLITE_OK) return database_error(code, database.name_, sqlite3_errstr(code));

  sqlite3_busy_timeout(handle, kLockPatienceMs);

  // Exclusive from the first access on: no shared memory file, and a second coordinator finds the
  // door closed.
  BATON_TRY(database.execute("PRAGMA locking_mode = EXCLUSIVE"));
  BATON_TRY(database.execute("PRAGMA journal_mode = WAL"));
  BATON_TRY(database.execute("PRAGMA synchronous = FULL"));

  database.file_ = FileDescriptor(::open(path.c_str(), O_PATH | O_CLOEXEC));
  return database;
}

Status SqlDatabase::expect_named() const {
  struct stat file {};
  if (::fstat(file_.number(), &file) != 0 || file.st_nlink > 0) return {};
  return Error{ErrorKind::io, name_ + ": was deleted or replaced while it was open"};
}

void SqlDatabase::reserve_room() {
  if (has_asked_for_room_) return;
  constexpr std::uint64_t kMostBytes = std::uint64_t{16} << 20, kShareOfDisk = 40;
  const std::string log = name_ + "-wal";
  FileDescriptor file(::open(log.c_str(), O_WRONLY | O_CLOEXEC));
  struct statvfs disk {};
  if (!file || ::fstatvfs(file.number(), &disk) != 0) return;
  const std::uint64_t bytes =
      std::min(kMostBytes, std::uint64_t{disk.f_blocks} * disk.f_frsize / kShareOfDisk);
  // The log's end stays where it is: what lies behind it is nobody's data. The log is never cut
  // while the database is open, so what is taken stays.
  has_asked_for_room_ =
      ::fallocate(file.number(), FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(bytes)) == 0 ||
      (errno != ENOSPC && errno != EDQUOT && errno != EINTR);
}

Status SqlDatabase::check(std::string_view table) {
  BATON_ASSIGN(SqlStatement check, prepare(fmt::format("PRAGMA quick_check({})", table)));
  BATON_ASSIGN(const bool row, check.step());
  if (row && check.text(0) == "ok") return {};
  return database_error(SQLITE_CORRUPT, name_, row ? check.text(0).c_str() : "no answer");
}

Status SqlDatabase::execute(const std::string& sql) {
  const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return database_error(code, name_, sqlite3_errmsg(database_.get()));
  return {};
}

Result<SqlStatement> SqlDatabase::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()),
                                      &statement, nullptr);
  if (code != SQLITE_OK) return database_error(code, name_, sqlite3_errmsg(database_.get()));
  return SqlStatement(statement, name_);
}

Result<std::int64_t> SqlDatabase::pragma(std::string_view name) {
  BATON_ASSIGN(SqlStatement statement, prepare(fmt::format("PRAGMA {}", name)));
  BATON_ASSIGN(const bool row, statement.step());
  return row ? statement.integer(0) : 0;
}

}  // namespace baton

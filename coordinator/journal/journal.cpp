#include "coordinator/journal/journal.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "common/base/archive.h"
#include "coordinator/journal/schema.h"

namespace baton {
namespace {

/// What is read at the start, and so is checked then.
constexpr std::array kCheckedTables{"starts", "jobs", "completions", "failures"};

template <class T>
Status read_blob(const SqlDatabase& database, ByteView bytes, const char* column, T& value) {
  ArchiveReader reader(bytes);
  reader(value);
  if (reader.complete()) return {};
  return Error{ErrorKind::corrupt, fmt::format("{}: {}: {} bytes that cannot be read",
                                               database.name(), column, bytes.size())};
}

/// Values that this program does not know are an error: taken for another one, they would be wrong.
template <class E>
Status read_enum(const SqlDatabase& database, std::int64_t number, const char* column, E& value) {
  if (number < 0 || number > static_cast<std::int64_t>(last_of(E{}))) {
    return Error{ErrorKind::corrupt, fmt::format("{}: {}: {}, expected 0 to {}", database.name(),
                                                 column, number, static_cast<int>(last_of(E{})))};
  }
  value = static_cast<E>(number);
  return {};
}

/// The first columns of the row: kind, step, tile.
Result<TaskKey> read_task(const SqlDatabase& database, const SqlStatement& row,
                          const char* kind_column) {
  TaskKey task;
  BATON_TRY(read_enum(database, row.integer(0), kind_column, task.kind));
  task.position = static_cast<std::int32_t>(row.integer(1));
  task.tile = static_cast<std::int32_t>(row.integer(2));
  return task;
}

/// Columns: kind, step, tile, outputs, stats, frames.
Result<Completion> read_completion(const SqlDatabase& database, const SqlStatement& row) {
  Completion completion;
  BATON_ASSIGN(completion.task, read_task(database, row, "completions.kind"));
  BATON_TRY(read_blob(database, row.blob(3), "completions.outputs", completion.made.outputs));
  BATON_TRY(read_blob(database, row.blob(4), "completions.stats", completion.made.stats));
  BATON_TRY(read_blob(database, row.blob(5), "completions.frames", completion.made.frames));
  return completion;
}

/// Columns: lease, worker, message, permanent.
Result<Failure> read_failure(const SqlDatabase& database, const SqlStatement& row) {
  Failure failure;
  BATON_TRY(read_blob(database, row.blob(0), "failures.lease", failure.lease));
  failure.worker = row.text(1);
  failure.message = row.text(2);
  failure.permanent = (row.integer(3) & 1) != 0;
  failure.last = (row.integer(3) & 2) != 0;
  return failure;
}

Status prepare_schema(SqlDatabase& database) {
  BATON_ASSIGN(const std::int64_t version, database.pragma("user_version"));
  BATON_ASSIGN(const std::int64_t application, database.pragma("application_id"));
  BATON_ASSIGN(const std::int64_t schema_changes, database.pragma("schema_version"));

  // A file without any table is new, or was left before its first commit.
  if (schema_changes == 0) {
    return database.execute(
        fmt::format("BEGIN; {} PRAGMA user_version = {}; PRAGMA application_id = {}; COMMIT;",
                    std::string(kSchema) + kLaterTables, kSchemaVersion, kApplicationId));
  }
  if (application != kApplicationId) {
    return Error{
        ErrorKind::corrupt,
        fmt::format("{}: a database, but not a journal of a coordinator", database.name())};
  }
  if (version != kSchemaVersion) {
    return Error{ErrorKind::version, fmt::format("{}: journal version {}, this program reads {}",
                                                 database.name(), version, kSchemaVersion)};
  }
  for (const char* const table : kCheckedTables) BATON_TRY(database.check(table));
  return database.execute(std::string(kLaterTables) + kIdentify);
}

}  // namespace

// ---- opening ------------------------------------------------------------------------------------

Result<Journal> Journal::open(const std::filesystem::path& path) {
  BATON_ASSIGN(SqlDatabase database, SqlDatabase::open(path));
  Journal journal(std::move(database));
  BATON_TRY(prepare_schema(journal.database_));
  BATON_TRY(journal.count_start());
  journal.database_.reserve_room();
  return journal;
}

Status Journal::count_start() {
  BATON_TRY(database_.execute("UPDATE starts SET epoch = epoch + 1"));
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT epoch FROM starts"));
  BATON_ASSIGN(const bool row, query.step());
  epoch_ = row ? static_cast<std::uint32_t>(query.integer(0)) : 0;
  return {};
}

// ---- reading ------------------------------------------------------------------------------------

Result<std::vector<Digest>> Journal::jobs() {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT digest FROM jobs WHERE archived = 0 ORDER BY position"));
  return query.digests();
}

Status Journal::for_each_completion(const Digest& job,
                                    const std::function<Status(const Completion&)>& visit,
                                    Which which) {
  if (which == Which::done) {
    BATON_TRY(visit_recorded(job, visit));
    return visit_archived(job, visit);
  }
  BATON_ASSIGN(
      SqlStatement query,
      database_.prepare("SELECT kind, step, tile, outputs FROM former_outputs WHERE job = ?"));
  query.bind(job);
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return {};
    Completion former;
    BATON_ASSIGN(former.task, read_task(database_, query, "former_outputs.kind"));
    BATON_TRY(read_blob(database_, query.blob(3), "former_outputs.outputs", former.made.outputs));
    BATON_TRY(visit(former));
  }
}

Status Journal::visit_recorded(const Digest& job,
                               const std::function<Status(const Completion&)>& visit) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT kind, step, tile, outputs, stats, frames FROM completions "
                                 "WHERE job = ? ORDER BY position"));
  query.bind(job);
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return {};
    BATON_ASSIGN(const Completion completion, read_completion(database_, query));
    BATON_TRY(visit(completion));
  }
}

Result<std::map<Digest, std::string>> Journal::owners() {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT job, name FROM owners"));
  std::map<Digest, std::string> owners;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return owners;
    if (const std::optional<Digest> job = Digest::from_hex(query.text(0)))
      owners[*job] = query.text(1);
  }
}

Result<JournalledJob> Journal::load(const Digest& digest) {
  JournalledJob result;
  result.job = digest;
  BATON_ASSIGN(SqlStatement job,
               database_.prepare("SELECT status, document, plan FROM jobs WHERE digest = ?"));
  BATON_ASSIGN(const bool found, job.bind(digest).step());
  if (!found)
    return Error{ErrorKind::internal, fmt::format("{}: no job {}", database_.name(), digest.hex())};
  BATON_TRY(read_enum(database_, job.integer(0), "jobs.status", result.status));
  result.document = job.text(1);
  BATON_TRY(read_blob(database_, job.blob(2), "jobs.plan", result.plan));

  BATON_TRY(for_each_completion(digest, [&](const Completion& completion) -> Status {
    result.completions.add(completion);
    return {};
  }));

  BATON_ASSIGN(result.failures, recent_failures(digest, -1));
  BATON_ASSIGN(SqlStatement renderer,
               database_.prepare("SELECT renderer FROM renderers WHERE job = ?"));
  BATON_ASSIGN(const bool is_known, renderer.bind(digest).step());
  if (is_known) result.renderer = renderer.text(0);
  BATON_ASSIGN(SqlStatement mixed, database_.prepare("SELECT 1 FROM mixed_jobs WHERE job = ?"));
  BATON_ASSIGN(result.is_mixed, mixed.bind(digest).step());
  BATON_TRY(for_each_completion(
      digest,
      [&](const Completion& former) -> Status {
        result.former.push_back({former.task, former.made.outputs});
        return {};
      },
      Which::former));
  return result;
}

Result<std::vector<FrameStats>> Journal::run_stats(const Digest& job, Run run) {
  return stats_of(job, TaskKind::render, run.value());
}

Result<std::optional<FrameStats>> Journal::frame_stats(const Digest& job, FrameIndex frame) {
  BATON_ASSIGN(const std::vector<FrameStats> all, stats_of(job, TaskKind::assemble, frame.value()));
  return all.empty() ? std::nullopt : std::optional(all.front());
}

/// What all tasks of a kind and position have recorded of their steps or frame.
Result<std::vector<FrameStats>> Journal::stats_of(const Digest& job, TaskKind kind,
                                                  std::int32_t position) {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT frames FROM completions "
                                                     "WHERE job = ? AND kind = ? AND step = ?"));
  query.bind(job).bind(kind).bind(position);
  std::vector<FrameStats> all;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return all;
    std::vector<FrameStats> of_tile;
    BATON_TRY(read_blob(database_, query.blob(0), "completions.frames", of_tile));
    all.insert(all.end(), of_tile.begin(), of_tile.end());
  }
}

Result<std::optional<std::string>> Journal::document(const Digest& job) {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT document FROM jobs WHERE digest = ?"));
  BATON_ASSIGN(const bool row, query.bind(job).step());
  return row ? std::optional(query.text(0)) : std::nullopt;
}

Result<std::vector<Failure>> Journal::recent_failures(const Digest& job, int count) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT lease, worker, message, permanent FROM (SELECT * FROM "
                                 "failures WHERE job = ? ORDER BY position DESC LIMIT ?) "
                                 "ORDER BY position"));
  query.bind(job).bind(count);
  std::vector<Failure> failures;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return failures;
    BATON_ASSIGN(Failure failure, read_failure(database_, query));
    failures.push_back(std::move(failure));
  }
}

Result<std::map<FrameIndex, FrameFile>> Journal::frame_files(const Digest& job) {
  BATON_ASSIGN(
      SqlStatement query,
      database_.prepare("SELECT frame, '', 0, 0, 0, position FROM rendered_frames WHERE job = ?1 "
                        "UNION ALL SELECT frame, digest, size_bytes, inode, time_ns, 0 "
                        "FROM frame_files WHERE job = ?1"));
  query.bind(job);
  std::map<FrameIndex, FrameFile> files;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return files;
    FrameFile& file = files[FrameIndex(static_cast<std::int32_t>(query.integer(0)))];
    file.is_gone = query.integer(5) != 0;
    file.rendered = std::max(file.rendered, query.integer(5));
    file.digest = Digest::from_hex(query.text(1)).value_or(Digest());
    file.stamp = {.size_bytes = static_cast<std::uint64_t>(query.integer(2)),
                  .inode = static_cast<std::uint64_t>(query.integer(3)),
                  .time_ns = query.integer(4)};
  }
}

Result<std::optional<std::string>> Journal::store_token() {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT token FROM store_token"));
  BATON_ASSIGN(const bool row, query.step());
  return row ? std::optional(query.text(0)) : std::nullopt;
}

Status Journal::record_store_token(const std::string& token) {
  BATON_TRY(change("DELETE FROM store_token"));
  return change("INSERT INTO store_token (token) VALUES (?)", token);
}

Result<std::set<Digest>> Journal::output_marks() {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT job FROM output_marks"));
  BATON_ASSIGN(const std::vector<Digest> jobs, query.digests());
  return std::set<Digest>(jobs.begin(), jobs.end());
}

Result<std::vector<std::string>> Journal::marked_folders(const Digest& job) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT folder FROM marked_folders WHERE job = ?"));
  query.bind(job);
  return query.texts();
}

// ---- writing ------------------------------------------------------------------------------------

/// A statement for reading, to be bound; sql: a literal.
Result<SqlStatement*> Journal::read(std::string_view sql) {
  const auto known = statements_.find(sql);
  if (known != statements_.end()) return &known->second;
  BATON_ASSIGN(SqlStatement statement, database_.prepare(sql));
  return &statements_.emplace(sql, std::move(statement)).first->second;
}

/// The same within a transaction.
Result<SqlStatement*> Journal::write(std::string_view sql) {
  if (!in_transaction_) BATON_TRY(database_.execute("BEGIN IMMEDIATE"));
  in_transaction_ = true;
  return read(sql);
}

Status Journal::add_job(const Digest& job, const std::string& document, const JobIndex& index) {
  return change(
      "INSERT INTO jobs (digest, status, document, name, folder, plan) VALUES (?, ?, ?, ?, ?, ?)",
      job, JobStatus::running, document, index.name, index.folder, to_bytes(JobPlan{}));
}

Status Journal::record_plan(const Digest& job, const JobPlan& plan) {
  return change("UPDATE jobs SET plan = ? WHERE digest = ?", to_bytes(plan), job);
}

Status Journal::record_owner(const Digest& job, const std::string& owner) {
  return change("INSERT OR REPLACE INTO owners (job, name) VALUES (?, ?)", job, owner);
}

Status Journal::delete_job(const Digest& job) {
  for (const char* const sql :
       {"DELETE FROM completions WHERE job = ?", "DELETE FROM failures WHERE job = ?",
        "DELETE FROM archive WHERE job = ?", "DELETE FROM archived_completions WHERE job = ?",
        "DELETE FROM kept_blobs WHERE job = ?", "DELETE FROM owners WHERE job = ?",
        "DELETE FROM frame_files WHERE job = ?", "DELETE FROM rendered_frames WHERE job = ?",
        "DELETE FROM output_marks WHERE job = ?", "DELETE FROM marked_folders WHERE job = ?",
        "DELETE FROM versions WHERE document = ?", "DELETE FROM renderers WHERE job = ?",
        "DELETE FROM mixed_jobs WHERE job = ?", "DELETE FROM former_renderers WHERE job = ?",
        "DELETE FROM former_outputs WHERE job = ?", "DELETE FROM jobs WHERE digest = ?"})
    BATON_TRY(change(sql, job));
  BATON_TRY(change("DELETE FROM growth WHERE id NOT IN (SELECT id FROM versions)"));
  BATON_TRY(change("DELETE FROM priorities WHERE id NOT IN (SELECT id FROM versions)"));
  BATON_TRY(change("DELETE FROM locked_frames WHERE id NOT IN (SELECT id FROM versions)"));
  BATON_TRY(change("DELETE FROM lock_times WHERE id NOT IN (SELECT id FROM versions)"));
  BATON_TRY(change("DELETE FROM pictures_given_up WHERE id NOT IN (SELECT id FROM versions)"));
  return change("DELETE FROM identities WHERE id NOT IN (SELECT id FROM versions)");
}

Status Journal::record_status(const Digest& job, JobStatus status) {
  return change("UPDATE jobs SET status = ? WHERE digest = ?", status, job);
}

Status Journal::record_completion(const Digest& job, const Completion& completion) {
  const TaskKey& task = completion.task;
  return change(
      "INSERT OR REPLACE INTO completions (job, kind, step, tile, outputs, stats, frames) "
      "VALUES (?, ?, ?, ?, ?, ?, ?)",
      job, task.kind, task.position, task.tile, to_bytes(completion.made.outputs),
      to_bytes(completion.made.stats), to_bytes(completion.made.frames));
}

Status Journal::record_outputs(const Digest& job, const TaskKey& task,
                               const std::vector<BlobRef>& outputs) {
  return change(
      "UPDATE completions SET outputs = ? WHERE job = ? AND kind = ? AND step = ? AND tile = ?",
      to_bytes(outputs), job, task.kind, task.position, task.tile);
}

Status Journal::record_failure(const Failure& failure) {
  return change(
      "INSERT INTO failures (job, lease, worker, message, permanent) VALUES (?, ?, ?, ?, ?)",
      failure.lease.job, to_bytes(failure.lease), failure.worker, failure.message,
      std::int64_t{failure.permanent} | std::int64_t{failure.last} << 1);
}

Status Journal::record_renderer(const Digest& job, const std::string& renderer, bool is_mixed) {
  if (is_mixed) BATON_TRY(change("INSERT OR IGNORE INTO mixed_jobs (job) VALUES (?)", job));
  return change("INSERT OR REPLACE INTO renderers (job, renderer) VALUES (?, ?)", job, renderer);
}

Result<std::set<std::string>> Journal::renderers(const Digest& job) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT renderer FROM renderers WHERE job = ?1 UNION "
                                 "SELECT renderer FROM former_renderers WHERE job = ?1 UNION "
                                 "SELECT '' FROM mixed_jobs WHERE job = ?1"));
  query.bind(job);
  BATON_ASSIGN(const std::vector<std::string> renderers, query.texts());
  return std::set<std::string>(renderers.begin(), renderers.end());
}

Status Journal::record_frame_file(const Digest& job, FrameIndex frame,
                                  const std::optional<FrameFile>& file) {
  if (!file) {
    return change("DELETE FROM frame_files WHERE job = ? AND frame = ?", job,
                  std::int64_t{frame.value()});
  }
  if (file->rendered != 0) {
    BATON_TRY(change("INSERT OR REPLACE INTO rendered_frames (job, frame) VALUES (?, ?)", job,
                     std::int64_t{frame.value()}));
  }
  return change(
      "INSERT OR REPLACE INTO frame_files (job, frame, digest, size_bytes, inode, time_ns) "
      "VALUES (?, ?, ?, ?, ?, ?)",
      job, std::int64_t{frame.value()}, file->digest,
      static_cast<std::int64_t>(file->stamp.size_bytes),
      static_cast<std::int64_t>(file->stamp.inode), file->stamp.time_ns);
}

Status Journal::record_output_mark(const Digest& job, const std::optional<std::string>& folder) {
  if (!folder) return change("DELETE FROM output_marks WHERE job = ?", job);
  BATON_TRY(record_marked_folder(job, *folder));
  return change("INSERT OR IGNORE INTO output_marks (job) VALUES (?)", job);
}

Status Journal::record_marked_folder(const Digest& job, const std::string& folder) {
  return change("INSERT OR IGNORE INTO marked_folders (folder, job) VALUES (?, ?)", folder, job);
}

Status Journal::record_reopened(const Digest& job, const std::vector<TaskKey>& tasks,
                                const std::vector<Completions::Task>& former) {
  for (const Completions::Task& before : former) {
    BATON_TRY(change("INSERT OR REPLACE INTO former_outputs VALUES (?, ?, ?, ?, ?)", job,
                     before.task.kind, before.task.position, before.task.tile,
                     to_bytes(before.outputs)));
  }
  for (const TaskKey& task : tasks) {
    BATON_TRY(change("DELETE FROM completions WHERE job = ? AND kind = ? AND step = ? AND tile = ?",
                     job, task.kind, task.position, task.tile));
  }
  return {};
}

Status Journal::commit() {
  if (!in_transaction_) return {};
  in_transaction_ = false;
  BATON_TRY(database_.execute("COMMIT"));
  database_.reserve_room();
  return database_.expect_named();
}

}  // namespace baton

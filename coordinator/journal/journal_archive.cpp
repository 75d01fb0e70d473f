#include <fmt/format.h>

#include <map>
#include <utility>

#include "common/base/archive.h"
#include "common/base/section_packing.h"
#include "coordinator/journal/journal.h"

namespace baton {
namespace {

/// How many of a job stand in one piece, so that no piece is large once unpacked.
constexpr std::size_t kCompletionsPerPiece = 4096;

constexpr int kMaxFound = 20;

/// That a worker may have written a frame stays.
constexpr const char* kForgetFrameFiles =
    "UPDATE frame_files SET digest = '', size_bytes = 0, inode = 0, time_ns = 0 WHERE job = ?";

}  // namespace

Status Journal::archive_job(const Digest& job, const Bytes& summary, const Bytes& detail,
                            const std::vector<BlobRef>& kept) {
  // The completions, piece by piece.
  SectionPacker packer;
  std::vector<Completion> piece;
  const auto store = [&]() -> Status {
    if (piece.empty()) return {};
    const Bytes raw = to_bytes(std::exchange(piece, {}));
    Bytes packed;
    const bool stored_raw = packer.append(raw, 1, Packing::zstd, packed);
    return change(
        "INSERT INTO archived_completions (job, raw_bytes, stored_raw, packed) VALUES (?, ?, ?, ?)",
        job, static_cast<std::int64_t>(raw.size()), std::int64_t{stored_raw}, packed);
  };
  // Not those that the archive has: they are the ones that are written here.
  BATON_TRY(visit_recorded(job, [&](const Completion& c) -> Status {
    piece.push_back(c);
    return piece.size() < kCompletionsPerPiece ? Status() : store();
  }));
  BATON_TRY(store());

  BATON_TRY(
      change("INSERT INTO archive (job, summary, detail) VALUES (?, ?, ?)", job, summary, detail));
  for (const BlobRef& blob : kept) {
    BATON_TRY(change("INSERT OR IGNORE INTO kept_blobs VALUES (?, ?, ?)", blob.digest, job,
                     static_cast<std::int64_t>(blob.size_bytes)));
  }
  for (const char* const sql :
       {"DELETE FROM completions WHERE job = ?", "DELETE FROM failures WHERE job = ?",
        kForgetFrameFiles, "UPDATE jobs SET archived = 1 WHERE digest = ?"})
    BATON_TRY(change(sql, job));
  return {};
}

Status Journal::restart_job(const Digest& job) {
  for (const char* const sql :
       {"INSERT OR IGNORE INTO former_renderers SELECT job, renderer FROM renderers WHERE job = ?",
        "INSERT OR IGNORE INTO former_renderers SELECT job, '' FROM mixed_jobs WHERE job = ?",
        "DELETE FROM archive WHERE job = ?", "DELETE FROM archived_completions WHERE job = ?",
        "DELETE FROM kept_blobs WHERE job = ?", "DELETE FROM failures WHERE job = ?",
        "DELETE FROM completions WHERE job = ?", "DELETE FROM former_outputs WHERE job = ?",
        kForgetFrameFiles, "DELETE FROM renderers WHERE job = ?",
        "DELETE FROM mixed_jobs WHERE job = ?", "UPDATE jobs SET archived = 0 WHERE digest = ?"})
    BATON_TRY(change(sql, job));
  return record_status(job, JobStatus::running);
}

Status Journal::visit_archived(const Digest& job,
                               const std::function<Status(const Completion&)>& visit) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT raw_bytes, stored_raw, packed FROM archived_completions "
                                 "WHERE job = ? ORDER BY position"));
  query.bind(job);
  SectionUnpacker unpacker;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return {};
    const auto raw_bytes = static_cast<std::size_t>(query.integer(0));
    Result<Bytes> raw = unpacker.unpack(query.blob(2), query.integer(1) != 0, 1, raw_bytes);
    std::vector<Completion> piece;
    bool complete = raw.ok();
    if (complete) {
      ArchiveReader reader(*raw);
      reader(piece);
      complete = reader.complete();
    }
    if (!complete) {
      return Error{ErrorKind::corrupt,
                   fmt::format("{}: the archived completions of job {} cannot be read",
                               database_.name(), job.hex())};
    }
    for (const Completion& completion : piece) BATON_TRY(visit(completion));
  }
}

Status Journal::describe_archived(const Digest& job, JobStatus status, const Bytes& summary,
                                  const Bytes& detail) {
  BATON_TRY(
      change("UPDATE archive SET summary = ?, detail = ? WHERE job = ?", summary, detail, job));
  return record_status(job, status);
}

Result<std::optional<Bytes>> Journal::archived_detail(const Digest& job) {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT detail FROM archive WHERE job = ?"));
  BATON_ASSIGN(const bool row, query.bind(job).step());
  if (!row) return std::optional<Bytes>();
  const ByteView bytes = query.blob(0);
  return std::optional(Bytes(bytes.begin(), bytes.end()));
}

Result<std::vector<Bytes>> Journal::archived_summaries(int count) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT summary FROM (SELECT * FROM archive ORDER BY position "
                                 "DESC LIMIT ?) ORDER BY position"));
  query.bind(count);
  std::vector<Bytes> summaries;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return summaries;
    const ByteView bytes = query.blob(0);
    summaries.emplace_back(bytes.begin(), bytes.end());
  }
}

Result<std::vector<Digest>> Journal::jobs_in(const std::function<bool(const std::string&)>& is_it,
                                             const std::optional<std::string>& name) {
  BATON_ASSIGN(
      SqlStatement names,
      database_.prepare("SELECT folder FROM jobs UNION SELECT folder FROM marked_folders"));
  std::vector<std::string> folders;
  while (true) {
    BATON_ASSIGN(const bool row, names.step());
    if (!row) break;
    if (std::string folder = names.text(0); is_it(folder)) folders.push_back(std::move(folder));
  }
  std::map<std::int64_t, Digest> found;
  for (const std::string& folder : folders) {
    BATON_ASSIGN(SqlStatement query,
                 database_.prepare(fmt::format(
                     "SELECT position, digest FROM jobs WHERE (folder = ?1 OR digest IN (SELECT "
                     "job FROM marked_folders WHERE folder = ?1)) AND {}",
                     name ? "name = ?2" : "?2 = ?2")));
    query.bind(folder).bind(name.value_or(""));
    while (true) {
      BATON_ASSIGN(const bool row, query.step());
      if (!row) break;
      if (const std::optional<Digest> job = Digest::from_hex(query.text(1)))
        found[query.integer(0)] = *job;
    }
  }
  std::vector<Digest> jobs;
  for (const auto& [position, job] : found) jobs.push_back(job);
  return jobs;
}

Result<std::vector<FoundJob>> Journal::find_jobs(const std::string& text) {
  // An ID or a digest is its own beginning; of hexadecimal digits 'g' is past the last.
  BATON_ASSIGN(SqlStatement query,
               database_.prepare(
                   "SELECT digest, status, name = ?1, mine.id FROM jobs JOIN versions AS mine "
                   "ON mine.document = digest WHERE NOT EXISTS (SELECT 1 FROM versions AS later "
                   "WHERE later.id = mine.id AND later.number > mine.number) AND "
                   "(name = ?1 OR mine.id IN (SELECT id FROM versions WHERE "
                   "(id >= ?1 AND id < ?1 || 'g') OR (document >= ?1 AND document < ?1 || "
                   "'g'))) ORDER BY position LIMIT ?"));
  query.bind(text).bind(kMaxFound);
  std::vector<FoundJob> found;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return found;
    const std::optional<Digest> digest = Digest::from_hex(query.text(0));
    if (!digest) continue;
    found.push_back({.job = *digest,
                     .status = static_cast<JobStatus>(query.integer(1)),
                     .is_named = query.integer(2) != 0,
                     .id = JobId::from_hex(query.text(3)).value_or(JobId())});
  }
}

Result<bool> Journal::is_kept(const Digest& blob) {
  BATON_ASSIGN(SqlStatement * query, read("SELECT 1 FROM kept_blobs WHERE blob = ? LIMIT 1"));
  BATON_ASSIGN(const bool row, query->bind(blob).step());
  query->reset();
  return row;
}

Result<std::vector<Digest>> Journal::kept_blobs(const Digest& job) {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT blob FROM kept_blobs WHERE job = ?"));
  query.bind(job);
  return query.digests();
}

Result<std::uint64_t> Journal::kept_bytes() {
  BATON_ASSIGN(SqlStatement * query, read("SELECT size_bytes FROM kept"));
  BATON_ASSIGN(const bool row, query->step());
  const std::uint64_t bytes = row ? static_cast<std::uint64_t>(query->integer(0)) : 0;
  query->reset();
  return bytes;
}

Status Journal::let_go(const Digest& job, const Digest& blob) {
  return change("DELETE FROM kept_blobs WHERE blob = ? AND job = ?", blob, job);
}

}  // namespace baton

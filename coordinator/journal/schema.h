#pragma once

#include <cstdint>

namespace baton {

/// Stands in `PRAGMA user_version`.
inline constexpr std::int64_t kSchemaVersion = 9;
inline constexpr std::int64_t kApplicationId = 0x4241544e;  // "BATN"

// Digests, keys and statuses are written as numbers and hexadecimal text, so that the sqlite3 shell
// shows them; outputs, statistics and leases in the form of common/base/archive.h: a change of
// BlobRef, RenderStats, FrameStats, LeaseId or JobDetail is a new schema version. Of `permanent`
// bit 0 says that no retry by this worker can help, bit 1 that the task has failed for good with
// it. The completions of a job in the archive are pieces, packed by zstd (journal_archive.cpp).
// `kept` is what the blobs of kept_blobs take, each counted once.
inline constexpr const char* kSchema = R"sql(
  CREATE TABLE starts (epoch INTEGER NOT NULL);
  INSERT INTO starts VALUES (0);
  CREATE TABLE jobs (
    position INTEGER PRIMARY KEY AUTOINCREMENT,
    digest TEXT NOT NULL UNIQUE,
    status INTEGER NOT NULL,
    document TEXT NOT NULL,
    name TEXT NOT NULL,
    folder TEXT NOT NULL,
    plan BLOB NOT NULL,
    archived INTEGER NOT NULL DEFAULT 0);
  CREATE INDEX jobs_by_name ON jobs (name);
  CREATE INDEX jobs_by_folder ON jobs (folder);
  CREATE INDEX open_jobs ON jobs (position) WHERE archived = 0;
  CREATE TABLE completions (
    position INTEGER PRIMARY KEY AUTOINCREMENT,
    job TEXT NOT NULL,
    kind INTEGER NOT NULL, step INTEGER NOT NULL, tile INTEGER NOT NULL,
    outputs BLOB NOT NULL,
    stats BLOB NOT NULL,
    frames BLOB NOT NULL,
    UNIQUE (job, kind, step, tile));
  CREATE TABLE failures (
    position INTEGER PRIMARY KEY AUTOINCREMENT,
    job TEXT NOT NULL,
    lease BLOB NOT NULL,
    worker TEXT NOT NULL,
    message TEXT NOT NULL,
    permanent INTEGER NOT NULL);
  CREATE INDEX failures_by_job ON failures (job);
  CREATE TABLE archive (
    position INTEGER PRIMARY KEY,
    job TEXT NOT NULL UNIQUE,
    summary BLOB NOT NULL, detail BLOB NOT NULL);
  CREATE TABLE archived_completions (
    position INTEGER PRIMARY KEY,
    job TEXT NOT NULL,
    raw_bytes INTEGER NOT NULL, stored_raw INTEGER NOT NULL, packed BLOB NOT NULL);
  CREATE INDEX archived_completions_by_job ON archived_completions (job);
  CREATE TABLE kept_blobs (
    blob TEXT NOT NULL, job TEXT NOT NULL, size_bytes INTEGER NOT NULL,
    PRIMARY KEY (blob, job)) WITHOUT ROWID;
  CREATE INDEX kept_blobs_by_job ON kept_blobs (job);
  CREATE TABLE kept (size_bytes INTEGER NOT NULL);
  INSERT INTO kept VALUES (0);
  CREATE TRIGGER keep_blob BEFORE INSERT ON kept_blobs
    WHEN NOT EXISTS (SELECT 1 FROM kept_blobs WHERE blob = new.blob)
    BEGIN UPDATE kept SET size_bytes = size_bytes + new.size_bytes; END;
  CREATE TRIGGER let_blob_go AFTER DELETE ON kept_blobs
    WHEN NOT EXISTS (SELECT 1 FROM kept_blobs WHERE blob = old.blob)
    BEGIN UPDATE kept SET size_bytes = size_bytes - old.size_bytes; END;
  CREATE TABLE owners (job TEXT PRIMARY KEY, name TEXT NOT NULL);
)sql";

/// Tables that a journal of this version may lack: it gets them when it is opened, and an earlier
/// program leaves them alone. `frame_files` says how a frame's file stood when it had this digest
/// (none: a worker may have written it), `rendered_frames` in which order jobs have last rendered
/// frames, whatever has become of them since, `output_marks` of which open jobs the output folder
/// is marked; store_token has one row, or none. `renderers`: by what the tasks of a job were done
/// that are done, the last ones of `mixed_jobs`; `former_renderers`: by what those that are
/// forgotten, empty where they were mixed. Where other tables say `job`, they mean the digest of a
/// document: a version. `versions` says of which job (JobId) it is the n-th, `identities` when what
/// happened to that job, `locked_frames` which of its frames count as done whatever is in their
/// files and `lock_times` when that last changed, `priorities` which priority a person has set in
/// place of the one that is written in its document, `growth` how it has come by its sweeps.
/// `former_outputs` is what tasks made that were opened again: it must come out alike.
/// `pictures_given_up` are those that a job may replace though no job has written them;
/// `marked_folders` what output folders were, without links, when a job marked them, or a frame in
/// them was locked. `events` is appended to alone (FarmEvent), without an index, which would cost
/// more than it saves; its last row stays, so that no number is given twice. Of those that are old,
/// `event_sums` keeps count and seconds.
inline constexpr const char* kLaterTables = R"sql(
  CREATE TABLE IF NOT EXISTS frame_files (
    job TEXT NOT NULL, frame INTEGER NOT NULL, digest TEXT NOT NULL,
    size_bytes INTEGER NOT NULL, inode INTEGER NOT NULL, time_ns INTEGER NOT NULL,
    PRIMARY KEY (job, frame)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS rendered_frames (
    position INTEGER PRIMARY KEY AUTOINCREMENT,
    job TEXT NOT NULL, frame INTEGER NOT NULL, UNIQUE (job, frame));
  CREATE TABLE IF NOT EXISTS output_marks (job TEXT PRIMARY KEY) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS store_token (token TEXT NOT NULL);
  CREATE TABLE IF NOT EXISTS renderers (job TEXT PRIMARY KEY, renderer TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS mixed_jobs (job TEXT PRIMARY KEY) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS former_renderers (
    job TEXT NOT NULL, renderer TEXT NOT NULL, PRIMARY KEY (job, renderer)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS versions (
    document TEXT PRIMARY KEY, id TEXT NOT NULL, number INTEGER NOT NULL,
    UNIQUE (id, number)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS identities (
    id TEXT PRIMARY KEY, submitted_ms INTEGER NOT NULL DEFAULT 0,
    started_ms INTEGER NOT NULL DEFAULT 0, ended_ms INTEGER NOT NULL DEFAULT 0) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS events (
    sequence INTEGER PRIMARY KEY, time_ms INTEGER NOT NULL, kind INTEGER NOT NULL,
    actor TEXT NOT NULL, job TEXT NOT NULL,
    task INTEGER, first_frame INTEGER, last_frame INTEGER, tile INTEGER, attempt INTEGER,
    worker TEXT NOT NULL, reason TEXT NOT NULL, seconds REAL NOT NULL);
  CREATE TABLE IF NOT EXISTS event_sums (
    job TEXT NOT NULL, kind INTEGER NOT NULL, count INTEGER NOT NULL, seconds REAL NOT NULL,
    PRIMARY KEY (job, kind)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS priorities (
    id TEXT PRIMARY KEY, written INTEGER NOT NULL, wanted INTEGER NOT NULL) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS locked_frames (
    id TEXT NOT NULL, frame INTEGER NOT NULL, PRIMARY KEY (id, frame)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS lock_times (
    id TEXT PRIMARY KEY, changed_ms INTEGER NOT NULL) WITHOUT ROWID;
  DROP TABLE IF EXISTS given_up;
  CREATE TABLE IF NOT EXISTS pictures_given_up (
    id TEXT NOT NULL, file TEXT NOT NULL, digest TEXT NOT NULL,
    PRIMARY KEY (id, file)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS marked_folders (
    folder TEXT NOT NULL, job TEXT NOT NULL, PRIMARY KEY (folder, job)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS former_outputs (
    job TEXT NOT NULL, kind INTEGER NOT NULL, step INTEGER NOT NULL, tile INTEGER NOT NULL,
    outputs BLOB NOT NULL, PRIMARY KEY (job, kind, step, tile)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS growth (
    id TEXT PRIMARY KEY, since_ms INTEGER NOT NULL, sweeps INTEGER NOT NULL,
    said TEXT NOT NULL) WITHOUT ROWID;
)sql";

/// Jobs of a journal that knew no identities go by the beginning of their digest.
inline constexpr const char* kIdentify = R"sql(
  INSERT OR IGNORE INTO versions (document, id, number)
    SELECT digest, substr(digest, 1, 16), 1 FROM jobs
    WHERE digest NOT IN (SELECT document FROM versions);
  INSERT OR IGNORE INTO identities (id) SELECT id FROM versions;
)sql";

}  // namespace baton

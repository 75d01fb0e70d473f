#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/files.h"
#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/image/image_io.h"
#include "common/job/job_spec.h"
#include "common/job/task.h"

namespace baton {

/// Rows of a frame that are compared with its film after it was written: one block of compression.
inline constexpr int kRowsVerified = 16;

/// A frame in the output folder, and what was seen of its film.
struct WrittenFrame {
  BlobRef file;
  FrameQuality quality;
};

/// Writes one finished frame as EXR with the job's name, digest and program version in its header.
/// What is below zero is set to 0 where the job wants that. With a plate, which is as large as the
/// whole image, the frame is then laid over it; the plate's own values stay. Colours past a half
/// float make those of the frame float32; planes that no AOV of the job has are left out.
///
/// Before the file gets its name it is read back from disk: every byte must be the encoder's, the
/// header and the table of blocks must be whole, and one block of rows, another one in each frame,
/// must unpack to the film. may_replace is asked last, with the digest of the file: whether what is
/// in its place may go; a job may have made way for another while the frame was written, and its
/// place be taken. A disk that is away for a moment is waited for, until `stop` is requested.
/// Errors: the disk, a file that is not what was written, that of may_replace; timeout, something
/// is in its place that is not seen here and might not go; bad_input, its folder is in none of
/// `roots` (write_file_atomic).
Result<WrittenFrame> write_frame(
    const JobSpec& job, const Digest& job_digest, FrameIndex frame, FilmTile image,
    const std::optional<RgbImage>& plate = {},
    const std::function<Result<bool>(const Digest& made)>& may_replace = {},
    const std::stop_token& stop = {}, const Roots& roots = {}, const Lend& lend = lend_nobody);

/// Checks that the EXR file at `path` has the size and the channels of `image`, and in block
/// `block` (0-based, modulo the number of blocks) its values. ErrorKind::corrupt names channel and
/// pixel.
Status verify_frame(const std::filesystem::path& path, const FilmTile& image, std::int32_t block);

/// The header attributes that Baton adds to its images: what they are made from, what was seen of
/// them, and the job's own metadata as baton:metadata:NAME.
ImageMetadata frame_metadata(const JobSpec& job, const Digest& job_digest, FrameNumber frame,
                             const FrameQuality& quality);

}  // namespace baton

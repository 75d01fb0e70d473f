#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/image/image_io.h"
#include "common/job/job_spec.h"
#include "common/job/task.h"

namespace baton {

/// A black image of the job's size.
FilmTile blank_image(const ImageSpec& spec, std::vector<std::string> channels);

/// Copies the pixels of `tile` into `image`. Error when the channels differ or the tile leaves the
/// image.
Status paste_tile(const FilmTile& tile, FilmTile& image);

/// Where frame `frame_index` (0-based) of the job is written.
std::filesystem::path frame_path(const JobSpec& job, std::int32_t frame_index);

/// Writes one finished frame as EXR with the job's name, digest and program version in its header,
/// reads it back and compares every channel; only then is it reported. Error: the disk, or a file
/// that does not hold what was written.
Result<BlobRef> write_frame(const JobSpec& job, const Digest& job_digest, std::int32_t frame_index,
                            const FilmTile& image);

/// The header attributes that Baton adds to its pictures.
ImageMetadata frame_metadata(const JobSpec& job, const Digest& job_digest, int frame_number);

}  // namespace baton

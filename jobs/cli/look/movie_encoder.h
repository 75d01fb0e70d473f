#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/image/image_io.h"
#include "jobs/cli/child_process.h"

namespace baton {

/// The endings of movies that `ffmpeg` is asked to make: ".mp4", ".webm", ".webp".
bool is_movie_name(const std::filesystem::path& path);

/// A movie that the program `ffmpeg` encodes. Frames go to it through a socket, so nothing but the
/// movie touches the disk; it gets its name when it is whole.
class MovieEncoder {
 public:
  /// path: is_movie_name. width, height: of all frames, pixels. frames_per_second: as ffmpeg reads
  /// it, "24" or "24000/1001". Error: the folder cannot be made.
  static Result<MovieEncoder> start(const std::filesystem::path& path, int width, int height,
                                    const std::string& frames_per_second);
  MovieEncoder(MovieEncoder&& other) noexcept = default;
  ~MovieEncoder();

  /// Linear light in [0, 1], as write_png takes it. Error: what ffmpeg said before it ended, or
  /// that there is none.
  Status add(const RgbImage& frame);
  /// Waits for the movie. Errors: as add's.
  Status finish();

 private:
  MovieEncoder(std::filesystem::path path, int width, int height, FileDescriptor socket,
               MemoryFile log, ChildProcess program)
      : path_(std::move(path)),
        width_(width),
        height_(height),
        socket_(std::move(socket)),
        log_(std::move(log)),
        program_(std::move(program)) {}
  Error failure(const std::string& how) const;

  std::filesystem::path path_;
  int width_, height_;
  FileDescriptor socket_;  ///< to ffmpeg
  MemoryFile log_;         ///< what it prints
  ChildProcess program_;
};

}  // namespace baton

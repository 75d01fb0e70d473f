#include "jobs/cli/look/movie_encoder.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::minutes kPatience{10};  // for what is left when the last frame was sent

/// How a kind of movie is encoded: its ending, ffmpeg's name of the container, and its options.
struct MovieKind {
  std::string_view ending;
  std::string_view container;
  std::vector<std::string> options;
};
const std::vector<MovieKind>& movie_kinds() {
  static const std::vector<MovieKind> kKinds{
      {".mp4", "mp4", {"-c:v", "libx264", "-crf", "16", "-movflags", "+faststart"}},
      {".webm", "webm", {"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-row-mt", "1"}},
      {".webp", "webp", {"-c:v", "libwebp", "-quality", "90", "-loop", "0"}},
  };
  return kKinds;
}

const MovieKind* kind_of(const fs::path& path) {
  const auto found =
      std::ranges::find(movie_kinds(), path.extension().string(),
                        [](const MovieKind& kind) { return std::string(kind.ending); });
  return found == movie_kinds().end() ? nullptr : &*found;
}

/// Players want colours at half the size: even sides.
int even(int side) { return side + side % 2; }

fs::path unfinished(const fs::path& path) { return path.string() + ".part"; }

/// The encoded colours are those of HDTV with the curve of sRGB, and the file says so.
std::vector<std::string> ffmpeg_command(const fs::path& path, int width, int height,
                                        const std::string& frames_per_second) {
  const MovieKind& kind = *kind_of(path);
  std::vector<std::string> command{"ffmpeg",
                                   "-loglevel",
                                   "error",
                                   "-nostdin",
                                   "-y",
                                   "-f",
                                   "rawvideo",
                                   "-pixel_format",
                                   "rgb24",
                                   "-video_size",
                                   fmt::format("{}x{}", even(width), even(height)),
                                   "-framerate",
                                   frames_per_second,
                                   "-i",
                                   "pipe:0",
                                   "-vf",
                                   "scale=out_color_matrix=bt709:out_range=tv",
                                   "-pix_fmt",
                                   "yuv420p",
                                   "-colorspace",
                                   "bt709",
                                   "-color_primaries",
                                   "bt709",
                                   "-color_trc",
                                   "iec61966-2-1"};
  command.insert(command.end(), kind.options.begin(), kind.options.end());
  command.insert(command.end(),
                 {"-f", std::string(kind.container), "file:" + unfinished(path).string()});
  return command;
}

/// sRGB bytes with even sides: the last column and row once more where they are odd.
std::vector<std::uint8_t> even_bytes(const RgbImage& frame) {
  const std::vector<std::uint8_t> bytes = to_srgb8(frame);
  const auto row_bytes = 3 * static_cast<std::ptrdiff_t>(frame.width);
  std::vector<std::uint8_t> padded;
  for (int y = 0; y < even(frame.height); ++y) {
    const auto row = bytes.begin() + std::min(y, frame.height - 1) * row_bytes;
    padded.insert(padded.end(), row, row + row_bytes);
    if (frame.width % 2 != 0) padded.insert(padded.end(), row + row_bytes - 3, row + row_bytes);
  }
  return padded;
}

}  // namespace

bool is_movie_name(const fs::path& path) { return kind_of(path) != nullptr; }

Result<MovieEncoder> MovieEncoder::start(const fs::path& path, int width, int height,
                                         const std::string& frames_per_second) {
  BATON_CHECK(is_movie_name(path) && width > 0 && height > 0);
  std::error_code error;
  if (!path.parent_path().empty()) fs::create_directories(path.parent_path(), error);
  if (error) return Error{ErrorKind::io, fmt::format("{}: {}", path.string(), error.message())};
  std::array<int, 2> ends{-1, -1};
  BATON_ASSIGN(MemoryFile log, MemoryFile::open(path.string()));
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return Error{ErrorKind::io, fmt::format("{}: {}", path.string(), std::strerror(errno))};
  FileDescriptor ours(ends[0]);
  const FileDescriptor its(ends[1]);
  BATON_ASSIGN(ChildProcess program,
               ChildProcess::start(ffmpeg_command(path, width, height, frames_per_second),
                                   {.output = log.number(), .input = its.number()}));
  return MovieEncoder(path, width, height, std::move(ours), std::move(log), std::move(program));
}

MovieEncoder::~MovieEncoder() {
  if (log_.number() < 0) return;
  socket_.close();
  std::error_code error;
  fs::remove(unfinished(path_), error);
}

Error MovieEncoder::failure(const std::string& how) const {
  const std::string said = log_.last_line();
  if (said.empty() && how == ChildProcess::kCannotBeRun) {
    return {ErrorKind::io,
            fmt::format("{}: the program ffmpeg, of Debian's package ffmpeg, is not there; frames "
                        "as PNG, --out FOLDER, do without",
                        path_.string())};
  }
  return {ErrorKind::io, fmt::format("{}: ffmpeg: {}", path_.string(), said.empty() ? how : said)};
}

Status MovieEncoder::add(const RgbImage& frame) {
  BATON_CHECK(frame.width == width_ && frame.height == height_);
  const std::vector<std::uint8_t> bytes = even_bytes(frame);
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    // No SIGPIPE where it has ended: what it said is the error.
    const ssize_t count =
        ::send(socket_.number(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const std::string fault = std::strerror(errno);
      program_.wait_for_end(std::chrono::seconds(10));
      return failure(program_.ended().value_or(fault));
    }
    sent += static_cast<std::size_t>(count);
  }
  return {};
}

Status MovieEncoder::finish() {
  socket_.close();
  program_.wait_for_end(kPatience);
  const std::string how = program_.ended().value_or("does not end");
  if (how != ChildProcess::kSuccess) return failure(how);
  std::error_code error;
  fs::rename(unfinished(path_), path_, error);
  if (error) return Error{ErrorKind::io, fmt::format("{}: {}", path_.string(), error.message())};
  return {};
}

}  // namespace baton

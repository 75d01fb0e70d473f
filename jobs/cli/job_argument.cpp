#include "jobs/cli/job_argument.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <vector>

#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/scene/settle/settle_motion.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

std::string check_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals != text.npos && equals > 0) return {};
  return fmt::format("expected KEY=VALUE, such as image.sites=1, got \"{}\"", text);
}

/// As a shell reads it: in single quotes where need be.
std::string quoted(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789_-+=./,:@%") == word.npos;
  if (plain) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

void add_job_argument(CLI::App& command, JobArgument& argument) {
  command.add_option("JOB", argument.file, "job file")->required();
  add_override_options(command, argument);
}

void add_override_options(CLI::App& command, JobArgument& argument) {
  command.add_option("--frames", argument.frames, "only these frames: 12, 1-48x4, 1,5,9-12");
  command.add_option("--scale", argument.scale, "a smaller picture: its sides times this, (0, 1]");
  command.add_option("--region", argument.region,
                     "X,Y,WIDTH,HEIGHT: only this part, in pixels of the picture before --scale");
  command
      .add_option("--set", argument.set,
                  "KEY=VALUE in place of what the job says, such as sampling.numParticles=8; keys "
                  "as `baton check --explain` prints them")
      ->check(CLI::Validator(check_setting, "KEY=VALUE"))
      ->expected(1)
      ->take_all()
      ->allow_extra_args(false);
}

std::vector<JobOverride> overrides_of(const JobArgument& argument) {
  std::vector<JobOverride> overrides;
  if (!argument.frames.empty())
    overrides.push_back({"frames", fmt::format("\"{}\"", argument.frames), "--frames"});
  if (!argument.scale.empty()) overrides.push_back({"image.scale", argument.scale, "--scale"});
  if (!argument.region.empty())
    overrides.push_back({"image.region", fmt::format("[{}]", argument.region), "--region"});
  for (const std::string& setting : argument.set) {
    const std::size_t equals = setting.find('=');
    overrides.push_back({setting.substr(0, equals), setting.substr(equals + 1), "--set"});
  }
  return overrides;
}

std::string typed_again(const CLI::App& command, const std::set<std::string>& without) {
  std::string text;
  std::set<const CLI::Option*> said;
  for (const CLI::Option* const option : command.parse_order()) {
    const std::string name = option->get_positional() ? "" : option->get_name();
    if (without.contains(name) || !said.insert(option).second) continue;
    for (const std::string& value : option->results()) {
      if (!name.empty()) text += (text.empty() ? "" : " ") + name;
      if (option->get_items_expected_max() > 0) text += (text.empty() ? "" : " ") + quoted(value);
    }
  }
  return text;
}

Result<JobSpec> load_wanted(const JobArgument& argument, bool look) {
  const std::vector<JobOverride> overrides = overrides_of(argument);
  BATON_ASSIGN(JobSpec job, load_job(argument.file, overrides));
  if (overrides.empty() && !look) return job;

  const Result<JobSpec> plain = load_job(argument.file);
  const bool changed = !plain || *plain != job;
  const bool own_folder = plain && plain->output.directory != job.output.directory;
  if ((look || changed) && !own_folder) {
    job.output.directory += "-look";
    job.output.is_look = true;
  }
  return job;
}

void add_from_frame_option(CLI::App& command, std::optional<FrameNumber>& frame) {
  command.add_option_function<int>(
      "--from-frame", [&frame](int number) { frame = FrameNumber(number); },
      "keep the frames before this one, of whatever picture they are, and render "
      "from here on afresh, in place of those that are there");
}

Status begin_at(JobSpec& job, std::optional<FrameNumber> frame) {
  if (!frame) return {};
  const FrameNumber last = job.frames.back();
  std::vector<FrameNumber> absent;
  // Where the folder is not seen from here, nothing is known of it.
  std::error_code error;
  const std::filesystem::path folder = job.output.directory;
  const bool is_seen = std::filesystem::is_directory(folder.parent_path(), error);
  for (FrameIndex place; is_seen && place.index() < job.frames.size(); ++place) {
    const FrameNumber number = job.frames[place.index()];
    if (number < *frame && !std::filesystem::exists(frame_path(job, place), error))
      absent.push_back(number);
  }
  if (!absent.empty())
    tell("frames {} are not there, and stay so with --from-frame {}\n", format_frames(absent),
         *frame);
  std::erase_if(job.frames, [&](FrameNumber number) { return number < *frame; });
  if (!job.frames.empty()) return {};
  return Error{ErrorKind::usage,
               fmt::format("--from-frame {}: the last frame of the job is {}", *frame, last)};
}

Result<JobSpec> load_settled(const JobArgument& argument, bool look) {
  BATON_ASSIGN(JobSpec job, load_wanted(argument, look));
  std::vector<std::string> left_out;
  BATON_ASSIGN(job, settle_motion(std::move(job), &left_out));
  for (const std::string& line : left_out) spdlog::warn("{}", line);
  return job;
}

}  // namespace baton

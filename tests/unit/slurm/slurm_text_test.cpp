#include "jobs/slurm/slurm_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace baton {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(SlurmText, WalltimesAreThoseOfSbatch) {
  const auto seconds = [](const char* text) { return parse_walltime(text).value(); };
  EXPECT_EQ(seconds("90"), 5400);
  EXPECT_EQ(seconds("0:30"), 30);
  EXPECT_EQ(seconds("2:00:00"), 7200);
  EXPECT_EQ(seconds("1-12"), 129600);
  EXPECT_EQ(seconds("1-0:30"), 88200);
  EXPECT_EQ(seconds("1-0:0:5"), 86405);
  for (const char* text : {"", "0", "two hours", "1:2:3:4", "-5", "1-", "2h", "99999999999"})
    EXPECT_FALSE(parse_walltime(text)) << text;
}

TEST(SlurmText, NodesAreANumberOrARange) {
  EXPECT_EQ(parse_node_range("4")->least, 4);
  EXPECT_EQ(parse_node_range("4")->most, 4);
  EXPECT_EQ(parse_node_range("1-8")->most, 8);
  for (const char* text : {"", "0", "0-0", "8-1", "1-2-3", "1-1001", "many"})
    EXPECT_FALSE(parse_node_range(text)) << text;
}

PilotJob pilot_job() {
  PilotJob job;
  job.worker = "/opt/it's/baton-worker";
  job.endpoint = "tcp://login:5570";
  job.key = "/keys/worker.key";
  job.script_log = "/farm/%A_%a.log";
  job.job_name = "baton-1f00";
  job.partition = "cpu";
  job.time = "2:00:00";
  job.time_s = 7200;
  job.worker_arguments = {"--idle-exit", "300"};
  job.sbatch_arguments = {"--account=film"};
  return job;
}

TEST(SlurmText, AScriptQuotesItsWords) {
  const std::string script = pilot_script(pilot_job());
  EXPECT_THAT(script, StartsWith("#!/bin/sh\n"));
  EXPECT_THAT(script,
              HasSubstr("exec '/opt/it'\\''s/baton-worker' --coordinator 'tcp://login:5570'"));
  EXPECT_THAT(script, HasSubstr("--key '/keys/worker.key'"));
  EXPECT_THAT(script, HasSubstr("$(date +%s) + 7200"));
  EXPECT_THAT(script, HasSubstr("'--idle-exit' '300'"));
}

TEST(SlurmText, SbatchGetsOneNodeForEachPilot) {
  PilotJob job = pilot_job();
  const std::vector<std::string> command = sbatch_command(job, 3, "/farm/pilot.sh");
  for (const char* word : {"--array=1-3", "--requeue", "--nodes=1", "--ntasks=1", "--exclusive",
                           "--partition=cpu", "--time=2:00:00", "--signal=B:TERM@60"})
    EXPECT_THAT(command, Contains(word));
  EXPECT_EQ(command[command.size() - 2], "--account=film");
  // Nothing of a folder's name is a pattern.
  job.script_log = "/50% of %j/%A_%a.log";
  EXPECT_THAT(sbatch_command(job, 1, "x"), Contains("--output=/50%% of %%j/%A_%a.log"));
  EXPECT_TRUE(check_log(job));
  job.script_log = "/back\\slash/%A_%a.log";
  EXPECT_THAT(check_log(job).error().message,
              HasSubstr("/back\\slash: expected a folder without a backslash"));
  EXPECT_EQ(command.back(), "/farm/pilot.sh");
  job.time_s = 60;
  EXPECT_THAT(sbatch_command(job, 1, "x"), Not(Contains("--signal=B:TERM@60")));
}

TEST(SlurmText, TheQueueIsRead) {
  const auto pilots = parse_squeue(
      "17_1|RUNNING|baton-1f|n1|1:59:58|None\n"
      "17_2|PENDING|baton-1f||2:00:00|Resources\n"
      "17_3|PENDING|baton-1f||2:00:00|BeginTime\n"
      "17_4|SUSPENDED|baton-1f|n2|1:00:00|None\n"
      "17_5|COMPLETING|baton-1f|n3|0:10|None\n");
  ASSERT_TRUE(pilots);
  std::vector<SlurmState> states;
  for (const SlurmPilot& pilot : *pilots) states.push_back(pilot.state);
  EXPECT_EQ(states, (std::vector{SlurmState::running, SlurmState::waiting, SlurmState::resting,
                                 SlurmState::suspended, SlurmState::ending}));
  EXPECT_EQ(pilots->front().id, "17_1");
  EXPECT_EQ(pilots->front().node, "n1");
  EXPECT_TRUE(parse_squeue("")->empty());
  EXPECT_FALSE(parse_squeue("slurm_load_jobs error: Unable to contact slurm controller\n"));
}

TEST(SlurmText, WorkersNameTheirPilots) {
  EXPECT_EQ(pilot_of_worker("slurm-17_3"), "17_3");
  EXPECT_EQ(pilot_of_worker("slurm-17_3#1f00a3c2"), "17_3");
  EXPECT_EQ(pilot_of_worker("node7-1234"), std::nullopt);
}

}  // namespace
}  // namespace baton

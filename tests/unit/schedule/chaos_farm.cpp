#include "tests/unit/schedule/chaos_farm.h"

#include <gmock/gmock.h>

namespace baton::testing_farm {

void ChaosFarm::advance(bool trouble) {
  now_ += std::chrono::milliseconds(roll(300));
  if (roll(3) == 0) deliver_left();
  const std::string worker = "w" + std::to_string(roll(options_.num_workers));
  const int what = roll(100);
  if (what < 30) {
    ask(worker);
  } else if (what < 50) {
    publish(worker);
  } else if (what < 70) {
    report(worker);
  } else if (what < 80) {
    step(ClockTicked{});
  } else if (what < 88) {
    for (int i = 0; i < options_.num_workers; ++i) heartbeat("w" + std::to_string(i));
  } else if (!trouble) {
    return;
  } else if (what < 91) {
    end_process(worker);
    if (roll(2)) join(worker);
  } else if (what < 92) {
    leave(worker);
  } else if (what < 93) {
    now_ += kSilence;
  } else if (what < 96) {
    if (options_.failures) fail(worker);
  } else if (what < 97) {
    if (options_.restarts) start_coordinator();
  } else if (what < 98) {
    if (options_.failures) lose_a_file();
  } else if (!old_reports_.empty()) {
    receive(old_reports_[static_cast<std::size_t>(roll(static_cast<int>(old_reports_.size())))]);
  }
}

void ChaosFarm::change_job(JobSpec next) {
  FormerJob former{document_of(spec_), completions_of(completions_).tasks, plan_,
                   JobStatus::cancelled};
  if (is_open(status())) step(JobSuperseded{job_, {}});
  keep_blobs();
  step(JobForgotten{job_});
  memory_.clear();
  wanted_.clear();
  for (int i = 0; i < options_.num_workers; ++i) drop_leases("w" + std::to_string(i));
  old_reports_.clear();

  // Frames are files with numbers.
  std::set<FrameNumber> written;
  for (const Completion& done : completions_) {
    if (done.task.kind == TaskKind::assemble && !lost_frames_.contains(done.task))
      written.insert(spec_.frames[done.task.frame().index()]);
  }
  const KeptFiles files{
      .has_frame = [&](FrameIndex frame,
                       const BlobRef&) { return written.contains(next.frames[frame.index()]); },
      .has_blob = [&](const BlobRef& blob) { return store_.contains(blob.digest); }};
  const Adoption adoption = adopt(document_of(next), {former}, files);
  num_kept_frames_ += adoption.frames.size();
  num_cuts_ += adoption.plan.cuts.size();

  std::vector<Completion> taken;
  const std::set<TaskKey> tasks(adoption.tasks.begin(), adoption.tasks.end());
  for (const Completion& done : completions_) {
    if (tasks.contains(done.task)) taken.push_back(done);
  }
  taken.insert(taken.end(), adoption.frames.begin(), adoption.frames.end());
  for (const TaskKey& task : adoption.skipped) taken.push_back({task, {}});
  spec_ = std::move(next);
  spec_.leading_runs = adoption.plan.leading_runs;
  graph_ = JobGraph(spec_);
  plan_ = adoption.plan;
  completions_ = std::move(taken);
  recorded_.clear();
  for (const Completion& done : completions_)
    EXPECT_TRUE(recorded_.insert(done.task).second) << "adopted twice";
  failures_.clear();
  lost_frames_.clear();
  rendered_by_.clear();
  job_ = digest_of("job " + std::to_string(++num_changes_));
  add_job();
  std::erase_if(kept_, [this](const Digest& blob) { return scheduler_->is_referenced(blob); });
}

void ChaosFarm::delete_job() {
  for (int i = 0; i < options_.num_workers; ++i) drop_leases("w" + std::to_string(i));
  deliver_left();
  step(JobForgotten{job_});
  for (const Digest& blob : kept_) store_.erase(blob);
  for (const Digest& blob : unreported_) {
    if (!scheduler_->is_referenced(blob)) store_.erase(blob);
  }
  EXPECT_EQ(scheduler_->find_job(job_), nullptr);
  EXPECT_THAT(store_, testing::IsEmpty()) << "all that was published was reported, or told of";
  for (const TaskCompleted& late : old_reports_) step(late);
  EXPECT_FALSE(std::any_of(store_.begin(), store_.end(),
                           [this](const Digest& blob) { return scheduler_->is_referenced(blob); }));
}

void ChaosFarm::add_job() {
  JobAdded added{job_, spec_, JobStatus::running, completions_of(completions_), failures_};
  added.plan = plan_;
  added.renderer = renderer_;
  // It looks for every file that it counts on.
  Scheduler trial({.silence_limit = kSilence});
  trial.step(added, now_);
  const JobTasks& tasks = trial.find_job(job_)->tasks;
  for (const Completion& done : completions_) {
    const auto live = tasks.ledger().live_blobs(tasks.view(), *graph_.find(done.task));
    const bool lost = std::any_of(live.begin(), live.end(), [this](const BlobRef& blob) {
      return !blob.is_held() && !store_.contains(blob.digest);
    });
    if (lost || lost_frames_.erase(done.task) > 0) added.lost.push_back(done.task);
    for (const BlobRef& spare : tasks.ledger().spare_blobs(tasks.view(), *graph_.find(done.task))) {
      if (!store_.contains(spare.digest)) added.lost_spares.push_back(spare);
    }
  }
  for (const Cut& cut : plan_.cuts) {
    const bool lost =
        std::any_of(cut.states.begin(), cut.states.end(),
                    [this](const BlobRef& blob) { return !store_.contains(blob.digest); });
    if (lost && tasks.ledger().is_cut(*graph_.find(cut.task))) added.lost.push_back(cut.task);
  }
  step(added);
}

void ChaosFarm::heartbeat(const std::string& worker) {
  repeat(worker);
  if (!known_.contains(worker)) return;
  step(WorkerAlive{worker, leases(worker)});
  if (const auto asked = wanted_.find(worker); asked != wanted_.end() && roll(4) > 0) {
    HeldPublished some{worker, job_, {}};
    for (const Digest& name : asked->second) {
      if (const auto state = memory_[worker].find(name); state != memory_[worker].end())
        some.states.push_back(state->second);
    }
    wanted_.erase(asked);
    publish(some);
  }
}

void ChaosFarm::report(const std::string& worker) {
  if (held_[worker].empty()) return;
  if (!known_.contains(worker)) join(worker);
  if (held_[worker].empty()) return;
  const auto [lease, held] = *held_[worker].begin();
  const std::vector<BlobRef> unread = missing_inputs(worker, held);
  held_[worker].erase(lease);
  const bool unheld =
      std::any_of(unread.begin(), unread.end(), [](const BlobRef& blob) { return blob.is_held(); });
  if (!held.published && unheld) {
    say(worker, lease, AttemptFailed{{lease, worker, "is not held here"}});
    return;
  }
  if (!held.published && !unread.empty()) {
    say(worker, lease, InputsLost{worker, lease, unread});
    return;
  }
  if (!held.published) publish(worker, lease, held);
  const TaskCompleted done{worker, lease, {outputs(worker, lease.task, held)}};
  old_reports_.push_back(done);
  say(worker, lease, done);
}

void ChaosFarm::on(const GrantLease& a) {
  EXPECT_FALSE(recorded_.contains(a.lease.task)) << "granted after it was done";
  EXPECT_TRUE(issued_.insert(a.lease).second) << "a lease id is used once";
  granted_.insert(a.lease);
  for (const TaskIndex input : graph_.inputs(a.lease.task)) {
    EXPECT_TRUE(recorded_.contains(graph_.key(input))) << "granted before its input was recorded";
  }
  // Who is not known any more gets no message.
  const bool arrives = roll(20) > 0 && known_.contains(a.worker);
  Memory& memory = memory_[a.worker];
  if (arrives)
    std::erase_if(memory, [&](const auto& s) { return s.second.held.step() < a.states_from; });
  for (const BlobRef& input : a.inputs) {
    EXPECT_TRUE(scheduler_->is_referenced(input.digest));
    if (input.is_held()) {
      EXPECT_TRUE(memory.contains(input.digest) || !known_.contains(a.worker))
          << "granted to a worker that does not hold an input";
    } else {
      EXPECT_TRUE(store_.contains(input.digest) || lost_.contains(input.digest))
          << "granted with an input that was removed";
    }
  }
  if (arrives) held_[a.worker].emplace(a.lease, Held{a.inputs, a.steps, a.may_hold && roll(5) > 0});
}

std::optional<ReasonKind> ChaosFarm::check_reasons() const {
  if (status() != JobStatus::running) return std::nullopt;
  const LeaseBook& leases = scheduler_->leases();
  const Reasons reasons(*scheduler_, now_);
  const auto check_chain = [&](const std::vector<Cause>& chain) {
    if (chain.empty()) return void(ADD_FAILURE() << "no reason");
    EXPECT_TRUE(is_last(chain.back().kind)) << "no end: " << reason_kind_name(chain.back().kind);
    for (const Cause& cause : chain) {
      for (const std::string& worker : cause.workers)
        EXPECT_TRUE(leases.knows(worker)) << worker << " has left and is blamed";
    }
  };
  for (const std::string& worker : leases.connected()) check_chain(reasons.of_worker(worker));
  const std::vector<Cause> chain = reasons.of_job(job_);
  check_chain(chain);
  if (testing::Test::HasFailure()) return std::nullopt;

  // The same farm, without the last cause.
  const Cause& last = chain.back();
  Scheduler trial = *scheduler_;
  std::string helper = "helper";
  std::vector<Action> follows;
  if (last.kind == ReasonKind::asking)
    helper = last.workers.empty() ? helper : last.workers.front();
  if (last.kind == ReasonKind::running)
    follows = trial.step(WorkerLeft{last.workers.front()}, now_);
  if (last.kind == ReasonKind::inspecting) {
    trial.step(FramesInspected{job_}, now_);
    EXPECT_EQ(trial.find_job(job_)->status, JobStatus::done);
    return last.kind;
  }
  if (last.kind == ReasonKind::store) return last.kind;
  if (helper == "helper")
    trial.step(WorkerJoined{helper, {}, trial.find_job(job_)->renderer}, now_);
  std::ranges::move(trial.step(WorkRequested{helper, 100}, now_), std::back_inserter(follows));
  if (!all_of<GrantLease>(follows).empty()) return last.kind;
  const std::vector<Cause> after = Reasons(trial, now_).of_job(job_);
  EXPECT_TRUE(after.back().kind == ReasonKind::store ||
              (after.back().kind == ReasonKind::running && after.back().task != last.task))
      << "it does not go on without its last cause: " << reason_kind_name(last.kind);
  const auto told = [&](const std::vector<Cause>& of) {
    std::string text;
    for (const Cause& cause : of) {
      text += std::string(reason_kind_name(cause.kind)) + " ";
      if (cause.task) text += describe_task(*cause.task) + " ";
      for (const std::string& worker : cause.workers) text += worker + " ";
      text += "| ";
    }
    return text;
  };
  if (testing::Test::HasFailure())
    ADD_FAILURE() << "before: " << told(chain) << "\nafter: " << told(after);
  EXPECT_NE(last.kind, ReasonKind::asking) << "there was no room for what it would have asked for";
  return last.kind;
}

void ChaosFarm::check_renderer(const TaskKey& task) {
  if (options_.num_renderers == 1) return;
  const std::string renderer = renderer_of(reporter_);
  EXPECT_EQ(renderer, renderer_) << "the job's";
  rendered_by_[task] = renderer;
  for (const TaskIndex input : graph_.inputs(task)) {
    const TaskKey maker = graph_.key(input);
    const std::vector<std::size_t> taken = graph_.taken_outputs(task, maker);
    const bool is_state = maker.kind == TaskKind::render && graph_.carries_state();
    const bool takes_films =
        std::ranges::any_of(taken, [&](std::size_t position) { return !is_state || position > 0; });
    const auto made = rendered_by_.find(maker);
    if (takes_films && made != rendered_by_.end()) {
      EXPECT_EQ(made->second, renderer)
          << "one frame by two renderers: " << describe_task(maker) << ", " << describe_task(task);
    }
  }
}

/// Where no file and no coordinator is lost, a lost worker costs what it has made itself, and of
/// each tile at most the frames between two checkpoints.
void ChaosFarm::check_own_loss(const RecordReopened& a) const {
  if (options_.failures || options_.restarts || options_.store_limit > 0) return;
  std::map<std::int32_t, std::int32_t> frames;
  for (const TaskKey& task : a.tasks) {
    // One that was lost before has made something for what another did again since.
    const std::set<std::string>& makers = makers_.at(task);
    EXPECT_TRUE(std::any_of(makers.begin(), makers.end(),
                            [&](const std::string& maker) {
                              return a.why == "what worker " + maker + " held is gone";
                            }))
        << a.why << ": tile " << task.tile << " of run " << task.run().value()
        << " is lost with another worker";
    EXPECT_LE(++frames[task.tile], spec_.state.checkpoint_every);
  }
}

}  // namespace baton::testing_farm

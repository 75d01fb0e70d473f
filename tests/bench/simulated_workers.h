#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "common/base/build.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/job/plan/sequence.h"
#include "common/protocol/keys.h"
#include "common/protocol/messages.h"
#include "common/store/blob_store.h"

namespace baton {

/// Workers that speak the protocol, each over a socket of its own, and render nothing: what they
/// publish are a few bytes under the right names. Many share a thread.

using LoadClock = std::chrono::steady_clock;

/// What all simulated workers know and count.
struct LoadRun {
  JobSpec job;
  Digest digest;  ///< of the job
  std::string endpoint;
  /// The workers' key; none: they speak in the clear.
  std::optional<ClientKey> key;
  std::chrono::milliseconds heartbeat{1000}, tile_time{0};
  BlobStore store;
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> reports{0};
  /// Messages both ways, as they are before they are encrypted.
  std::atomic<std::uint64_t> bytes{0};
  std::atomic<std::uint32_t> newest_epoch{0};          ///< of a lease that a worker was granted
  std::atomic<LoadClock::time_point> first_grant{};    ///< of that epoch
  std::atomic<LoadClock::time_point> first_welcome{};  ///< since this was last set to {}
};

class SimulatedWorker {
 public:
  SimulatedWorker(LoadRun& run, zmq::context_t& context, int number)
      : run_(run), socket_(context, zmq::socket_type::dealer) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::sndhwm, limits::kMaxQueuedMessages);
    socket_.set(zmq::sockopt::rcvhwm, limits::kMaxQueuedMessages);
    socket_.set(zmq::sockopt::reconnect_ivl, 50);
    socket_.set(zmq::sockopt::reconnect_ivl_max, 2000);
    if (run.key) {
      socket_.set(zmq::sockopt::curve_publickey, run.key->own.public_key);
      socket_.set(zmq::sockopt::curve_secretkey, run.key->own.secret_key);
      socket_.set(zmq::sockopt::curve_serverkey, run.key->server_public_key);
    }
    socket_.connect(run.endpoint);
    hello_ = {.worker_id = fmt::format("simulated-{}", number),
              .host = "bench",
              .instance = static_cast<std::uint64_t>(number) + 1,
              .pid = 1,
              .num_threads = 1,
              .build = build_identity(),
              .renderer = "none",
              .running = {}};
    say_hello();
  }

  void* handle() { return socket_.handle(); }

  /// Reads what has arrived.
  Status receive() {
    std::vector<Bytes> frames;
    zmq::message_t frame;
    while (socket_.recv(frame, zmq::recv_flags::dontwait)) {
      const auto* data = frame.data<std::byte>();
      frames.emplace_back(data, data + frame.size());
      run_.bytes += frame.size();
      if (frame.more()) continue;
      BATON_ASSIGN(const Message message, decode_message(frames));
      BATON_TRY(std::visit([this](const auto& m) { return on(m); }, message));
      frames.clear();
    }
    return {};
  }

  /// Does what is due: the end of a tile, a heartbeat, a question that had no answer.
  Status act(LoadClock::time_point now) {
    while (!held_.empty() && held_.front().due <= now) {
      const LeaseId lease = held_.front().lease;
      held_.pop_front();
      BATON_TRY(finish(lease));
      if (held_.empty()) ask();
    }
    if (retry_ && *retry_ <= now) {
      retry_.reset();
      send(LeaseRequest{1});
    }
    if (now - last_sign_ >= run_.heartbeat) {
      if (now - last_heard_ >= 3 * run_.heartbeat)
        say_hello();
      else
        send(Heartbeat{in_hand()});
      last_sign_ = now;
    }
    return {};
  }

  /// Of each grant, seconds from the first question to the answer.
  const std::vector<float>& waits() const { return waits_; }

 private:
  /// A lease and when its task will be done.
  struct Held {
    LeaseId lease;
    LoadClock::time_point due;
  };
  std::vector<LeaseId> in_hand() const {
    std::vector<LeaseId> leases;
    for (const Held& held : held_) leases.push_back(held.lease);
    return leases;
  }
  void say_hello() {
    hello_.running = in_hand();
    send(hello_);
  }
  void ask() {
    asked_ = LoadClock::now();
    send(LeaseRequest{1});
  }
  void send(const Message& message) {
    const std::vector<Bytes> frames = encode_message(message);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto more = i + 1 < frames.size() ? zmq::send_flags::sndmore : zmq::send_flags::none;
      const bool sent = socket_
                            .send(zmq::const_buffer(frames[i].data(), frames[i].size()),
                                  more | zmq::send_flags::dontwait)
                            .has_value();
      BATON_CHECK(sent);
      run_.bytes += frames[i].size();
    }
  }

  Status on(const WorkerWelcome&) {
    heard();
    LoadClock::time_point none{};
    run_.first_welcome.compare_exchange_strong(none, last_heard_);
    retry_.reset();
    if (held_.empty()) ask();
    return {};
  }
  Status on(const LeaseGrant& grant) {
    heard();
    retry_.reset();
    waits_.push_back(std::chrono::duration<float>(last_heard_ - asked_).count());
    std::uint32_t newest = run_.newest_epoch;
    if (grant.lease.epoch > newest &&
        run_.newest_epoch.compare_exchange_strong(newest, grant.lease.epoch))
      run_.first_grant = last_heard_;
    held_.push_back({grant.lease, last_heard_ + run_.tile_time});
    return {};
  }
  Status on(const LeaseRevoke& revoke) {
    heard();
    std::erase_if(held_, [&](const Held& held) { return held.lease == revoke.lease; });
    if (held_.empty()) ask();
    return {};
  }
  Status on(const NoWork& no_work) {
    heard();
    retry_ = last_heard_ + std::chrono::milliseconds(no_work.retry_ms);
    return {};
  }
  Status on(const HelloAgain&) {
    heard();
    say_hello();
    return {};
  }
  Status on(const Refused& refused) {
    return Error{ErrorKind::internal, fmt::format("refused: {}", refused.message)};
  }
  template <class Other>
  Status on(const Other&) {
    heard();
    return {};
  }
  void heard() { last_heard_ = LoadClock::now(); }

  static RenderStats numbers_like_those_of_a_tile() {
    RenderStats stats;
    stats.pixels = 4096;
    stats.rays_primary = 4096;
    stats.rays_shadow = 65536;
    stats.target_evaluations = 524288;
    stats.sampling.pixels_fresh = 4000;
    stats.sampling.ess_histogram = {100, 200, 300, 400, 500, 600, 700, 1200};
    stats.cpu_seconds = 0.123456789;
    stats.seconds_primary = stats.seconds_sample = stats.seconds_visibility = 0.0312345678;
    return stats;
  }

  /// Publishes what a task makes, and reports it.
  Status finish(const LeaseId& lease) {
    const TaskKey& task = lease.task;
    TaskDone done{lease, {{}, numbers_like_those_of_a_tile()}};
    const auto publish = [&](BlobKind kind, std::int32_t position) -> Status {
      const std::string text = fmt::format("{} {} {} {}", static_cast<int>(kind), position,
                                           task.tile, run_.digest.hex());
      BlobRef blob{kind, position, task.tile, {}, text.size()};
      if (kind == BlobKind::image) {
        BATON_TRY(write_file_unsynced(frame_path(run_.job, blob.frame()), as_bytes_view(text)));
        blob.digest = digest_of(text);
      } else {
        BATON_ASSIGN(blob.digest, run_.store.put(as_bytes_view(text)));
      }
      done.made.outputs.push_back(blob);
      return {};
    };
    if (task.kind == TaskKind::assemble) {
      BATON_TRY(publish(BlobKind::image, task.position));
    } else {
      const TileRun tiles = tile_run(run_.job, task.tile, task.run());
      for (Step step = tiles.steps.first; step <= tiles.steps.last; ++step) {
        BATON_TRY(publish(BlobKind::film, step.value()));
        done.made.frames.push_back({step.value(), task.tile, done.made.stats.sampling});
      }
      if (carries_state(run_.job)) BATON_TRY(publish(BlobKind::state, tiles.steps.last.value()));
    }
    send(done);
    ++run_.reports;
    return {};
  }

  LoadRun& run_;
  zmq::socket_t socket_;
  WorkerHello hello_;
  std::deque<Held> held_;  ///< in the order of granting; mostly one
  std::optional<LoadClock::time_point> retry_;
  LoadClock::time_point asked_{}, last_sign_ = LoadClock::now(), last_heard_ = LoadClock::now();
  std::vector<float> waits_;
};

/// Runs workers `first` to `last - 1` until `run.stop`. Returns their waits.
inline Result<std::vector<float>> simulate_workers(LoadRun& run, zmq::context_t& context, int first,
                                                   int last) {
  std::deque<SimulatedWorker> workers;
  std::vector<zmq::pollitem_t> items;
  for (int number = first; number < last; ++number) {
    workers.emplace_back(run, context, number);
    items.push_back({workers.back().handle(), 0, ZMQ_POLLIN, 0});
  }
  while (!run.stop) {
    zmq::poll(items.data(), items.size(), std::chrono::milliseconds(5));
    for (std::size_t i = 0; i < items.size(); ++i) {
      if ((items[i].revents & ZMQ_POLLIN) != 0) BATON_TRY(workers[i].receive());
      BATON_TRY(workers[i].act(LoadClock::now()));
    }
  }
  std::vector<float> waits;
  for (const SimulatedWorker& worker : workers)
    waits.insert(waits.end(), worker.waits().begin(), worker.waits().end());
  return waits;
}

}  // namespace baton

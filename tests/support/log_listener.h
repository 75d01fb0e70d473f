#pragma once

#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace baton::test {

/// While it lives, what this process logs goes to a function, line by line, instead of a stream.
class LogListener {
 public:
  explicit LogListener(std::function<void(const std::string& line)> hear)
      : before_(spdlog::default_logger()) {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<Sink>(std::move(hear))));
  }
  ~LogListener() { spdlog::set_default_logger(before_); }
  LogListener(const LogListener&) = delete;
  LogListener& operator=(const LogListener&) = delete;

 private:
  class Sink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
   public:
    explicit Sink(std::function<void(const std::string& line)> hear) : hear_(std::move(hear)) {}

   private:
    void sink_it_(const spdlog::details::log_msg& said) override {
      hear_(std::string(said.payload.data(), said.payload.size()));
    }
    void flush_() override {}
    const std::function<void(const std::string& line)> hear_;
  };

  const std::shared_ptr<spdlog::logger> before_;
};

}  // namespace baton::test

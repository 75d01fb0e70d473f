#pragma once

#include <string>

#include "common/base/team.h"
#include "common/base/trace.h"

namespace baton {

/// Who packs and unpacks blocks of lines of EXR files: while it lives those who are lent, as far as
/// there are some, else the thread that writes or reads. One at a time in a process, and no file is
/// written or read while one comes or goes.
class ExrThreads {
 public:
  explicit ExrThreads(Lend lend);
  ~ExrThreads();
  ExrThreads(const ExrThreads&) = delete;
  ExrThreads& operator=(const ExrThreads&) = delete;
};

/// While it lives traces have what the calling thread encodes, and the blocks as its parts, under a
/// name.
class EncodingSpan {
 public:
  explicit EncodingSpan(const std::string& name);
  ~EncodingSpan();
  EncodingSpan(const EncodingSpan&) = delete;
  EncodingSpan& operator=(const EncodingSpan&) = delete;

 private:
  const Span span_;
};

}  // namespace baton

#include "common/image/exr_threads.h"

#include <IlmThreadPool.h>

#include <memory>
#include <optional>
#include <utility>

#include "common/image/exr_planes.h"

namespace baton {
namespace {

/// What the thread encodes, in traces; empty: it reads, or nobody has said it.
thread_local std::string encoding;

void finish(IlmThread::Task* task, const std::string& what) {
  IlmThread::TaskGroup* const group = task->group();
  {
    std::optional<Span> span;
    if (!what.empty()) span.emplace(SpanKind::help, what);
    task->execute();
  }
  delete task;
  if (group != nullptr) group->finishOneTask();
}

/// OpenEXR waits for all that it adds.
class OpenExrThreads : public IlmThread::ThreadPoolProvider {
 public:
  explicit OpenExrThreads(Lend lend) : lend_(std::move(lend)) {}
  int numThreads() const override { return kOpenExrThreads; }
  void setNumThreads(int) override {}
  void addTask(IlmThread::Task* task) override {
    if (!lend_([task, what = encoding] { baton::finish(task, what); }))
      baton::finish(task, encoding);
  }
  void finish() override {}

 private:
  const Lend lend_;
};

void set_threads(Lend lend) {
  IlmThread::ThreadPool::globalThreadPool().setThreadProvider(
      std::make_unique<OpenExrThreads>(std::move(lend)).release());
}

}  // namespace

ExrThreads::ExrThreads(Lend lend) { set_threads(std::move(lend)); }
ExrThreads::~ExrThreads() { set_threads(lend_nobody); }

EncodingSpan::EncodingSpan(const std::string& name) : span_(SpanKind::share, name) {
  encoding = name;
}
EncodingSpan::~EncodingSpan() { encoding.clear(); }

}  // namespace baton

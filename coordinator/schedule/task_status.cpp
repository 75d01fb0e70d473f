#include "coordinator/schedule/task_status.h"

namespace baton {

std::optional<TaskStatus> next_status(TaskStatus status, TaskEvent event) {
  switch (status) {
    case TaskStatus::blocked:
      if (event == TaskEvent::inputs_done) return TaskStatus::ready;
      if (event == TaskEvent::cancelled) return TaskStatus::cancelled;
      return std::nullopt;
    case TaskStatus::ready:
      if (event == TaskEvent::granted) return TaskStatus::leased;
      if (event == TaskEvent::input_lost) return TaskStatus::blocked;
      if (event == TaskEvent::cancelled) return TaskStatus::cancelled;
      return std::nullopt;
    case TaskStatus::leased:
      if (event == TaskEvent::completed) return TaskStatus::done;
      if (event == TaskEvent::returned) return TaskStatus::ready;
      if (event == TaskEvent::exhausted) return TaskStatus::failed;
      if (event == TaskEvent::cancelled) return TaskStatus::cancelled;
      return std::nullopt;
    case TaskStatus::done:
      if (event == TaskEvent::output_lost) return TaskStatus::blocked;
      return std::nullopt;
    case TaskStatus::failed:
    case TaskStatus::cancelled:
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace baton

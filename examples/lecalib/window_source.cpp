// SPDX-License-Identifier: MIT
#include "window_source.hpp"

#include "commands.hpp"
#include "lecalib/core/time.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/pipeline/window_length.hpp"

namespace lecalib::command {
namespace {

using host::thread_cpu_ns;

/// Events may stand so much later in the file than their time says.
constexpr std::uint64_t kDisorderUs = 1'000'000;

}  // namespace

WindowSource::WindowSource(host::EventFile* file, const WindowRange& range, std::uint32_t max_rate_per_s,
                           Span<Event> storage)
    : file_(file), range_(range) {
  WindowOptions window;
  window.length_us = range.window_us.value_or(WindowLengthOptions().first_us);
  window.max_rate_per_s = max_rate_per_s;
  if (range.is_one_window()) window.length_us = *range.to_us - *range.from_us;
  if (is_error(builder_.init(window, storage))) fail({"the window's length is out of range"});
}

bool WindowSource::next(EventWindow* window) {
  while (true) {
    const std::uint64_t begin_ns = thread_cpu_ns();
    const Status status = at_end_ ? builder_.finish(window) : builder_.push(&events_, window);
    cpu_ns_ += thread_cpu_ns() - begin_ns;
    if (status == Status::ok) break;
    if (at_end_) return false;
    read();
  }
  if (range_.is_one_window()) {
    window->begin_us = *range_.from_us;
    window->end_us = *range_.to_us;
  }
  return true;
}

/// The next events of the file that lie in the range asked for.
void WindowSource::read() {
  const Span<const Event> events = take(file_->read());
  const std::uint64_t begin_ns = thread_cpu_ns();
  const bool is_beyond = !events.empty() && range_.to_us && events[0].t_us >= *range_.to_us &&
                         distance_us(*range_.to_us, events[0].t_us) >= kDisorderUs;
  at_end_ = events.empty() || is_beyond;
  events_ = events;
  if (range_.from_us || range_.to_us) {
    in_range_.clear();
    for (const Event& event : events) {
      const bool is_early = range_.from_us && event.t_us < *range_.from_us;
      if (!is_early && !(range_.to_us && event.t_us >= *range_.to_us)) in_range_.push_back(event);
    }
    events_ = in_range_;
  }
  cpu_ns_ += thread_cpu_ns() - begin_ns;
}

}  // namespace lecalib::command

// SPDX-License-Identifier: MIT
#include "lecalib/events/window_builder.hpp"

#include <algorithm>
#include <limits>

#include "lecalib/core/time.hpp"

namespace lecalib {
namespace {

constexpr std::int64_t kForever = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kEarliest = std::numeric_limits<std::int64_t>::min();

constexpr std::int64_t add_us(std::int64_t t_us, std::int64_t length_us) noexcept {
  return t_us > kForever - length_us ? kForever : t_us + length_us;
}

/// Events that a rate gives to a length, at least 2 and even.
constexpr std::uint64_t even_share(std::uint64_t rate_per_s, std::int64_t length_us) noexcept {
  constexpr std::uint64_t kUsPerS = 1'000'000;
  const auto us = static_cast<std::uint64_t>(length_us);
  if (us / kUsPerS > 0xffff'ffffU) return std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t share = us / kUsPerS * rate_per_s + us % kUsPerS * rate_per_s / kUsPerS;
  return share < 2 ? 2 : share / 2 * 2;
}

}  // namespace

Status WindowBuilder::init(const WindowOptions& options, Span<Event> storage) noexcept {
  if (options.length_us < 0 || options.disorder_us < 0) return Status::invalid_argument;
  if (options.length_us == 0 && options.max_events == 0) return Status::invalid_argument;
  if (storage.size() < 2) return Status::buffer_too_small;
  *this = {};
  options_ = options;
  storage_ = storage.first(storage.size() / 2 * 2);
  return Status::ok;
}

Status WindowBuilder::set_length_us(std::int64_t length_us) noexcept {
  if (storage_.empty()) return Status::wrong_state;
  if (length_us < 0 || (length_us == 0 && options_.max_events == 0)) return Status::invalid_argument;
  options_.length_us = length_us;
  return Status::ok;
}

Status WindowBuilder::push(Span<const Event>* events, EventWindow* window) noexcept {
  if (storage_.empty()) return Status::wrong_state;
  for (; add_run(events); *events = events->subspan(1)) {
    const Event& event = (*events)[0];
    if (is_backward(event.t_us)) {
      if (++backward_run_ < kRestartAfter) {
        ++stats_.backward;
        continue;
      }
      ++stats_.restarts;
      has_clock_ = false;
      if (is_open_) {
        close(add_us(latest_us_, 1), window);
        return Status::ok;
      }
    }
    backward_run_ = 0;
    std::int64_t end_us = 0;
    if (ends_before(event.t_us, &end_us)) {
      close(end_us, window);
      return Status::ok;
    }
    if (!is_open_) open(event.t_us);
    add(event);
  }
  return Status::need_more_data;
}

Status WindowBuilder::finish(EventWindow* window) noexcept {
  if (storage_.empty()) return Status::wrong_state;
  if (!is_open_) return Status::need_more_data;
  close(add_us(latest_us_, 1), window);
  return Status::ok;
}

void WindowBuilder::cut() noexcept {
  if (is_open_) stats_.cut += received_;
  is_open_ = false;
  has_clock_ = false;
  backward_run_ = 0;
}

bool WindowBuilder::is_backward(std::int64_t t_us) const noexcept {
  return has_clock_ && t_us < latest_us_ &&
         distance_us(t_us, latest_us_) > static_cast<std::uint64_t>(options_.disorder_us);
}

bool WindowBuilder::ends_before(std::int64_t t_us, std::int64_t* end_us) const noexcept {
  if (!is_open_) return false;
  *end_us = end_us_;
  if (t_us >= end_us_) return true;
  *end_us = add_us(latest_us_, 1);
  return options_.max_events > 0 && received_ >= options_.max_events && t_us > latest_us_;
}

std::int64_t WindowBuilder::first_begin_us(std::int64_t t_us) const noexcept {
  if (!options_.on_grid || options_.length_us == 0) return t_us;
  const std::int64_t remainder = t_us % options_.length_us;
  const std::int64_t after = remainder < 0 ? remainder + options_.length_us : remainder;
  return t_us < kEarliest + after ? t_us : t_us - after;
}

void WindowBuilder::open(std::int64_t t_us) noexcept {
  begin_us_ = has_clock_ ? next_begin_us_ : first_begin_us(t_us);
  if (t_us > begin_us_) {
    if (options_.length_us == 0) {
      begin_us_ = t_us;
    } else {
      const auto length_us = static_cast<std::uint64_t>(options_.length_us);
      const std::uint64_t skipped = distance_us(begin_us_, t_us) / length_us;
      stats_.empty_windows += skipped;
      begin_us_ = static_cast<std::int64_t>(static_cast<std::uint64_t>(begin_us_) + skipped * length_us);
    }
  }
  end_us_ = options_.length_us == 0 ? kForever : add_us(begin_us_, options_.length_us);
  if (!has_clock_) latest_us_ = t_us;
  has_clock_ = true;
  is_open_ = true;
  received_ = 0;
  room_ = storage_.size();
  if (options_.max_rate_per_s > 0 && options_.length_us > 0) {
    room_ = static_cast<std::size_t>(
        std::min<std::uint64_t>(room_, even_share(options_.max_rate_per_s, options_.length_us)));
  }
  size_ = 0;
  stride_ = 1;
  in_group_ = 0;
  chosen_ = 0;
}

void WindowBuilder::close(std::int64_t end_us, EventWindow* window) noexcept {
  *window = {begin_us_, end_us, storage_.first(size_)};
  ++stats_.windows;
  next_begin_us_ = end_us;
  is_open_ = false;
}

void WindowBuilder::add(const Event& event) noexcept {
  ++received_;
  ++stats_.events;
  if (event.t_us < latest_us_) {
    ++stats_.late;
  } else {
    latest_us_ = event.t_us;
  }
  if (in_group_ == chosen_) {
    keep(event);
  } else {
    ++stats_.thinned;
  }
  if (++in_group_ == stride_) {
    in_group_ = 0;
    chosen_ = draw_below_stride();
  }
}

bool WindowBuilder::add_run(Span<const Event>* events) noexcept {
  if (!is_open_ || stride_ > 1 || events->empty()) return !events->empty();
  std::uint64_t most = std::min(events->size(), room_ - size_);
  if (options_.max_events > 0) most = std::min(most, options_.max_events - std::min(received_, options_.max_events));
  Event* const free = storage_.data() + size_;
  std::int64_t latest_us = latest_us_;
  std::size_t count = 0;
  for (; count < most; ++count) {
    const Event& event = (*events)[count];
    if (event.t_us < latest_us || event.t_us >= end_us_) break;
    latest_us = event.t_us;
    free[count] = event;
  }
  if (count > 0) backward_run_ = 0;
  latest_us_ = latest_us;
  size_ += count;
  received_ += count;
  stats_.events += count;
  *events = events->subspan(count);
  return !events->empty();
}

void WindowBuilder::keep(const Event& event) noexcept {
  if (size_ == room_) {
    halve();
    // The group being received becomes the first half of one twice as long.
    const bool is_in_second_half = (rng_.next() & 1U) != 0;
    if (is_in_second_half) chosen_ = stride_ + draw_below_stride();
    stride_ *= 2;
    if (is_in_second_half) {
      ++stats_.thinned;
      return;
    }
  }
  storage_[size_++] = event;
}

void WindowBuilder::halve() noexcept {
  for (std::size_t i = 0; i < size_ / 2; ++i) storage_[i] = storage_[2 * i + (rng_.next() & 1U)];
  stats_.thinned += size_ - size_ / 2;
  size_ /= 2;
}

std::uint64_t WindowBuilder::draw_below_stride() noexcept {
  if (stride_ == 1) return 0;
  const std::uint64_t high = rng_.next();
  const std::uint64_t low = rng_.next();
  return (high << 32U | low) & (stride_ - 1);
}

}  // namespace lecalib

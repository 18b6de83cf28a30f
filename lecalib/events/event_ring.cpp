// SPDX-License-Identifier: MIT
#include "lecalib/events/event_ring.hpp"

namespace lecalib {

Status EventRing::init(Span<EventSlot> storage, DropPolicy policy) noexcept {
  constexpr std::size_t kMaxSize = std::size_t{1} << 30;
  const std::size_t size = storage.size();
  if (size < 2 || size > kMaxSize || (size & (size - 1)) != 0) return Status::invalid_argument;
  slots_ = storage;
  policy_ = policy;
  head_ = tail_ = refused_ = refused_seen_ = 0;
  dropped_ = 0;
  return Status::ok;
}

bool EventRing::push(const Event& event) noexcept {
  const std::uint32_t head = head_.load(std::memory_order_relaxed);
  if (policy_ == DropPolicy::newest) {
    if (head - tail_.load(std::memory_order_acquire) >= slots_.size()) {
      refused_.store(refused_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
  } else {
    // Whoever sees a word of this event must see `head` as well: skip_lost() relies on it.
    std::atomic_thread_fence(std::memory_order_release);
  }
  write(head, event);
  head_.store(head + 1, std::memory_order_release);
  return true;
}

std::size_t EventRing::pop(Span<Event> out) noexcept {
  const std::uint32_t refused = refused_.load(std::memory_order_relaxed);
  dropped_ += refused - refused_seen_;
  refused_seen_ = refused;

  const std::uint32_t begin = skip_lost(tail_.load(std::memory_order_relaxed));
  const std::uint32_t waiting = head_.load(std::memory_order_acquire) - begin;
  const std::size_t count = waiting < out.size() ? waiting : out.size();
  for (std::size_t i = 0; i < count; ++i) out[i] = read(begin + static_cast<std::uint32_t>(i));
  const std::uint32_t end = begin + static_cast<std::uint32_t>(count);
  // What the writer has overwritten meanwhile may be mixed of two events.
  std::atomic_thread_fence(std::memory_order_acquire);
  const std::uint32_t whole = skip_lost(begin);
  if (whole == begin) {
    tail_.store(end, std::memory_order_release);
    return count;
  }
  const std::size_t lost = whole - begin;
  if (lost >= count) {
    tail_.store(whole, std::memory_order_release);
    return 0;
  }
  for (std::size_t i = lost; i < count; ++i) out[i - lost] = out[i];
  tail_.store(end, std::memory_order_release);
  return count - lost;
}

/// @return where the events that are surely whole begin, not before `begin`; counts those in between
std::uint32_t EventRing::skip_lost(std::uint32_t begin) noexcept {
  if (policy_ == DropPolicy::newest) return begin;
  const std::uint32_t waiting = head_.load(std::memory_order_acquire) - begin;
  // The slot behind the head may be in the writer's hands.
  const std::uint32_t held = static_cast<std::uint32_t>(slots_.size()) - 1;
  if (waiting <= held) return begin;
  dropped_ += waiting - held;
  return begin + (waiting - held);
}

void EventRing::write(std::uint32_t index, const Event& event) noexcept {
  EventSlot& slot = slots_[index & (slots_.size() - 1)];
  const auto time = static_cast<std::uint64_t>(event.t_us);
  const std::uint32_t words[4] = {static_cast<std::uint32_t>(time), static_cast<std::uint32_t>(time >> 32),
                                  event.x | std::uint32_t{event.y} << 16, event.polarity};
  for (int i = 0; i < 4; ++i) __atomic_store_n(&slot.words[i], words[i], __ATOMIC_RELAXED);
}

Event EventRing::read(std::uint32_t index) const noexcept {
  EventSlot& slot = slots_[index & (slots_.size() - 1)];
  std::uint32_t words[4];
  for (int i = 0; i < 4; ++i) words[i] = __atomic_load_n(&slot.words[i], __ATOMIC_RELAXED);
  return {static_cast<std::int64_t>(std::uint64_t{words[1]} << 32 | words[0]), static_cast<std::uint16_t>(words[2]),
          static_cast<std::uint16_t>(words[2] >> 16), static_cast<std::uint8_t>(words[3])};
}

}  // namespace lecalib

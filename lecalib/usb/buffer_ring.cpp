// SPDX-License-Identifier: MIT
#include "lecalib/usb/buffer_ring.hpp"

#include <algorithm>

namespace lecalib::usb {

Status BufferRing::init(std::size_t places, std::size_t buffer_bytes, DropPolicy policy) {
  constexpr std::size_t kMaxPlaces = std::size_t{1} << (kIndexBits - 1);
  if (places < 2 || places > kMaxPlaces || (places & (places - 1)) != 0 || buffer_bytes == 0) {
    return Status::invalid_argument;
  }
  const std::size_t buffers = places + 2;
  memory_.reset(new std::uint8_t[buffers * buffer_bytes]);  // left as it is: its pages come when they are used
  places_ = std::make_unique<std::atomic<std::uint64_t>[]>(places);
  slots_ = std::make_unique<Slot[]>(buffers);
  for (std::size_t i = 0; i < places; ++i) places_[i].store(word_of(0, i, false));
  num_places_ = places;
  buffer_bytes_ = buffer_bytes;
  policy_ = policy;
  head_ = dropped_ = pushed_ = tail_ = next_position_ = 0;
  writers_ = places;
  readers_ = places + 1;
  return Status::ok;
}

bool BufferRing::push(Span<const std::uint8_t> bytes) noexcept {
  bool all = true;
  for (std::size_t begin = 0; begin < bytes.size(); begin += buffer_bytes_) {
    all = push_one({bytes.data() + begin, std::min(buffer_bytes_, bytes.size() - begin)}) && all;
  }
  return all;
}

bool BufferRing::push_one(Span<const std::uint8_t> bytes) noexcept {
  const std::uint64_t position = pushed_++;
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  std::atomic<std::uint64_t>& place = places_[head & (num_places_ - 1)];
  if (policy_ == DropPolicy::newest && (place.load(std::memory_order_acquire) & kFull) != 0) {
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  std::copy(bytes.begin(), bytes.end(), memory_of(writers_));
  slots_[writers_] = {bytes.size(), position};
  const std::uint64_t old = place.exchange(word_of(head, writers_, true), std::memory_order_acq_rel);
  writers_ = index_of(old);  // an empty buffer, or the oldest one, which nobody has read
  if ((old & kFull) != 0) dropped_.fetch_add(1, std::memory_order_relaxed);
  head_.store(head + 1, std::memory_order_release);
  return true;
}

bool BufferRing::pop(Buffer* out) noexcept {
  while (true) {
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    if (head - tail_ > num_places_) tail_ = head - num_places_;
    if (tail_ == head) return false;
    std::atomic<std::uint64_t>& place = places_[tail_ & (num_places_ - 1)];
    std::uint64_t word = place.load(std::memory_order_acquire);
    const bool is_it = (word & kFull) != 0 && count_of(word) == tail_;
    if (!is_it || !place.compare_exchange_strong(word, word_of(tail_, readers_, false), std::memory_order_acq_rel)) {
      ++tail_;  // the writer took it back meanwhile
      continue;
    }
    readers_ = index_of(word);
    ++tail_;
    const Slot& slot = slots_[readers_];
    *out = {{memory_of(readers_), slot.size}, slot.position - next_position_};
    next_position_ = slot.position + 1;
    return true;
  }
}

std::size_t BufferRing::waiting() const noexcept {
  const std::uint64_t ahead = head_.load(std::memory_order_relaxed) - tail_;
  return static_cast<std::size_t>(std::min<std::uint64_t>(ahead, num_places_));
}

}  // namespace lecalib::usb

// SPDX-License-Identifier: MIT
#include "lecalib/usb/stream_buffer.hpp"

namespace lecalib::usb {

Status StreamBuffer::init(const StreamBufferOptions& options) {
  if (options.word_bytes == 0 || options.buffer_bytes % options.word_bytes != 0) return Status::invalid_argument;
  word_bytes_ = options.word_bytes;
  odd_bytes_ = 0;
  ended_ = false;
  return ring_.init(options.places, options.buffer_bytes, options.policy);
}

void StreamBuffer::take(Span<const std::uint8_t> bytes) {
  const std::size_t odd = bytes.size() % word_bytes_;
  if (odd > 0) odd_bytes_.fetch_add(odd, std::memory_order_relaxed);
  (void)ring_.push(bytes.first(bytes.size() - odd));
  wake();
}

void StreamBuffer::end(UsbStatus why) {
  why_ended_ = why;
  ended_.store(true, std::memory_order_release);
  wake();
}

/// The empty lock makes sure that a reader that has just found nothing is already asleep.
void StreamBuffer::wake() {
  { const std::lock_guard<std::mutex> lock(mutex_); }
  woken_.notify_one();
}

StreamBuffer::Wait StreamBuffer::read(std::chrono::milliseconds timeout, BufferRing::Buffer* out) {
  if (ring_.pop(out)) return Wait::data;
  const auto until = std::chrono::steady_clock::now() + timeout;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    const bool ended = ended_.load(std::memory_order_acquire);  // read first: all that was pushed before is in the ring
    if (ring_.pop(out)) return Wait::data;
    if (ended) return Wait::ended;
    if (woken_.wait_until(lock, until) == std::cv_status::timeout) return ring_.pop(out) ? Wait::data : Wait::nothing;
  }
}

}  // namespace lecalib::usb

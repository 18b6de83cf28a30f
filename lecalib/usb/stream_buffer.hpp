// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "lecalib/usb/buffer_ring.hpp"
#include "lecalib/usb/transport.hpp"

namespace lecalib::usb {

struct StreamBufferOptions {
  std::size_t places = 4096;                        ///< buffers in the ring, a power of two; 64 MiB in all
  std::size_t buffer_bytes = std::size_t{1} << 14;  ///< of each: long transfers take several, short ones waste little
  DropPolicy policy = DropPolicy::newest;           ///< what to drop when the reader does not keep up
  std::size_t word_bytes = 2;                       ///< a transfer's bytes beyond whole words are no data
};

/// Between a transport's thread and the one that uses the data: a BufferRing that the reader can wait for.
class StreamBuffer : public StreamSink {
 public:
  /// Empties it, before a stream is started. @return as BufferRing::init()
  Status init(const StreamBufferOptions& options);

  void take(Span<const std::uint8_t> bytes) override;
  void end(UsbStatus why) override;

  enum class Wait : std::uint8_t { data, nothing, ended };
  /// The reader's: the next buffer, valid until the next call.
  /// @return data | nothing (in that time) | ended (and all that came before was given; see why_ended())
  Wait read(std::chrono::milliseconds timeout, BufferRing::Buffer* out);

  /// The reader's: buffers that wait to be read.
  [[nodiscard]] std::size_t waiting() const { return ring_.waiting(); }
  /// Why the stream ended; after read() has said that it has.
  [[nodiscard]] UsbStatus why_ended() const { return why_ended_; }
  /// Buffers that were lost because the reader did not keep up.
  [[nodiscard]] std::uint64_t dropped() const { return ring_.dropped(); }
  /// Bytes beyond whole words.
  [[nodiscard]] std::uint64_t odd_bytes() const { return odd_bytes_.load(std::memory_order_relaxed); }

 private:
  void wake();

  BufferRing ring_;
  std::size_t word_bytes_ = 2;
  std::atomic<std::uint64_t> odd_bytes_{0};
  std::atomic<bool> ended_{false};
  UsbStatus why_ended_ = UsbStatus::ok;
  // Only to sleep: whoever takes data that is there does without.
  std::mutex mutex_;
  std::condition_variable woken_;
};

}  // namespace lecalib::usb

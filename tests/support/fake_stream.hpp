// SPDX-License-Identifier: MIT
/// What a camera sends on its data endpoint: a recording at a given rate, and the faults that a test asks for. Shared
/// by all ways to play a camera.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace lecalib::test {

inline constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

/// Each happens when so many bytes of the recording were sent.
struct StreamFaults {
  std::uint64_t stall_at = kNever;     ///< the endpoint halts, until it is cleared
  int stalls = 1;                      ///< how often in a row
  std::uint64_t overflow_at = kNever;  ///< one transfer is overrun; its bytes are lost
  std::uint64_t failure_at = kNever;   ///< one transfer fails; nothing is lost
  std::uint64_t silence_at = kNever;   ///< no more bytes come
  std::uint64_t unplug_at = kNever;    ///< and with it the device is gone
  std::size_t max_transfer = 0;        ///< transfers end after so many bytes; 0: when they are full
  std::size_t odd_every = 0;           ///< each n-th transfer carries a stray byte behind its words; 0: none
};

class FakeStream {
 public:
  enum class What : std::uint8_t { nothing, data, stall, overflow, failure, unplug };

  std::vector<std::uint8_t> recording;
  double bytes_per_s = 0;   ///< 0: as fast as they are taken
  bool repeats = false;     ///< the recording is sent over and over, see support/box_stream.hpp
  unsigned evt3_highs = 0;  ///< each time around the times in EVT3's TIME_HIGH words are later by so many units
  StreamFaults faults;

  void start() {
    begin_ = Clock::now();
    sent_at_begin_ = sent_;
  }
  /// Plugged in anew: the recording goes on where it was, the same fault does not come twice.
  void replug() { faults.unplug_at = kNever; }
  void clear_halt() { halted_ = false; }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }

  /// What becomes of a transfer with so much room that waits for data.
  What next(std::size_t room, std::vector<std::uint8_t>* bytes) {
    bytes->clear();
    if (halted_) return What::stall;
    if (sent_ >= faults.unplug_at) return What::unplug;
    if (sent_ >= faults.stall_at && faults.stalls > 0) {
      if (--faults.stalls == 0) faults.stall_at = kNever;
      halted_ = true;
      return What::stall;
    }
    if (sent_ >= faults.failure_at) {
      faults.failure_at = kNever;
      return What::failure;
    }
    const std::size_t count = available(room);
    if (count == 0) return What::nothing;
    const auto from = recording.begin() + static_cast<std::ptrdiff_t>(sent_ % recording.size());
    const std::uint64_t rounds = sent_ / recording.size();
    const bool overrun = sent_ >= faults.overflow_at;
    sent_ += count;
    if (overrun) {
      faults.overflow_at = kNever;
      return What::overflow;
    }
    bytes->assign(from, from + static_cast<std::ptrdiff_t>(count));
    if (rounds * evt3_highs > 0) delay(rounds * evt3_highs, bytes);
    if (faults.odd_every > 0 && ++transfers_ % faults.odd_every == 0 && count < room) bytes->push_back(0x5A);
    return What::data;
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Whole words of 16 bits that have been recorded by now, up to the next fault.
  [[nodiscard]] std::size_t available(std::size_t room) const {
    const std::uint64_t size = recording.size();
    std::uint64_t end = repeats && size > 0 ? (sent_ / size + 1) * size : size;
    end = std::min(end, faults.silence_at);
    for (const std::uint64_t fault : {faults.stall_at, faults.overflow_at, faults.failure_at, faults.unplug_at}) {
      if (fault > sent_) end = std::min(end, fault);
    }
    if (bytes_per_s > 0) {
      // A packet each millisecond, as cameras send.
      const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin_);
      const double bytes = 1e-3 * static_cast<double>(passed.count()) * bytes_per_s;
      end = std::min(end, sent_at_begin_ + static_cast<std::uint64_t>(bytes));
    }
    if (end <= sent_) return 0;
    std::uint64_t count = std::min<std::uint64_t>(end - sent_, room);
    if (faults.max_transfer > 0) count = std::min<std::uint64_t>(count, faults.max_transfer);
    return static_cast<std::size_t>(count) / 2 * 2;
  }

  static void delay(std::uint64_t highs, std::vector<std::uint8_t>* words) {
    constexpr unsigned kTimeHigh = 8;  // upper four of a word's bits; the others are the time in units of 4096 us
    for (std::size_t at = 0; at + 1 < words->size(); at += 2) {
      std::uint8_t* const word = words->data() + at;
      if (word[1] >> 4U != kTimeHigh) continue;
      const std::uint64_t time = ((word[1] & 15U) * 256U + word[0] + highs) % 4096;
      word[0] = static_cast<std::uint8_t>(time);
      word[1] = static_cast<std::uint8_t>(kTimeHigh << 4U | time >> 8U);
    }
  }

  std::uint64_t sent_ = 0;
  std::uint64_t sent_at_begin_ = 0;
  std::size_t transfers_ = 0;
  bool halted_ = false;
  Clock::time_point begin_ = Clock::now();
};

}  // namespace lecalib::test

// SPDX-License-Identifier: MIT
/// Tells the events of lamps that flicker with the mains (100 and 120 Hz) from those of moving edges.
///
/// Light that flickers makes a whole region fire in the same part of each period, at the same pixels again and again;
/// an edge passes a pixel once, what sweeps past at that rate (gratings) does so at another time at each place, and
/// what vibrates at that rate is thin. So a period is cut into slots, and each block of pixels remembers for each slot
/// and polarity in which of the last 8 periods it stood out. An event is flicker if its slot did so often enough, its
/// pixel has fired in such a slot in an earlier burst, and so have pixels all around. None of them need fire in every
/// period: real ones miss most.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/records.hpp"

namespace lecalib {

inline constexpr std::size_t kFlickerBlockShift = 5;  ///< blocks of 32 x 32 px
inline constexpr std::size_t kFlickerSlots = 16;      ///< of a period
inline constexpr std::size_t kFlickerLights = 2;      ///< 100 Hz and 120 Hz

/// What a block knows of one light, by polarity and slot. 68 bytes.
struct FlickerBlock {
  std::uint8_t counts[2][kFlickerSlots];   ///< events in the current period, up to 255
  std::uint8_t history[2][kFlickerSlots];  ///< a bit for each of the last 8 periods, the latest lowest
  std::uint16_t flickers[2];               ///< a bit for each slot
};

/// Keeps its state from window to window: one byte per pixel and 136 for each block.
class FlickerFilter {
 public:
  template <class Carver>
  constexpr bool carve(Carver& carver, std::uint16_t width, std::uint16_t height) noexcept {
    constexpr std::size_t kRoundUp = (std::size_t{1} << kFlickerBlockShift) - 1;
    width_ = width;
    height_ = height;
    columns_ = (width + kRoundUp) >> kFlickerBlockShift;
    num_blocks_ = columns_ * ((height + kRoundUp) >> kFlickerBlockShift);
    is_running_ = false;
    return carver.carve(kFlickerLights * num_blocks_, &blocks_) && carver.carve(std::size_t{width} * height, &pixels_);
  }

  /// Whether memory was carved for a sensor of at least this size.
  [[nodiscard]] bool holds(std::uint16_t width, std::uint16_t height) const noexcept {
    return width <= width_ && height <= height_ && blocks_.size() == kFlickerLights * num_blocks_ &&
           pixels_.size() == std::size_t{width_} * height_;
  }

  /// Forgets everything, as do pauses of more than 65 ms and steps back in time.
  void restart() noexcept { is_running_ = false; }

  /// Drops flicker from events in order of time that follow on those of the last call.
  /// @param events      inside of a sensor that this holds; those kept move to the front, in order
  /// @param min_periods an event is flicker if its slot stood out in so many of the last 8 periods, 1 to 8
  /// @return how many are kept
  /// Complexity O(events + blocks per period + pixels per 65 ms).
  std::size_t drop(Span<Event> events, std::uint8_t min_periods) noexcept;

 private:
  void start(std::int64_t t_us) noexcept;
  void advance(std::int64_t t_us, std::uint8_t min_periods) noexcept;
  void end_period(std::size_t light, std::uint8_t min_periods) noexcept;
  void forget_old_pixels() noexcept;
  [[nodiscard]] bool count(const Event& event) noexcept;
  [[nodiscard]] bool has_fired_before(const Event& event) noexcept;
  [[nodiscard]] bool lies_in_region(const Event& event) const noexcept;
  [[nodiscard]] std::uint64_t pixel_time() const noexcept;

  Span<FlickerBlock> blocks_;  ///< [lights x blocks]
  Span<std::uint8_t> pixels_;  ///< when each fired last in a slot that stands out, see has_fired_before()
  std::uint16_t width_ = 0;
  std::uint16_t height_ = 0;
  std::size_t columns_ = 0;
  std::size_t num_blocks_ = 0;
  std::int64_t start_us_ = 0;
  std::int64_t now_us_ = 0;
  std::uint64_t slot_end_[kFlickerLights] = {};  ///< since start_us_, in units of 1/6 us
  std::uint8_t slot_[kFlickerLights] = {};
  std::uint64_t next_forgetting_ = 0;  ///< in units of pixel_time()
  bool is_running_ = false;
};

}  // namespace lecalib

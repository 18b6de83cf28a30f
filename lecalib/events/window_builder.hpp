// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

struct WindowOptions {
  std::int64_t length_us = 20'000;  ///< > 0; 0: windows end by count alone
  std::uint64_t max_events = 0;     ///< a window ends once it has received so many; 0: windows end by time alone
  /// How far an event may lie before the latest one and still count as the sensor's own disorder, >= 0.
  std::int64_t disorder_us = 1'000;
  /// Of a window of length_us at most so many events per second are kept, so that what follows keeps up with sensors
  /// that send more; 0: as many as the storage holds.
  std::uint32_t max_rate_per_s = 0;
  /// A first window, of length_us, begins at a multiple of length_us, so that those of several sensors on one clock lie
  /// on one grid. (The first event's time where that multiple is before all times.)
  bool on_grid = false;
};

/// Counts since init().
struct WindowStats {
  std::uint64_t windows = 0;        ///< handed out
  std::uint64_t empty_windows = 0;  ///< lengths without an event, passed over
  std::uint64_t events = 0;         ///< received into windows, thinned ones included
  std::uint64_t thinned = 0;        ///< of these, left out because the storage was full or too many came
  std::uint64_t late = 0;           ///< of these, earlier than the latest by disorder_us or less
  std::uint64_t backward = 0;       ///< dropped: earlier than that
  std::uint64_t restarts = 0;       ///< times the clock was found to have been set back
  std::uint64_t cut = 0;            ///< of `events`, in windows that cut() dropped
};

/// Cuts a stream of events into windows [begin_us, end_us) that lie end to end.
///
/// By time: the first window begins with the first event, or on a grid; lengths without an event are passed over,
/// keeping the rhythm. By count: a window ends after the last event of the microsecond in which it received max_events.
/// By both: whichever comes first. By count alone a window begins with its first event.
///
/// A window that receives more events than the storage holds, or than max_rate_per_s grants it, is thinned evenly: of
/// each 2^k successive events one, chosen at random (from a fixed seed), is kept, and k grows by one whenever the room
/// is full.
///
/// Time that runs backward: an event up to disorder_us before the latest one goes into the current window, even if
/// that begins later. Earlier ones are dropped as false stamps, until kRestartAfter of them come in a row: then the
/// sensor's clock was set back, the current window ends and the next one begins with that event.
class WindowBuilder {
 public:
  static constexpr std::uint32_t kRestartAfter = 16;

  /// Starts anew.
  /// @param storage two events or more; must outlive the builder. An odd one stays unused.
  /// @return ok | invalid_argument (an option out of range, neither time nor count) | buffer_too_small
  Status init(const WindowOptions& options, Span<Event> storage) noexcept;

  /// Takes events from the front of *events.
  /// @param[out] window when ok: valid until the next call of push() or finish(); its events lie at the front of the
  ///             storage. Unchanged otherwise.
  /// @return ok (a window is complete; *events may hold more) | need_more_data (*events is used up) |
  ///         wrong_state (before init())
  Status push(Span<const Event>* events, EventWindow* window) noexcept;

  /// Ends the current window after its latest event. @return ok | need_more_data (there is none) | wrong_state
  Status finish(EventWindow* window) noexcept;

  /// Events are missing between those pushed and those to come: drops the window that they would be missing from. The
  /// next one begins with its first event, at any time.
  void cut() noexcept;

  /// Sets the length of the windows that are still to begin. After push() gave a window that is the next one.
  /// @return ok | invalid_argument | wrong_state
  Status set_length_us(std::int64_t length_us) noexcept;

  [[nodiscard]] const WindowStats& stats() const noexcept { return stats_; }

 private:
  void open(std::int64_t t_us) noexcept;
  [[nodiscard]] std::int64_t first_begin_us(std::int64_t t_us) const noexcept;
  void close(std::int64_t end_us, EventWindow* window) noexcept;
  /// Adds events as long as they come in order, fall into the open window and are all kept, as most do.
  /// @return whether one is left, which asks for more than that
  bool add_run(Span<const Event>* events) noexcept;
  void add(const Event& event) noexcept;
  void keep(const Event& event) noexcept;
  void halve() noexcept;
  [[nodiscard]] std::uint64_t draw_below_stride() noexcept;
  [[nodiscard]] bool is_backward(std::int64_t t_us) const noexcept;
  [[nodiscard]] bool ends_before(std::int64_t t_us, std::int64_t* end_us) const noexcept;

  WindowOptions options_;
  Span<Event> storage_;  ///< empty before init(), of even size after
  WindowStats stats_;
  Rng rng_{0};

  bool has_clock_ = false;  ///< latest_us_ and next_begin_us_ are set
  std::int64_t latest_us_ = 0;
  std::int64_t next_begin_us_ = 0;
  std::uint32_t backward_run_ = 0;

  bool is_open_ = false;
  std::int64_t begin_us_ = 0;
  std::int64_t end_us_ = 0;
  std::uint64_t received_ = 0;
  std::size_t room_ = 0;  ///< even: as many events of this window may be kept
  std::size_t size_ = 0;
  std::uint64_t stride_ = 1;    ///< one of so many events is kept
  std::uint64_t in_group_ = 0;  ///< position within the current stride_ events
  std::uint64_t chosen_ = 0;    ///< the position that is kept
};

}  // namespace lecalib

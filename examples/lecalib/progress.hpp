// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <string>

namespace lecalib::command {

/// A bar on stderr for work that takes long. Silent when stderr is no terminal and during the first half second; gone
/// when the object is.
class Progress {
 public:
  explicit Progress(std::string what);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  /// @param fraction of the work that is done, 0 to 1. Cheap: draws ten times a second at most.
  void update(double fraction);
  /// The same for work whose end nobody knows: a text in place of the bar.
  void show(const std::string& text);

 private:
  using Clock = std::chrono::steady_clock;
  bool is_due();
  std::string what_;
  bool is_terminal_;
  bool is_drawn_ = false;
  Clock::time_point next_;
};

}  // namespace lecalib::command

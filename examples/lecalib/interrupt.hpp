// SPDX-License-Identifier: MIT
#pragma once

namespace lecalib::command {

/// While it lives, Ctrl-C (SIGINT) and SIGTERM ask work without an end of its own to finish. The second one ends the
/// program at once.
class Interrupt {
 public:
  Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  ~Interrupt();
  [[nodiscard]] static bool came();
};

}  // namespace lecalib::command

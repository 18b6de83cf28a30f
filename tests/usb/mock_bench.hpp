// SPDX-License-Identifier: MIT
/// Runs the built lecalib program, unmodified, on a machine whose cameras are fakes.
#pragma once

#include <sys/types.h>
#include <umockdev.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/run_command.hpp"
#include "usb/mock_port.hpp"

namespace lecalib::test {

class MockBench {
 public:
  MockBench();
  MockBench(const MockBench&) = delete;
  MockBench& operator=(const MockBench&) = delete;
  ~MockBench();

  template <class Device>
  Device& add(std::shared_ptr<Device> device, MockPort::System system = {}) {
    ports_.push_back(std::make_unique<MockPort>(bed_, device, system));
    ports_.back()->plug_in();
    return *device;
  }

  /// Milliseconds from unplugging to plugging in anew; below 0: it stays away.
  int replug_after_ms = -1;
  /// Asked every few milliseconds while the program runs, with its process id.
  std::function<void(pid_t)> meanwhile = [](pid_t) {};

  /// Runs lecalib, which is to end by itself.
  CommandRun run(const std::vector<std::string>& arguments, RunAs who = RunAs::me);

  /// From the unplugging to the program's end.
  [[nodiscard]] double seconds_since_unplugged() const;
  [[nodiscard]] const MockPort& port(std::size_t i) const { return *ports_[i]; }

 private:
  using Clock = std::chrono::steady_clock;
  void tend();

  UMockdevTestbed* bed_;
  GMainLoop* loop_;
  std::thread loop_thread_;  ///< umockdev sends what is plugged in and out from there
  std::vector<std::unique_ptr<MockPort>> ports_;
  Clock::time_point unplugged_;
  Clock::time_point ended_;
  bool is_away_ = false;
};

}  // namespace lecalib::test

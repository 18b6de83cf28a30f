// SPDX-License-Identifier: MIT
/// What the subcommands that use a live camera have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "interrupt.hpp"
#include "lecalib/usb/camera.hpp"
#include "lecalib/usb/stream_buffer.hpp"
#include "progress.hpp"

namespace lecalib::command {

struct CameraOptions {
  std::string serial;
  double seconds = 0;  ///< of the stream; 0: until Ctrl-C
  std::vector<std::string> biases;
  std::string roi;
  std::uint32_t max_rate = 0;
  double reconnect_s = 0;

  /// In the driver's words; ends by fail() where they cannot be read.
  [[nodiscard]] usb::CameraSettings settings() const;
};

void add_camera_options(CLI::App* command, CameraOptions* options);

/// The bytes of a live camera, until the time is over, Ctrl-C or a fault.
class CameraStream {
 public:
  /// Opens the camera and starts it. Ends by fail().
  explicit CameraStream(const CameraOptions& options);

  [[nodiscard]] const usb::Camera& camera() const { return *camera_; }

  /// The next buffer, valid until the next call; its bytes are empty at the end.
  usb::BufferRing::Buffer read();
  /// Buffers that wait to be read.
  [[nodiscard]] std::size_t waiting() const { return buffer_.waiting(); }
  /// How often the camera was plugged in anew; its clock and its words begin anew with it.
  [[nodiscard]] int restarts() const { return restarts_; }
  /// Stops the camera; what waits to be read goes.
  void abandon();

  /// What ended it; empty: the time was over or Ctrl-C came.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] double elapsed_s() const;
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Buffers that this machine did not keep up with.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_ + buffer_.dropped(); }
  /// What was lost and repeated, as lines for people; empty if nothing was.
  [[nodiscard]] std::string losses() const;
  /// A line for while it runs.
  void show(Progress* progress, const std::string& more) const;

 private:
  using Clock = std::chrono::steady_clock;
  void start();
  bool reconnect();
  void stop(std::string fault);

  CameraOptions options_;
  std::unique_ptr<usb::Bus> bus_;
  usb::StreamBuffer buffer_;  ///< outlives the camera, whose thread fills it
  std::unique_ptr<usb::Camera> camera_;
  std::string serial_;
  std::optional<Interrupt> interrupt_;  ///< once there is something to finish: a start is just broken off
  Clock::time_point begin_;
  Clock::time_point last_data_;
  bool is_stopped_ = false;
  int restarts_ = 0;
  std::uint64_t bytes_ = 0;
  std::string fault_;
  usb::StreamStats stats_;       ///< of streams that are over
  std::uint64_t dropped_ = 0;    ///< likewise
  std::uint64_t odd_bytes_ = 0;  ///< likewise
};

}  // namespace lecalib::command

// SPDX-License-Identifier: MIT
/// A camera as seen from its USB plug. One model of each camera serves the scripted transport and whatever plays it to
/// an unmodified program.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "lecalib/usb/transport.hpp"
#include "support/fake_stream.hpp"

namespace lecalib::test {

using DeviceBytes = std::vector<std::uint8_t>;

class FakeDevice {
 public:
  virtual ~FakeDevice() = default;

  usb::DeviceInfo info;
  FakeStream stream;
  usb::UsbStatus open_status = usb::UsbStatus::ok;  ///< what opening it gives
  bool plugged_in = true;
  std::deque<DeviceBytes> answers;  ///< waiting on the command endpoint

  /// A control transfer. @param data sent @return the answer; nothing: refused (stall)
  virtual std::optional<DeviceBytes> control(const usb::ControlRequest& request, const DeviceBytes& data) = 0;
  /// A transfer to the command endpoint; what it answers goes into `answers`. @return false: refused (stall)
  virtual bool command(const DeviceBytes& bytes) = 0;
  /// Whether it was told to send data.
  [[nodiscard]] virtual bool is_streaming() const = 0;
  /// Which endpoint sends the data.
  [[nodiscard]] virtual std::uint8_t data_endpoint() const = 0;
  /// Switches it off and on.
  virtual void replug() = 0;
};

}  // namespace lecalib::test

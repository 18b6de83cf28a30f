// SPDX-License-Identifier: MIT
/// Bytes to and from a camera, whoever carries them: libusb on a machine with USB, a script in tests. A camera's driver
/// knows nothing else of USB.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lecalib/core/span.hpp"
#include "lecalib/usb/usb_status.hpp"

namespace lecalib::usb {

/// What can be known of a device without opening it; the strings need it open and are empty before.
struct DeviceInfo {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint16_t release = 0;  ///< bcdDevice: the vendor's version of the device
  std::uint8_t bus = 0;       ///< with `address`: where it is plugged in, until it is unplugged
  std::uint8_t address = 0;
  std::uint32_t speed_mbit = 0;              ///< 12, 480, 5000 ...; 0: not known
  std::vector<std::uint8_t> bulk_endpoints;  ///< addresses, of interface 0, in the descriptor's order
  std::string product_name;
  std::string serial;
};

/// A control transfer on endpoint 0. Bit 7 of `type` is its direction: set, the device answers.
struct ControlRequest {
  std::uint8_t type;
  std::uint8_t request;
  std::uint16_t value;
  std::uint16_t index;
};

inline constexpr std::uint8_t kDeviceAnswers = 0x80;

/// Takes what a stream brings. Called from the transport's thread, one call at a time, so it returns soon and does not
/// call the transport.
class StreamSink {
 public:
  virtual ~StreamSink() = default;
  /// The bytes of one transfer, in the order of the stream.
  virtual void take(Span<const std::uint8_t> bytes) = 0;
  /// The last call. @param why ok: stop_stream() was called
  virtual void end(UsbStatus why) = 0;
};

struct StreamOptions {
  std::uint8_t endpoint = 0x81;  ///< bulk, from the device
  std::uint32_t transfers = 32;  ///< waiting for data at a time, 1 to 256
  std::uint32_t transfer_bytes = std::uint32_t{1}
                                 << 17;  ///< of each; 4 MiB in all of the 16 that Linux allows at first
};

struct StreamStats {
  std::uint64_t bytes = 0;
  std::uint64_t transfers = 0;  ///< that brought something
  std::uint64_t stalls = 0;     ///< halts of the endpoint that were cleared
  std::uint64_t overflows = 0;  ///< transfers that the device overran; what they held is lost
  std::uint64_t failures = 0;   ///< transfers that failed otherwise and were repeated
  std::uint32_t in_flight = 0;  ///< transfers waiting for data
  std::uint32_t transfer_bytes = 0;
};

/// An open device whose interface 0 is claimed. The destructor ends the stream, releases and closes. Transfers other
/// than the stream's come from one thread. No call takes more than two seconds.
class Transport {
 public:
  virtual ~Transport() = default;
  [[nodiscard]] virtual const DeviceInfo& info() const = 0;

  /// @param data sent, or room for the answer
  /// @param[out] count bytes that went over
  virtual UsbStatus control(const ControlRequest& request, Span<std::uint8_t> data, std::size_t* count) = 0;
  virtual UsbStatus write(std::uint8_t endpoint, Span<const std::uint8_t> bytes) = 0;
  /// @param[out] count valid also beside timeout
  virtual UsbStatus read(std::uint8_t endpoint, Span<std::uint8_t> room, unsigned timeout_ms, std::size_t* count) = 0;
  /// Makes a halted endpoint usable, and both sides begin anew on it.
  virtual UsbStatus clear_halt(std::uint8_t endpoint) = 0;

  /// Sends transfers for data on their way; *sink gets what they bring until its end() was called.
  /// @return ok | no_memory (not even a few small transfers) | no_device | failed
  virtual UsbStatus start_stream(const StreamOptions& options, StreamSink* sink) = 0;
  /// Takes the transfers back; when it returns sink->end() was called. Nothing happens without a stream.
  virtual void stop_stream() = 0;
  [[nodiscard]] virtual StreamStats stream_stats() const = 0;

  /// What the device needs between two commands.
  virtual void wait_us(std::uint32_t time_us) = 0;
};

/// Where devices are plugged in.
class Bus {
 public:
  virtual ~Bus() = default;
  virtual UsbStatus list(std::vector<DeviceInfo>* devices) = 0;
  /// Opens the device that is at info.bus and info.address, and claims its interface 0.
  /// @return ok | access_denied | busy | no_device | failed
  virtual UsbStatus open(const DeviceInfo& info, std::unique_ptr<Transport>* transport) = 0;
};

}  // namespace lecalib::usb

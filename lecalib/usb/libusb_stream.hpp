// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "lecalib/usb/transport.hpp"

struct libusb_context;
struct libusb_device_handle;
struct libusb_transfer;

namespace lecalib::usb {

/// What libusb's error number, or a count of bytes, says.
UsbStatus libusb_status(int result) noexcept;

/// A ring of transfers and the thread that runs it. Callbacks come one at a time, from whichever thread handles
/// libusb's events: mostly this one, now and then the one that waits for a command.
class LibusbStream {
 public:
  LibusbStream(libusb_context* context, libusb_device_handle* handle, std::uint8_t endpoint, StreamSink* sink)
      : context_(context), handle_(handle), endpoint_(endpoint), sink_(sink) {}
  LibusbStream(const LibusbStream&) = delete;
  LibusbStream& operator=(const LibusbStream&) = delete;
  ~LibusbStream() { free_transfers(); }

  /// @return as Transport::start_stream()
  UsbStatus start(const StreamOptions& options);
  /// @return whether all transfers came back; if not, the operating system still writes to this object
  bool stop();
  [[nodiscard]] StreamStats stats() const;
  /// libusb's: a transfer has come back.
  void on_done(libusb_transfer* request);

 private:
  struct Transfer {
    libusb_transfer* request;
    std::unique_ptr<unsigned char[]> bytes;
    bool in_flight = false;
  };

  bool allocate(std::uint32_t count, std::uint32_t bytes);
  void free_transfers();
  void take_data(const libusb_transfer& request);
  void finish(libusb_transfer* request);
  void count_repeat(UsbStatus why, std::uint64_t* counter);
  UsbStatus submit(Transfer* transfer);
  void submit_idle();
  void end(UsbStatus why);
  void cancel_all();
  void recover();
  bool drain();
  void run();

  libusb_context* context_;
  libusb_device_handle* handle_;
  std::uint8_t endpoint_;
  StreamSink* sink_;
  std::thread thread_;
  bool drained_ = true;

  mutable std::mutex mutex_;  ///< for what follows
  std::vector<Transfer> transfers_;
  std::size_t in_flight_ = 0;
  bool halted_ = false;  ///< the endpoint is, until recover()
  bool ending_ = false;
  bool given_up_ = false;  ///< nobody waits for the transfers that are still out
  UsbStatus why_ = UsbStatus::ok;
  int repeats_ = 0;  ///< halts or failures since the last data
  StreamStats stats_;
};

}  // namespace lecalib::usb

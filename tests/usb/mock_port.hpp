// SPDX-License-Identifier: MIT
/// A USB port under umockdev: plays a FakeDevice to an unmodified libusb program by answering what it asks of the
/// kernel (usbfs).
#pragma once

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "support/fake_device.hpp"

namespace lecalib::test {

class MockPort {
 public:
  /// What the operating system does with the port.
  struct System {
    bool is_busy = false;              ///< another program has claimed the interface
    bool is_private = false;           ///< its owner alone may open it
    bool has_scatter_gather = true;    ///< without it libusb cuts transfers into pieces of 16 KiB
    std::size_t max_bytes = SIZE_MAX;  ///< of stream transfers at a time
  };

  MockPort(UMockdevTestbed* bed, std::shared_ptr<FakeDevice> device, System system);
  MockPort(const MockPort&) = delete;
  MockPort& operator=(const MockPort&) = delete;
  ~MockPort();

  /// Makes the device appear at its bus and address.
  void plug_in();
  /// The device as it comes back: at another address, as Linux does it.
  void replug();
  /// Whether the fault script has unplugged it.
  [[nodiscard]] bool is_unplugged() const;
  /// Bytes of its recording that it has sent.
  [[nodiscard]] std::uint64_t sent() const;
  /// Takes it out of the list of devices.
  void remove();
  [[nodiscard]] std::string node() const;
  /// Transfers that the program left behind.
  [[nodiscard]] std::size_t pending() const;

 private:
  /// A request block of usbfs and its buffer, both in the program's memory.
  struct Urb {
    UMockdevIoctlData* block;
    UMockdevIoctlData* buffer;
    gulong address;
    [[nodiscard]] usbdevfs_urb& fields() const { return *reinterpret_cast<usbdevfs_urb*>(block->data); }
  };

  static gboolean on_ioctl(UMockdevIoctlBase* base, UMockdevIoctlClient* client, gpointer port);
  static gboolean on_hold_over(gpointer port);
  void handle(UMockdevIoctlClient* client);
  int submit(UMockdevIoctlData* argument, gulong address);
  int discard(gulong address);
  void reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  bool try_reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  void answer_control(const Urb& urb);
  void answer_command(const Urb& urb);
  void pump();
  void pump_stream();
  void finish(const Urb& urb, int status, std::size_t size);
  void finish_all(int status);
  void unplug();
  void forget_all();

  UMockdevTestbed* bed_;
  UMockdevIoctlBase* base_;
  std::shared_ptr<FakeDevice> device_;
  System system_;
  std::string sys_path_;
  mutable std::mutex mutex_;  ///< umockdev answers in a thread of its own
  std::deque<Urb> stream_, answers_, done_;
  std::size_t stream_bytes_ = 0;
  bool unplugged_ = false;
  bool is_halted_ = false;  ///< the program has been told
  // The program asks again and again whether something is done; each answer that nothing is waits a little.
  UMockdevIoctlClient* held_ = nullptr;
  UMockdevIoctlData* held_argument_ = nullptr;
};

}  // namespace lecalib::test

// SPDX-License-Identifier: MIT
/// A Bus without USB: plays FakeDevices to drivers, with a thread that streams.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "lecalib/usb/transport.hpp"
#include "support/fake_device.hpp"

namespace lecalib::test {

/// A device and the lock for it: the stream's thread and the driver's both use it.
struct SharedDevice {
  std::shared_ptr<FakeDevice> device;
  std::shared_ptr<std::mutex> mutex = std::make_shared<std::mutex>();
};

class ScriptedTransport : public usb::Transport {
 public:
  ScriptedTransport(SharedDevice shared, std::uint64_t* waited_us)
      : shared_(std::move(shared)), info_(shared_.device->info), waited_us_(waited_us) {}
  ~ScriptedTransport() override { ScriptedTransport::stop_stream(); }

  [[nodiscard]] const usb::DeviceInfo& info() const override { return info_; }

  usb::UsbStatus control(const usb::ControlRequest& request, Span<std::uint8_t> data, std::size_t* count) override {
    const std::lock_guard<std::mutex> lock(*shared_.mutex);
    *count = 0;
    if (!device().plugged_in) return usb::UsbStatus::no_device;
    const auto answer = device().control(request, DeviceBytes(data.begin(), data.end()));
    if (!answer) return usb::UsbStatus::stall;
    *count = (request.type & usb::kDeviceAnswers) == 0 ? data.size() : std::min(answer->size(), data.size());
    if ((request.type & usb::kDeviceAnswers) != 0) std::copy_n(answer->begin(), *count, data.begin());
    return usb::UsbStatus::ok;
  }
  usb::UsbStatus write(std::uint8_t /*endpoint*/, Span<const std::uint8_t> bytes) override {
    const std::lock_guard<std::mutex> lock(*shared_.mutex);
    if (!device().plugged_in) return usb::UsbStatus::no_device;
    return device().command(DeviceBytes(bytes.begin(), bytes.end())) ? usb::UsbStatus::ok : usb::UsbStatus::stall;
  }
  usb::UsbStatus read(std::uint8_t endpoint, Span<std::uint8_t> room, unsigned /*timeout_ms*/,
                      std::size_t* count) override {
    const std::lock_guard<std::mutex> lock(*shared_.mutex);
    *count = 0;
    if (!device().plugged_in) return usb::UsbStatus::no_device;
    if (endpoint == device().data_endpoint() || device().answers.empty()) return usb::UsbStatus::timeout;
    const DeviceBytes answer = std::move(device().answers.front());
    device().answers.pop_front();
    if (answer.size() > room.size()) return usb::UsbStatus::overflow;
    *count = answer.size();
    std::copy(answer.begin(), answer.end(), room.begin());
    return usb::UsbStatus::ok;
  }
  usb::UsbStatus clear_halt(std::uint8_t endpoint) override {
    const std::lock_guard<std::mutex> lock(*shared_.mutex);
    if (endpoint == device().data_endpoint()) device().stream.clear_halt();
    return device().plugged_in ? usb::UsbStatus::ok : usb::UsbStatus::no_device;
  }

  usb::UsbStatus start_stream(const usb::StreamOptions& options, usb::StreamSink* sink) override {
    stop_stream();
    stopping_ = false;
    thread_ = std::thread([this, options, sink] { run(options, sink); });
    return usb::UsbStatus::ok;
  }
  void stop_stream() override {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] usb::StreamStats stream_stats() const override { return {}; }
  void wait_us(std::uint32_t time_us) override { *waited_us_ += time_us; }

 private:
  [[nodiscard]] FakeDevice& device() const { return *shared_.device; }

  void run(const usb::StreamOptions& options, usb::StreamSink* sink) {
    using What = FakeStream::What;
    DeviceBytes bytes;
    while (!stopping_) {
      What what = What::nothing;
      {
        const std::lock_guard<std::mutex> lock(*shared_.mutex);
        if (!device().plugged_in) return sink->end(usb::UsbStatus::no_device);
        if (device().is_streaming()) what = device().stream.next(options.transfer_bytes, &bytes);
        if (what == What::unplug) device().plugged_in = false;
      }
      if (what == What::data) sink->take(bytes);
      if (what == What::stall) return sink->end(usb::UsbStatus::stall);
      if (what == What::nothing) std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    sink->end(usb::UsbStatus::ok);
  }

  SharedDevice shared_;
  usb::DeviceInfo info_;
  std::uint64_t* waited_us_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

class ScriptedBus : public usb::Bus {
 public:
  std::vector<SharedDevice> devices;
  std::uint64_t waited_us = 0;  ///< by drivers, in all

  template <class Device>
  Device& plug_in(std::shared_ptr<Device> device) {
    devices.push_back({device});
    return *device;
  }

  usb::UsbStatus list(std::vector<usb::DeviceInfo>* out) override {
    out->clear();
    for (const SharedDevice& shared : devices) {
      const std::lock_guard<std::mutex> lock(*shared.mutex);
      if (shared.device->plugged_in) out->push_back(shared.device->info);
    }
    return usb::UsbStatus::ok;
  }
  usb::UsbStatus open(const usb::DeviceInfo& info, std::unique_ptr<usb::Transport>* transport) override {
    for (const SharedDevice& shared : devices) {
      const std::lock_guard<std::mutex> lock(*shared.mutex);
      const usb::DeviceInfo& own = shared.device->info;
      if (!shared.device->plugged_in || own.bus != info.bus || own.address != info.address) continue;
      if (shared.device->open_status != usb::UsbStatus::ok) return shared.device->open_status;
      *transport = std::make_unique<ScriptedTransport>(shared, &waited_us);
      return usb::UsbStatus::ok;
    }
    return usb::UsbStatus::no_device;
  }
};

}  // namespace lecalib::test

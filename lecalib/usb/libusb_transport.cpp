// SPDX-License-Identifier: MIT
#include "lecalib/usb/libusb_transport.hpp"

#include <libusb.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "lecalib/usb/libusb_stream.hpp"

namespace lecalib::usb {
namespace {

constexpr unsigned kCommandTimeoutMs = 1000;
constexpr int kInterface = 0;

std::uint32_t speed_mbit(libusb_device* device) {
  switch (libusb_get_device_speed(device)) {
    case LIBUSB_SPEED_LOW: return 1;
    case LIBUSB_SPEED_FULL: return 12;
    case LIBUSB_SPEED_HIGH: return 480;
    case LIBUSB_SPEED_SUPER: return 5000;
    case LIBUSB_SPEED_SUPER_PLUS: return 10000;
    default: return 0;
  }
}

std::vector<std::uint8_t> bulk_endpoints(libusb_device* device) {
  std::vector<std::uint8_t> addresses;
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != 0) return addresses;
  if (config->bNumInterfaces > kInterface && config->interface[kInterface].num_altsetting > 0) {
    const libusb_interface_descriptor& setting = config->interface[kInterface].altsetting[0];
    for (int i = 0; i < setting.bNumEndpoints; ++i) {
      const libusb_endpoint_descriptor& endpoint = setting.endpoint[i];
      const bool is_bulk = (endpoint.bmAttributes & 3U) == LIBUSB_TRANSFER_TYPE_BULK;
      if (is_bulk) addresses.push_back(endpoint.bEndpointAddress);
    }
  }
  libusb_free_config_descriptor(config);
  return addresses;
}

DeviceInfo info_of(libusb_device* device) {
  DeviceInfo info;
  libusb_device_descriptor descriptor{};
  (void)libusb_get_device_descriptor(device, &descriptor);
  info.vendor = descriptor.idVendor;
  info.product = descriptor.idProduct;
  info.release = descriptor.bcdDevice;
  info.bus = libusb_get_bus_number(device);
  info.address = libusb_get_device_address(device);
  info.speed_mbit = speed_mbit(device);
  info.bulk_endpoints = bulk_endpoints(device);
  return info;
}

std::string text_of(libusb_device_handle* handle, std::uint8_t index) {
  unsigned char text[256];
  const int size = index == 0 ? 0 : libusb_get_string_descriptor_ascii(handle, index, text, sizeof text);
  return size > 0 ? std::string(text, text + size) : std::string();
}

class LibusbTransport : public Transport {
 public:
  LibusbTransport(std::shared_ptr<libusb_context> context, libusb_device_handle* handle, DeviceInfo info)
      : context_(std::move(context)), handle_(handle), info_(std::move(info)) {}
  ~LibusbTransport() override {
    LibusbTransport::stop_stream();
    (void)libusb_release_interface(handle_, kInterface);
    libusb_close(handle_);
  }

  [[nodiscard]] const DeviceInfo& info() const override { return info_; }

  UsbStatus control(const ControlRequest& request, Span<std::uint8_t> data, std::size_t* count) override {
    const int done = libusb_control_transfer(handle_, request.type, request.request, request.value, request.index,
                                             data.data(), static_cast<std::uint16_t>(data.size()), kCommandTimeoutMs);
    *count = static_cast<std::size_t>(std::max(done, 0));
    return libusb_status(done);
  }
  UsbStatus write(std::uint8_t endpoint, Span<const std::uint8_t> bytes) override {
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());  // libusb takes no constant bytes
    std::size_t done = 0;
    const UsbStatus status = bulk(endpoint, copy, kCommandTimeoutMs, &done);
    return status == UsbStatus::ok && done < bytes.size() ? UsbStatus::failed : status;
  }
  UsbStatus read(std::uint8_t endpoint, Span<std::uint8_t> room, unsigned timeout_ms, std::size_t* count) override {
    return bulk(endpoint, room, timeout_ms, count);
  }
  UsbStatus clear_halt(std::uint8_t endpoint) override { return libusb_status(libusb_clear_halt(handle_, endpoint)); }

  UsbStatus start_stream(const StreamOptions& options, StreamSink* sink) override {
    stop_stream();
    stream_ = std::make_unique<LibusbStream>(context_.get(), handle_, options.endpoint, sink);
    const UsbStatus status = stream_->start(options);
    if (status != UsbStatus::ok) stop_stream();
    return status;
  }
  void stop_stream() override {
    if (!stream_) return;
    last_stats_ = stream_->stats();
    // A stream whose transfers did not come back stays for as long as the program runs: they hold its memory.
    if (!stream_->stop())
      (void)stream_.release();
    else
      last_stats_ = stream_->stats();
    stream_.reset();
  }
  [[nodiscard]] StreamStats stream_stats() const override { return stream_ ? stream_->stats() : last_stats_; }
  void wait_us(std::uint32_t time_us) override { std::this_thread::sleep_for(std::chrono::microseconds(time_us)); }

 private:
  UsbStatus bulk(std::uint8_t endpoint, Span<std::uint8_t> bytes, unsigned timeout_ms, std::size_t* count) {
    int done = 0;
    const int result =
        libusb_bulk_transfer(handle_, endpoint, bytes.data(), static_cast<int>(bytes.size()), &done, timeout_ms);
    *count = static_cast<std::size_t>(std::max(done, 0));
    return libusb_status(result);
  }

  std::shared_ptr<libusb_context> context_;
  libusb_device_handle* handle_;
  DeviceInfo info_;
  std::unique_ptr<LibusbStream> stream_;
  StreamStats last_stats_;
};

class LibusbBus : public Bus {
 public:
  explicit LibusbBus(libusb_context* context) : context_(context, &libusb_exit) {}

  UsbStatus list(std::vector<DeviceInfo>* devices) override {
    devices->clear();
    return for_each([&](libusb_device* device) {
      devices->push_back(info_of(device));
      return false;
    });
  }

  UsbStatus open(const DeviceInfo& info, std::unique_ptr<Transport>* transport) override {
    UsbStatus opened = UsbStatus::no_device;
    const UsbStatus status = for_each([&](libusb_device* device) {
      const bool is_it = libusb_get_bus_number(device) == info.bus && libusb_get_device_address(device) == info.address;
      if (is_it) opened = open_device(device, transport);
      return is_it;
    });
    return status == UsbStatus::ok ? opened : status;
  }

 private:
  /// Calls visit(device) until it returns true.
  template <class Visit>
  UsbStatus for_each(Visit&& visit) {
    libusb_device** devices = nullptr;
    const auto count = libusb_get_device_list(context_.get(), &devices);
    if (count < 0) return libusb_status(static_cast<int>(count));
    for (auto i = decltype(count){0}; i < count; ++i) {
      if (visit(devices[i])) break;
    }
    libusb_free_device_list(devices, 1);
    return UsbStatus::ok;
  }

  UsbStatus open_device(libusb_device* device, std::unique_ptr<Transport>* transport) {
    libusb_device_handle* handle = nullptr;
    if (const int error = libusb_open(device, &handle); error != 0) return libusb_status(error);
    if (const int error = libusb_claim_interface(handle, kInterface); error != 0) {
      libusb_close(handle);
      return libusb_status(error);
    }
    DeviceInfo info = info_of(device);
    libusb_device_descriptor descriptor{};
    (void)libusb_get_device_descriptor(device, &descriptor);
    info.product_name = text_of(handle, descriptor.iProduct);
    info.serial = text_of(handle, descriptor.iSerialNumber);
    *transport = std::make_unique<LibusbTransport>(context_, handle, std::move(info));
    return UsbStatus::ok;
  }

  std::shared_ptr<libusb_context> context_;
};

}  // namespace

host::Result<std::unique_ptr<Bus>> make_libusb_bus() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context); error != 0) {
    return host::Error{std::string("cannot use USB: ") + libusb_strerror(static_cast<libusb_error>(error))};
  }
  return std::unique_ptr<Bus>(std::make_unique<LibusbBus>(context));
}

}  // namespace lecalib::usb

// SPDX-License-Identifier: MIT
#include "lecalib/usb/libusb_transport.hpp"

#include <libusb.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace lecalib::usb {
namespace {

using Clock = std::chrono::steady_clock;

constexpr unsigned kCommandTimeoutMs = 1000;
constexpr int kInterface = 0;

constexpr std::size_t kEnoughTransfers = 4;        // for one to be on its way while the others are handled
constexpr std::uint32_t kMinTransferBytes = 4096;  // four packets of SuperSpeed
constexpr int kMaxRepeats = 4;                     // halts or failures in a row, before a stream is given up
constexpr std::chrono::milliseconds kDrainTime{1000};
constexpr timeval kPoll = {0, 50'000};

UsbStatus status_of(int error) {
  switch (error) {
    case LIBUSB_ERROR_TIMEOUT: return UsbStatus::timeout;
    case LIBUSB_ERROR_PIPE: return UsbStatus::stall;
    case LIBUSB_ERROR_OVERFLOW: return UsbStatus::overflow;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND: return UsbStatus::no_device;
    case LIBUSB_ERROR_ACCESS: return UsbStatus::access_denied;
    case LIBUSB_ERROR_BUSY: return UsbStatus::busy;
    case LIBUSB_ERROR_NO_MEM: return UsbStatus::no_memory;
    default: return error < 0 ? UsbStatus::failed : UsbStatus::ok;
  }
}

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

/// A ring of transfers and the thread that runs it. Callbacks come one at a time, from whichever thread handles
/// libusb's events: mostly this one, now and then the one that waits for a command.
class Stream {
 public:
  Stream(libusb_context* context, libusb_device_handle* handle, std::uint8_t endpoint, StreamSink* sink)
      : context_(context), handle_(handle), endpoint_(endpoint), sink_(sink) {}
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() { free_transfers(); }

  UsbStatus start(const StreamOptions& options);
  /// @return whether all transfers came back; if not, the operating system still writes to this object
  bool stop();
  [[nodiscard]] StreamStats stats() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    StreamStats stats = stats_;
    stats.in_flight = static_cast<std::uint32_t>(in_flight_);
    return stats;
  }

 private:
  struct Transfer {
    libusb_transfer* request;
    std::unique_ptr<unsigned char[]> bytes;
    bool in_flight = false;
  };

  bool allocate(std::uint32_t count, std::uint32_t bytes);
  void free_transfers();
  static void LIBUSB_CALL on_done(libusb_transfer* request);
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

bool Stream::allocate(std::uint32_t count, std::uint32_t bytes) {
  free_transfers();
  for (std::uint32_t i = 0; i < count; ++i) {
    Transfer transfer{libusb_alloc_transfer(0), std::unique_ptr<unsigned char[]>(new unsigned char[bytes])};
    if (transfer.request == nullptr) return false;
    libusb_fill_bulk_transfer(transfer.request, handle_, endpoint_, transfer.bytes.get(), static_cast<int>(bytes),
                              &Stream::on_done, this, 0);
    transfers_.push_back(std::move(transfer));
  }
  stats_.transfer_bytes = bytes;
  return true;
}

void Stream::free_transfers() {
  for (const Transfer& transfer : transfers_) libusb_free_transfer(transfer.request);
  transfers_.clear();
}

UsbStatus Stream::start(const StreamOptions& options) {
  for (std::uint32_t bytes = options.transfer_bytes;; bytes /= 2) {
    UsbStatus status = UsbStatus::ok;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!allocate(options.transfers, bytes)) return UsbStatus::no_memory;
      for (auto transfer = transfers_.begin(); status == UsbStatus::ok && transfer != transfers_.end(); ++transfer) {
        status = submit(&*transfer);
      }
      const bool are_enough = in_flight_ >= std::min<std::size_t>(options.transfers, kEnoughTransfers);
      if (status == UsbStatus::ok || (status == UsbStatus::no_memory && are_enough)) break;
      ending_ = true;
    }
    drained_ = drain();
    if (status != UsbStatus::no_memory || bytes / 2 < kMinTransferBytes || !drained_) return status;
    ending_ = false;
  }
  thread_ = std::thread(&Stream::run, this);
  return UsbStatus::ok;
}

bool Stream::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    end(UsbStatus::ok);
  }
  libusb_interrupt_event_handler(context_);
  if (thread_.joinable()) thread_.join();
  return drained_;
}

void Stream::run() {
  while (true) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (ending_) break;
      if (halted_ && in_flight_ == 0) recover();
    }
    timeval poll = kPoll;
    (void)libusb_handle_events_timeout_completed(context_, &poll, nullptr);
  }
  drained_ = drain();
  sink_->end(why_);
}

/// Takes all transfers back. @return whether they came
bool Stream::drain() {
  const auto until = Clock::now() + kDrainTime;
  std::unique_lock<std::mutex> lock(mutex_);
  cancel_all();
  while (in_flight_ > 0 && Clock::now() < until) {
    lock.unlock();
    timeval poll = kPoll;
    (void)libusb_handle_events_timeout_completed(context_, &poll, nullptr);
    lock.lock();
  }
  given_up_ = in_flight_ > 0;
  return !given_up_;
}

void Stream::cancel_all() {
  for (const Transfer& transfer : transfers_) {
    if (transfer.in_flight) (void)libusb_cancel_transfer(transfer.request);
  }
}

void Stream::end(UsbStatus why) {
  if (!ending_) why_ = why;
  ending_ = true;
}

/// Clears the halt once no transfer is out, and sends all on their way again.
void Stream::recover() {
  const UsbStatus status = status_of(libusb_clear_halt(handle_, endpoint_));
  if (status != UsbStatus::ok) return end(status);
  halted_ = false;
  submit_idle();
}

void Stream::submit_idle() {
  for (Transfer& transfer : transfers_) {
    if (transfer.in_flight) continue;
    const UsbStatus status = submit(&transfer);
    if (status == UsbStatus::no_memory && in_flight_ > 0) break;  // the others go on
    if (status != UsbStatus::ok) return end(status);
  }
}

UsbStatus Stream::submit(Transfer* transfer) {
  const UsbStatus status = status_of(libusb_submit_transfer(transfer->request));
  transfer->in_flight = status == UsbStatus::ok;
  if (transfer->in_flight) ++in_flight_;
  return status;
}

void LIBUSB_CALL Stream::on_done(libusb_transfer* request) {
  auto* const stream = static_cast<Stream*>(request->user_data);
  const std::lock_guard<std::mutex> lock(stream->mutex_);
  if (stream->given_up_) return;
  stream->take_data(*request);
  stream->finish(request);
}

/// What a transfer has received is good however it ended, except when the device overran it.
void Stream::take_data(const libusb_transfer& request) {
  if (request.actual_length <= 0 || request.status == LIBUSB_TRANSFER_OVERFLOW) return;
  const auto size = static_cast<std::size_t>(request.actual_length);
  sink_->take({request.buffer, size});
  stats_.bytes += size;
  ++stats_.transfers;
  repeats_ = 0;
}

void Stream::finish(libusb_transfer* request) {
  const auto transfer = std::find_if(transfers_.begin(), transfers_.end(),
                                     [&](const Transfer& other) { return other.request == request; });
  transfer->in_flight = false;
  --in_flight_;
  switch (request->status) {
    case LIBUSB_TRANSFER_STALL:
      if (!halted_) count_repeat(UsbStatus::stall, &stats_.stalls);
      halted_ = true;
      cancel_all();  // on a halted endpoint they would wait for ever
      break;
    case LIBUSB_TRANSFER_OVERFLOW: count_repeat(UsbStatus::overflow, &stats_.overflows); break;
    case LIBUSB_TRANSFER_ERROR: count_repeat(UsbStatus::failed, &stats_.failures); break;
    case LIBUSB_TRANSFER_NO_DEVICE: end(UsbStatus::no_device); break;
    default: break;  // completed, timed out, cancelled
  }
  if (ending_ || halted_) return;
  const UsbStatus status = submit(&*transfer);
  if (status == UsbStatus::no_memory && in_flight_ > 0) return;
  if (status != UsbStatus::ok) end(status);
}

void Stream::count_repeat(UsbStatus why, std::uint64_t* counter) {
  ++*counter;
  if (++repeats_ > kMaxRepeats) end(why);
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
    return status_of(done);
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
  UsbStatus clear_halt(std::uint8_t endpoint) override { return status_of(libusb_clear_halt(handle_, endpoint)); }

  UsbStatus start_stream(const StreamOptions& options, StreamSink* sink) override {
    stop_stream();
    stream_ = std::make_unique<Stream>(context_.get(), handle_, options.endpoint, sink);
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
    return status_of(result);
  }

  std::shared_ptr<libusb_context> context_;
  libusb_device_handle* handle_;
  DeviceInfo info_;
  std::unique_ptr<Stream> stream_;
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
    if (count < 0) return status_of(static_cast<int>(count));
    for (auto i = decltype(count){0}; i < count; ++i) {
      if (visit(devices[i])) break;
    }
    libusb_free_device_list(devices, 1);
    return UsbStatus::ok;
  }

  UsbStatus open_device(libusb_device* device, std::unique_ptr<Transport>* transport) {
    libusb_device_handle* handle = nullptr;
    if (const int error = libusb_open(device, &handle); error != 0) return status_of(error);
    if (const int error = libusb_claim_interface(handle, kInterface); error != 0) {
      libusb_close(handle);
      return status_of(error);
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

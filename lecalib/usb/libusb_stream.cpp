// SPDX-License-Identifier: MIT
#include "lecalib/usb/libusb_stream.hpp"

#include <libusb.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace lecalib::usb {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kEnoughTransfers = 4;        // for one to be on its way while the others are handled
constexpr std::uint32_t kMinTransferBytes = 4096;  // four packets of SuperSpeed
constexpr int kMaxRepeats = 4;                     // halts or failures in a row, before a stream is given up
constexpr std::chrono::milliseconds kDrainTime{1000};
constexpr timeval kPoll = {0, 50'000};

void LIBUSB_CALL give_back(libusb_transfer* request) {
  static_cast<LibusbStream*>(request->user_data)->on_done(request);
}

}  // namespace

UsbStatus libusb_status(int result) noexcept {
  switch (result) {
    case LIBUSB_ERROR_TIMEOUT: return UsbStatus::timeout;
    case LIBUSB_ERROR_PIPE: return UsbStatus::stall;
    case LIBUSB_ERROR_OVERFLOW: return UsbStatus::overflow;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND: return UsbStatus::no_device;
    case LIBUSB_ERROR_ACCESS: return UsbStatus::access_denied;
    case LIBUSB_ERROR_BUSY: return UsbStatus::busy;
    case LIBUSB_ERROR_NO_MEM: return UsbStatus::no_memory;
    default: return result < 0 ? UsbStatus::failed : UsbStatus::ok;
  }
}

StreamStats LibusbStream::stats() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  StreamStats stats = stats_;
  stats.in_flight = static_cast<std::uint32_t>(in_flight_);
  return stats;
}

bool LibusbStream::allocate(std::uint32_t count, std::uint32_t bytes) {
  free_transfers();
  for (std::uint32_t i = 0; i < count; ++i) {
    Transfer transfer{libusb_alloc_transfer(0), std::unique_ptr<unsigned char[]>(new unsigned char[bytes])};
    if (transfer.request == nullptr) return false;
    libusb_fill_bulk_transfer(transfer.request, handle_, endpoint_, transfer.bytes.get(), static_cast<int>(bytes),
                              &give_back, this, 0);
    transfers_.push_back(std::move(transfer));
  }
  stats_.transfer_bytes = bytes;
  return true;
}

void LibusbStream::free_transfers() {
  for (const Transfer& transfer : transfers_) libusb_free_transfer(transfer.request);
  transfers_.clear();
}

UsbStatus LibusbStream::start(const StreamOptions& options) {
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
  thread_ = std::thread(&LibusbStream::run, this);
  return UsbStatus::ok;
}

bool LibusbStream::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    end(UsbStatus::ok);
  }
  libusb_interrupt_event_handler(context_);
  if (thread_.joinable()) thread_.join();
  return drained_;
}

void LibusbStream::run() {
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
bool LibusbStream::drain() {
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

void LibusbStream::cancel_all() {
  for (const Transfer& transfer : transfers_) {
    if (transfer.in_flight) (void)libusb_cancel_transfer(transfer.request);
  }
}

void LibusbStream::end(UsbStatus why) {
  if (!ending_) why_ = why;
  ending_ = true;
}

/// Clears the halt once no transfer is out, and sends all on their way again.
void LibusbStream::recover() {
  const UsbStatus status = libusb_status(libusb_clear_halt(handle_, endpoint_));
  if (status != UsbStatus::ok) return end(status);
  halted_ = false;
  submit_idle();
}

void LibusbStream::submit_idle() {
  for (Transfer& transfer : transfers_) {
    if (transfer.in_flight) continue;
    const UsbStatus status = submit(&transfer);
    if (status == UsbStatus::no_memory && in_flight_ > 0) break;  // the others go on
    if (status != UsbStatus::ok) return end(status);
  }
}

UsbStatus LibusbStream::submit(Transfer* transfer) {
  const UsbStatus status = libusb_status(libusb_submit_transfer(transfer->request));
  transfer->in_flight = status == UsbStatus::ok;
  if (transfer->in_flight) ++in_flight_;
  return status;
}

void LibusbStream::on_done(libusb_transfer* request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (given_up_) return;
  take_data(*request);
  finish(request);
}

/// What a transfer has received is good however it ended, except when the device overran it.
void LibusbStream::take_data(const libusb_transfer& request) {
  if (request.actual_length <= 0 || request.status == LIBUSB_TRANSFER_OVERFLOW) return;
  const auto size = static_cast<std::size_t>(request.actual_length);
  sink_->take({request.buffer, size});
  stats_.bytes += size;
  ++stats_.transfers;
  repeats_ = 0;
}

void LibusbStream::finish(libusb_transfer* request) {
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

void LibusbStream::count_repeat(UsbStatus why, std::uint64_t* counter) {
  ++*counter;
  if (++repeats_ > kMaxRepeats) end(why);
}

}  // namespace lecalib::usb

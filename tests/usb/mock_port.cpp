// SPDX-License-Identifier: MIT
#include "usb/mock_port.hpp"

#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "support/fake_descriptors.hpp"

namespace lecalib::test {
namespace {

constexpr std::uint8_t kCommandOut = 0x02;
constexpr std::uint8_t kCommandIn = 0x82;
constexpr guint kHoldMs = 1;
constexpr std::size_t kMaxDone = 3;  // transfers that wait to be fetched
constexpr std::size_t kSetupBytes = 8;

std::string three_digits(unsigned number) {
  const std::string digits = std::to_string(number);
  return std::string(3 - digits.size(), '0') + digits;
}

std::string hex(const DeviceBytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += "0123456789ABCDEF"[byte >> 4];
    text += "0123456789ABCDEF"[byte & 15];
  }
  return text;
}

void check(GError* error) {
  if (error != nullptr) throw std::runtime_error(error->message);
}

}  // namespace

MockPort::MockPort(UMockdevTestbed* bed, std::shared_ptr<FakeDevice> device, System system)
    : bed_(bed), base_(umockdev_ioctl_base_new()), device_(std::move(device)), system_(system) {
  g_signal_connect(base_, "handle-ioctl", G_CALLBACK(&MockPort::on_ioctl), this);
}

MockPort::~MockPort() {
  forget_all();
  (void)umockdev_testbed_detach_ioctl(bed_, node().c_str(), nullptr);
  g_object_unref(base_);
}

std::string MockPort::node() const {
  return "/dev/bus/usb/" + three_digits(device_->info.bus) + "/" + three_digits(device_->info.address);
}

void MockPort::plug_in() {
  const usb::DeviceInfo& info = device_->info;
  const std::string bus = three_digits(info.bus);
  const std::string address = three_digits(info.address);
  sys_path_ = "/sys/devices/pci0000:00/usb" + std::to_string(info.bus) + "/1-" + std::to_string(info.address);
  const std::string text = "P: " + sys_path_.substr(4) + "\nN: bus/usb/" + bus + "/" + address +
                           "\nE: DEVNAME=" + node() + "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: BUSNUM=" + bus +
                           "\nE: DEVNUM=" + address + "\nA: busnum=" + std::to_string(info.bus) +
                           "\\n\nA: devnum=" + std::to_string(info.address) +
                           "\\n\nA: speed=" + std::to_string(info.speed_mbit) +
                           "\\n\nA: bConfigurationValue=1\\n\nH: descriptors=" + hex(device_descriptor(info)) +
                           hex(configuration_descriptor(info)) + "\n";
  GError* error = nullptr;
  (void)umockdev_testbed_add_from_string(bed_, text.c_str(), &error);
  check(error);
  (void)umockdev_testbed_attach_ioctl(bed_, node().c_str(), base_, &error);
  check(error);
  if (!system_.is_private) return;
  char* const root = umockdev_testbed_get_root_dir(bed_);
  (void)::chmod((root + node()).c_str(), 0600);
  (void)::chmod((root + ("/ioctl/" + node())).c_str(), 0666);  // umockdev asks there first
  g_free(root);
}

void MockPort::remove() {
  umockdev_testbed_uevent(bed_, sys_path_.c_str(), "remove");
  umockdev_testbed_remove_device(bed_, sys_path_.c_str());
}

void MockPort::replug() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    forget_all();
    unplugged_ = false;
    ++device_->info.address;
    device_->replug();
  }
  plug_in();
}

bool MockPort::is_unplugged() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return unplugged_;
}

std::uint64_t MockPort::sent() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return device_->stream.sent();
}

std::size_t MockPort::pending() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stream_.size() + answers_.size() + done_.size();
}

gboolean MockPort::on_ioctl(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer port) {
  auto* const self = static_cast<MockPort*>(port);
  const std::lock_guard<std::mutex> lock(self->mutex_);
  self->handle(client);
  return TRUE;
}

void MockPort::handle(UMockdevIoctlClient* client) {
  UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
  const gulong request = umockdev_ioctl_client_get_request(client);
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof address);
  // Whoever has opened it where it was before asks something that is gone.
  const bool is_gone = unplugged_ || node() != umockdev_ioctl_client_get_devnode(client);
  int error = is_gone ? ENODEV : 0;
  switch (request) {
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      if (!is_gone || unplugged_) return reap(client, argument);
      break;
    case USBDEVFS_DISCARDURB: error = discard(address); break;
    case USBDEVFS_SUBMITURB:
      if (error == 0) error = submit(argument, address);
      break;
    case USBDEVFS_GET_CAPABILITIES: {
      UMockdevIoctlData* const out = umockdev_ioctl_data_resolve(argument, 0, sizeof(std::uint32_t), nullptr);
      std::uint32_t capabilities =
          USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      if (system_.has_scatter_gather)
        capabilities |= USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_NO_PACKET_SIZE_LIM;
      std::memcpy(out->data, &capabilities, sizeof capabilities);
      g_object_unref(out);
      break;
    }
    case USBDEVFS_CLAIMINTERFACE:
      if (error == 0 && system_.is_busy) error = EBUSY;
      break;
    case USBDEVFS_CLEAR_HALT:
      device_->stream.clear_halt();
      is_halted_ = false;
      break;
    case USBDEVFS_GETDRIVER: error = ENODATA; break;
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_RESET: break;
    default: error = ENOTTY; break;
  }
  umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
}

/// @return errno
int MockPort::submit(UMockdevIoctlData* argument, gulong address) {
  UMockdevIoctlData* const block = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
  if (block == nullptr) return EFAULT;  // the program was killed meanwhile
  const auto& fields = *reinterpret_cast<usbdevfs_urb*>(block->data);
  const auto size = static_cast<std::size_t>(fields.buffer_length);
  const bool is_stream = fields.type == USBDEVFS_URB_TYPE_BULK && fields.endpoint == device_->data_endpoint();
  if (is_stream && stream_bytes_ + size > system_.max_bytes) {
    g_object_unref(block);
    return ENOMEM;
  }
  UMockdevIoctlData* const buffer = umockdev_ioctl_data_resolve(block, offsetof(usbdevfs_urb, buffer), size, nullptr);
  if (buffer == nullptr) {
    g_object_unref(block);
    return EFAULT;
  }
  g_object_unref(buffer);  // the block keeps it
  const Urb urb{block, buffer, address};
  if (is_stream) {
    stream_bytes_ += size;
    stream_.push_back(urb);
  } else if (fields.type == USBDEVFS_URB_TYPE_CONTROL) {
    answer_control(urb);
  } else if (fields.endpoint == kCommandOut) {
    answer_command(urb);
  } else if (fields.endpoint == kCommandIn) {
    answers_.push_back(urb);
  } else {
    g_object_unref(block);
    return ENOENT;
  }
  return 0;
}

void MockPort::answer_control(const Urb& urb) {
  const std::uint8_t* const setup = urb.buffer->data;
  const auto word = [&](std::size_t at) { return static_cast<std::uint16_t>(setup[at] | setup[at + 1] << 8); };
  const usb::ControlRequest request{setup[0], setup[1], word(2), word(4)};
  const std::size_t room = static_cast<std::size_t>(urb.fields().buffer_length) - kSetupBytes;
  const bool is_descriptor = request.type == 0x80 && request.request == 6;
  const auto answer = is_descriptor
                          ? descriptor(device_->info, request.value)
                          : device_->control(request, DeviceBytes(setup + kSetupBytes, setup + kSetupBytes + room));
  if (!answer) return finish(urb, -EPIPE, 0);
  if ((request.type & usb::kDeviceAnswers) == 0) return finish(urb, 0, room);
  const std::size_t size = std::min(room, answer->size());
  std::copy_n(answer->begin(), size, urb.buffer->data + kSetupBytes);
  finish(urb, 0, size);
}

void MockPort::answer_command(const Urb& urb) {
  const auto size = static_cast<std::size_t>(urb.fields().buffer_length);
  const bool taken = device_->command(DeviceBytes(urb.buffer->data, urb.buffer->data + size));
  finish(urb, taken ? 0 : -EPIPE, taken ? size : 0);
  if (!device_->plugged_in) unplug();
}

int MockPort::discard(gulong address) {
  for (std::deque<Urb>* queue : {&stream_, &answers_}) {
    const auto urb =
        std::find_if(queue->begin(), queue->end(), [&](const Urb& other) { return other.address == address; });
    if (urb == queue->end()) continue;
    if (queue == &stream_) stream_bytes_ -= static_cast<std::size_t>(urb->fields().buffer_length);
    const Urb found = *urb;
    queue->erase(urb);
    finish(found, -ENOENT, 0);
    return 0;
  }
  return EINVAL;
}

void MockPort::finish(const Urb& urb, int status, std::size_t size) {
  urb.fields().status = status;
  urb.fields().actual_length = static_cast<int>(size);
  done_.push_back(urb);
}

void MockPort::finish_all(int status) {
  for (std::deque<Urb>* queue : {&stream_, &answers_}) {
    for (const Urb& urb : *queue) finish(urb, status, 0);
    queue->clear();
  }
  stream_bytes_ = 0;
}

void MockPort::unplug() {
  unplugged_ = true;
  device_->plugged_in = false;
  finish_all(-ESHUTDOWN);
}

/// What a program has not fetched from a device that is gone.
void MockPort::forget_all() {
  finish_all(-ESHUTDOWN);
  for (const Urb& urb : done_) g_object_unref(urb.block);
  done_.clear();
}

void MockPort::pump() {
  while (!answers_.empty() && !device_->answers.empty()) {
    const Urb urb = answers_.front();
    answers_.pop_front();
    const DeviceBytes answer = device_->answers.front();
    device_->answers.pop_front();
    const std::size_t size = std::min(answer.size(), static_cast<std::size_t>(urb.fields().buffer_length));
    std::copy_n(answer.begin(), size, urb.buffer->data);
    finish(urb, size < answer.size() ? -EOVERFLOW : 0, size);
  }
  if (device_->is_streaming()) pump_stream();
}

void MockPort::pump_stream() {
  DeviceBytes bytes;
  while (!stream_.empty() && done_.size() < kMaxDone) {
    const Urb urb = stream_.front();
    const auto room = static_cast<std::size_t>(urb.fields().buffer_length);
    const FakeStream::What what = device_->stream.next(room, &bytes);
    if (what == FakeStream::What::unplug) return unplug();
    const bool is_waiting = what == FakeStream::What::nothing || (what == FakeStream::What::stall && is_halted_);
    if (is_waiting) return;
    stream_.pop_front();
    stream_bytes_ -= room;
    switch (what) {
      case FakeStream::What::stall: finish(urb, -EPIPE, 0); break;
      case FakeStream::What::overflow: finish(urb, -EOVERFLOW, 0); break;
      case FakeStream::What::failure: finish(urb, -EPROTO, 0); break;
      default: std::copy(bytes.begin(), bytes.end(), urb.buffer->data); finish(urb, 0, bytes.size());
    }
    is_halted_ = what == FakeStream::What::stall;
  }
}

void MockPort::reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  UMockdevIoctlData* const out = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
  if (out == nullptr) return umockdev_ioctl_client_complete(client, -1, EFAULT);
  if (try_reap(client, out)) {
    g_object_unref(out);
  } else if (unplugged_) {
    umockdev_ioctl_client_complete(client, -1, ENODEV);
    g_object_unref(out);
  } else {
    held_ = static_cast<UMockdevIoctlClient*>(g_object_ref(client));
    held_argument_ = out;
    GSource* const timer = g_timeout_source_new(kHoldMs);
    g_source_set_callback(timer, &MockPort::on_hold_over, this, nullptr);
    g_source_attach(timer, g_main_context_get_thread_default());
    g_source_unref(timer);
  }
}

gboolean MockPort::on_hold_over(gpointer port) {
  auto* const self = static_cast<MockPort*>(port);
  const std::lock_guard<std::mutex> lock(self->mutex_);
  UMockdevIoctlClient* const client = std::exchange(self->held_, nullptr);
  UMockdevIoctlData* const argument = std::exchange(self->held_argument_, nullptr);
  if (!self->try_reap(client, argument)) {
    umockdev_ioctl_client_complete(client, -1, self->unplugged_ ? ENODEV : EAGAIN);
  }
  g_object_unref(argument);
  g_object_unref(client);
  return G_SOURCE_REMOVE;
}

bool MockPort::try_reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  if (!unplugged_) pump();
  if (done_.empty()) return false;
  const Urb urb = done_.front();
  done_.pop_front();
  (void)umockdev_ioctl_data_set_ptr(argument, 0, urb.block);
  g_object_unref(urb.block);
  umockdev_ioctl_client_complete(client, 0, 0);
  return true;
}

}  // namespace lecalib::test

// SPDX-License-Identifier: MIT
/// A USB port for QEMU: plays a fake EVK4 that sends a recording to the machine behind a socket (usbredir).
///     redir_port SOCKET RECORDING.raw MEGABYTES_PER_S
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <usbredirparser.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <iterator>
#include <string>

#include "support/fake_descriptors.hpp"
#include "support/fake_evk4.hpp"

namespace {

using namespace lecalib::test;
namespace usb = lecalib::usb;

constexpr std::uint8_t kCommandIn = 0x82;
constexpr std::size_t kMaxWaiting = std::size_t{4} << 20;  // bytes on their way to the machine

struct Request {
  std::uint64_t id;
  usb_redir_bulk_packet_header header;
};

FakeEvk4 camera;
usbredirparser* parser = nullptr;
int machine = -1;
std::deque<Request> stream, answers;

int receive(void* /*port*/, std::uint8_t* data, int size) {
  const ssize_t count = ::recv(machine, data, static_cast<std::size_t>(size), MSG_DONTWAIT);
  if (count == 0) std::exit(0);
  return count > 0 ? static_cast<int>(count) : (errno == EAGAIN ? 0 : -1);
}

int send(void* /*port*/, std::uint8_t* data, int size) {
  const ssize_t count = ::send(machine, data, static_cast<std::size_t>(size), MSG_NOSIGNAL | MSG_DONTWAIT);
  return count >= 0 ? static_cast<int>(count) : (errno == EAGAIN ? 0 : -1);
}

void log(void* /*port*/, int level, const char* message) {
  if (level <= usbredirparser_warning) std::fprintf(stderr, "redir_port: %s\n", message);
}

void say_hello(void* /*port*/, usb_redir_hello_header* /*hello*/) {
  usb_redir_ep_info_header endpoints{};
  std::fill(std::begin(endpoints.type), std::end(endpoints.type), usb_redir_type_invalid);
  for (const int control : {0, 16}) {
    endpoints.type[control] = usb_redir_type_control;
    endpoints.max_packet_size[control] = 512;
  }
  for (const std::uint8_t address : camera.info.bulk_endpoints) {
    const int at = (address & 15) + ((address & usb::kDeviceAnswers) != 0 ? 16 : 0);
    endpoints.type[at] = usb_redir_type_bulk;
    endpoints.max_packet_size[at] = 1024;
  }
  usbredirparser_send_ep_info(parser, &endpoints);
  usb_redir_interface_info_header interfaces{};
  interfaces.interface_count = 1;
  interfaces.interface_class[0] = 0xFF;
  interfaces.interface_subclass[0] = 0x19;
  usbredirparser_send_interface_info(parser, &interfaces);
  usb_redir_device_connect_header connect{};
  connect.speed = usb_redir_speed_super;
  connect.vendor_id = camera.info.vendor;
  connect.product_id = camera.info.product;
  connect.device_version_bcd = camera.info.release;
  usbredirparser_send_device_connect(parser, &connect);
}

void set_configuration(void* /*port*/, std::uint64_t id, usb_redir_set_configuration_header* wanted) {
  usb_redir_configuration_status_header status{usb_redir_success, wanted->configuration};
  usbredirparser_send_configuration_status(parser, id, &status);
}

void set_alternate(void* /*port*/, std::uint64_t id, usb_redir_set_alt_setting_header* wanted) {
  usb_redir_alt_setting_status_header status{usb_redir_success, wanted->interface, wanted->alt};
  usbredirparser_send_alt_setting_status(parser, id, &status);
}

void take_control(void* /*port*/, std::uint64_t id, usb_redir_control_packet_header* header, std::uint8_t* data,
                  int size) {
  const usb::ControlRequest request{header->requesttype, header->request, header->value, header->index};
  const bool is_answered = (request.type & usb::kDeviceAnswers) != 0;
  std::optional<DeviceBytes> answer = DeviceBytes();
  if (request.type == 0x80 && request.request == 6) {
    answer = descriptor(camera.info, request.value);
  } else if (request.type == 0x80) {
    answer = DeviceBytes{0, 0};  // GET_STATUS
  } else if ((request.type & 0x60) != 0) {
    answer = camera.control(request, DeviceBytes(data, data + size));
  } else if (request.request == 1) {
    camera.stream.clear_halt();  // CLEAR_FEATURE
  }
  usb_redir_control_packet_header reply = *header;
  reply.status = answer ? usb_redir_success : usb_redir_stall;
  const std::size_t count = answer && is_answered ? std::min<std::size_t>(answer->size(), header->length) : 0;
  if (is_answered || !answer) reply.length = static_cast<std::uint16_t>(count);
  usbredirparser_send_control_packet(parser, id, &reply, count > 0 ? answer->data() : nullptr, static_cast<int>(count));
  usbredirparser_free_packet_data(parser, data);
}

void reply_bulk(const Request& request, std::uint8_t status, DeviceBytes bytes) {
  usb_redir_bulk_packet_header header = request.header;
  header.status = status;
  header.length = static_cast<std::uint16_t>(bytes.size());
  header.length_high = static_cast<std::uint16_t>(bytes.size() >> 16);
  usbredirparser_send_bulk_packet(parser, request.id, &header, bytes.data(), static_cast<int>(bytes.size()));
}

void take_bulk(void* /*port*/, std::uint64_t id, usb_redir_bulk_packet_header* header, std::uint8_t* data, int size) {
  if (header->endpoint == camera.data_endpoint()) {
    stream.push_back({id, *header});
  } else if (header->endpoint == kCommandIn) {
    answers.push_back({id, *header});
  } else {
    usb_redir_bulk_packet_header reply = *header;
    reply.status = camera.command(DeviceBytes(data, data + size)) ? usb_redir_success : usb_redir_stall;
    usbredirparser_send_bulk_packet(parser, id, &reply, nullptr, 0);
  }
  usbredirparser_free_packet_data(parser, data);
}

void cancel(void* /*port*/, std::uint64_t id) {
  for (std::deque<Request>* queue : {&stream, &answers}) {
    const auto at =
        std::find_if(queue->begin(), queue->end(), [&](const Request& request) { return request.id == id; });
    if (at == queue->end()) continue;
    reply_bulk(*at, usb_redir_cancelled, {});
    queue->erase(at);
  }
}

void reset(void* /*port*/) {
  stream.clear();
  answers.clear();
}

void pump() {
  for (; !answers.empty() && !camera.answers.empty(); answers.pop_front(), camera.answers.pop_front()) {
    reply_bulk(answers.front(), usb_redir_success, camera.answers.front());
  }
  DeviceBytes bytes;
  while (camera.is_streaming() && !stream.empty() && usbredirparser_get_bufferered_output_size(parser) < kMaxWaiting) {
    const usb_redir_bulk_packet_header& header = stream.front().header;
    const std::size_t room = header.length | std::size_t{header.length_high} << 16;
    if (camera.stream.next(room, &bytes) != FakeStream::What::data) break;
    reply_bulk(stream.front(), usb_redir_success, bytes);
    stream.pop_front();
  }
}

/// The words of a recording, without its header.
DeviceBytes words_of(const char* path) {
  std::ifstream file(path, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::string end = "% end\n";
  const std::size_t at = all.find(end);
  if (at == std::string::npos) std::exit(2);
  return DeviceBytes(all.begin() + static_cast<std::ptrdiff_t>(at + end.size()), all.end());
}

int accept_machine(const char* path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path, sizeof address.sun_path - 1);
  ::unlink(path);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) std::exit(2);
  ::listen(listener, 1);
  return ::accept(listener, nullptr, nullptr);
}

usbredirparser* make_parser() {
  usbredirparser* const made = usbredirparser_create();
  made->log_func = &log;
  made->read_func = &receive;
  made->write_func = &send;
  made->hello_func = &say_hello;
  made->set_configuration_func = &set_configuration;
  made->set_alt_setting_func = &set_alternate;
  made->control_packet_func = &take_control;
  made->bulk_packet_func = &take_bulk;
  made->cancel_data_packet_func = &cancel;
  made->reset_func = &reset;
  std::uint32_t capabilities[USB_REDIR_CAPS_SIZE] = {};
  for (const int capability : {usb_redir_cap_connect_device_version, usb_redir_cap_ep_info_max_packet_size,
                               usb_redir_cap_64bits_ids, usb_redir_cap_32bits_bulk_length}) {
    usbredirparser_caps_set_cap(capabilities, capability);
  }
  usbredirparser_init(made, "fake camera", capabilities, USB_REDIR_CAPS_SIZE, usbredirparser_fl_usb_host);
  return made;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  camera.stream.recording = words_of(argv[2]);
  camera.stream.bytes_per_s = 1e6 * std::strtod(argv[3], nullptr);
  machine = accept_machine(argv[1]);
  parser = make_parser();
  while (true) {
    pump();
    const bool has_output = usbredirparser_has_data_to_write(parser) != 0;
    pollfd wait{machine, static_cast<short>(POLLIN | (has_output ? POLLOUT : 0)), 0};
    (void)::poll(&wait, 1, stream.empty() ? 1000 : 1);
    if ((wait.revents & (POLLERR | POLLHUP)) != 0) return 0;
    if ((wait.revents & POLLIN) != 0) usbredirparser_do_read(parser);
    if (usbredirparser_has_data_to_write(parser) != 0) usbredirparser_do_write(parser);
  }
}

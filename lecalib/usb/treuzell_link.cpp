// SPDX-License-Identifier: MIT
#include "lecalib/usb/treuzell_link.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>

namespace lecalib::usb {
namespace {

constexpr std::uint32_t kSensorDevice = 0;  // number of the device that registers belong to
constexpr std::size_t kMaxAnswerBytes = 1024;
constexpr unsigned kAnswerTimeoutMs = 1000;
constexpr int kMaxStale = 4;  // answers to requests that were given up

void put(std::uint32_t word, std::vector<std::uint8_t>* bytes) {
  for (unsigned i = 0; i < 4; ++i) bytes->push_back(static_cast<std::uint8_t>(word >> (8 * i)));
}

/// The words of a frame. A rest of less than a word counts as one, filled up by zeros.
std::vector<std::uint32_t> words_of(Span<const std::uint8_t> bytes) {
  std::vector<std::uint32_t> words((bytes.size() + 3) / 4);
  for (std::size_t i = 0; i < bytes.size(); ++i) words[i / 4] |= std::uint32_t{bytes[i]} << (8 * (i % 4));
  return words;
}

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%04" PRIX32, value);
  return text;
}

/// What a request is about, for a message.
std::string subject(std::uint32_t property, const std::vector<std::uint32_t>& payload) {
  const bool is_register = (property & ~TreuzellLink::kWrite) == TreuzellLink::kRegisters && payload.size() > 1;
  return is_register ? "register " + hex(payload[1]) : "property " + hex(property);
}

host::Error failure(std::uint32_t property, const std::vector<std::uint32_t>& payload, const std::string& why) {
  return {subject(property, payload) + ": " + why, {}, 0, 0, {}, Status::io_error};
}

/// Whether an answer belongs to a request: it repeats the property and, of registers, device and address.
bool belongs(const std::vector<std::uint32_t>& answer, std::uint32_t property,
             const std::vector<std::uint32_t>& payload) {
  if (answer[0] == TreuzellLink::kFailed) return true;
  if ((answer[0] & ~TreuzellLink::kFailed) != property) return false;
  if (answer[0] != property || (property & ~TreuzellLink::kWrite) != TreuzellLink::kRegisters) return true;
  return answer.size() >= 4 && std::equal(payload.begin(), payload.begin() + 2, answer.begin() + 2);
}

}  // namespace

TreuzellLink::TreuzellLink(Transport* transport) : transport_(transport) {
  const std::vector<std::uint8_t>& found = transport->info().bulk_endpoints;
  const auto is_in = [&](std::size_t i) { return (found[i] & kDeviceAnswers) != 0; };
  if (found.size() != 3 || !is_in(0) || is_in(1) || !is_in(2)) return;
  command_in_ = found[0];
  command_out_ = found[1];
  data_in_ = found[2];
}

host::Result<std::uint8_t> TreuzellLink::system_id() {
  std::uint8_t answer[2] = {};
  std::size_t count = 0;
  const UsbStatus status = transport_->control({0xC0, 0x72, 0, 0}, answer, &count);
  if (status != UsbStatus::ok || count == 0) {
    return host::Error{std::string("system id: ") + to_string(status), {}, 0, 0, {}, Status::io_error};
  }
  return answer[0];
}

host::Result<std::vector<std::uint32_t>> TreuzellLink::ask(std::uint32_t property,
                                                           const std::vector<std::uint32_t>& payload) {
  std::vector<std::uint8_t> request;
  put(property, &request);
  put(static_cast<std::uint32_t>(4 * payload.size()), &request);
  for (const std::uint32_t word : payload) put(word, &request);
  const UsbStatus status = transport_->write(command_out_, request);
  if (status == UsbStatus::stall) (void)transport_->clear_halt(command_out_);
  if (status != UsbStatus::ok) return failure(property, payload, to_string(status));
  return take_answer(property, payload);
}

host::Result<std::vector<std::uint32_t>> TreuzellLink::take_answer(std::uint32_t property,
                                                                   const std::vector<std::uint32_t>& payload) {
  for (int stale = 0; stale <= kMaxStale; ++stale) {
    std::uint8_t bytes[kMaxAnswerBytes];
    std::size_t count = 0;
    const UsbStatus status = transport_->read(command_in_, bytes, kAnswerTimeoutMs, &count);
    if (status == UsbStatus::stall) (void)transport_->clear_halt(command_in_);
    if (status != UsbStatus::ok) return failure(property, payload, to_string(status));
    const std::vector<std::uint32_t> words = words_of(Span<const std::uint8_t>(bytes, count));
    if (words.size() < 2 || !belongs(words, property, payload)) continue;
    if (words[0] == kFailed) return failure(property, payload, "the camera does not know it");
    if ((words[0] & kFailed) != 0) {
      const std::string code = words.size() > 3 ? " (error " + std::to_string(words[3]) + ")" : "";
      return failure(property, payload, "the camera refused" + code);
    }
    return std::vector<std::uint32_t>(words.begin() + 2, words.end());
  }
  return failure(property, payload, "the camera answers to something else");
}

host::Result<std::uint32_t> TreuzellLink::read_register(std::uint32_t address) {
  const auto answer = ask(kRegisters, {kSensorDevice, address, 1});
  if (!answer.ok()) return answer.error();
  if (answer.value().size() < 3)
    return failure(kRegisters, {kSensorDevice, address}, "the camera's answer is too short");
  return answer.value()[2];
}

host::MaybeError TreuzellLink::write_register(std::uint32_t address, std::uint32_t value) {
  const auto answer = ask(kRegisters | kWrite, {kSensorDevice, address, value});
  if (!answer.ok()) return answer.error();
  return std::nullopt;
}

}  // namespace lecalib::usb

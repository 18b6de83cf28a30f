// SPDX-License-Identifier: MIT
#include "lecalib/usb/fx3_link.hpp"

#include <string>

namespace lecalib::usb {
namespace {

constexpr std::uint8_t kToDevice = 0x40;  // a vendor's request
constexpr std::uint8_t kFromDevice = kToDevice | kDeviceAnswers;
constexpr std::uint8_t kParameter = 0xBF;
constexpr std::size_t kValueBytes = 4;

host::Error failure(Fx3Parameter parameter, const std::string& why) {
  const std::string name = std::to_string(parameter.module) + "." + std::to_string(parameter.number);
  return {"parameter " + name + ": " + why, {}, 0, 0, {}, Status::io_error};
}

}  // namespace

host::Result<std::uint32_t> Fx3Link::read(Fx3Parameter parameter) {
  std::uint8_t bytes[kValueBytes] = {};
  std::size_t count = 0;
  const UsbStatus status =
      transport_->control({kFromDevice, kParameter, parameter.module, parameter.number}, bytes, &count);
  if (status == UsbStatus::stall) return failure(parameter, "the camera does not know it");
  if (status != UsbStatus::ok) return failure(parameter, to_string(status));
  if (count != kValueBytes) return failure(parameter, "the camera's answer is too short");
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8U | byte;
  return value;
}

host::MaybeError Fx3Link::write(Fx3Parameter parameter, std::uint32_t value) {
  std::uint8_t bytes[kValueBytes];
  for (std::size_t i = 0; i < kValueBytes; ++i) {
    bytes[i] = static_cast<std::uint8_t>(value >> (8 * (kValueBytes - 1 - i)));
  }
  std::size_t count = 0;
  const UsbStatus status =
      transport_->control({kToDevice, kParameter, parameter.module, parameter.number}, bytes, &count);
  if (status == UsbStatus::stall) return failure(parameter, "the camera refused");
  if (status != UsbStatus::ok) return failure(parameter, to_string(status));
  if (count != kValueBytes) return failure(parameter, "not all of it went over");
  return std::nullopt;
}

}  // namespace lecalib::usb

// SPDX-License-Identifier: MIT
/// What a fake device says of itself when it is plugged in.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "support/fake_device.hpp"

namespace lecalib::test {

namespace detail {

inline std::uint8_t low(unsigned value) { return static_cast<std::uint8_t>(value); }
inline std::uint8_t high(unsigned value) { return static_cast<std::uint8_t>(value >> 8); }

inline DeviceBytes text_descriptor(const std::string& text) {
  DeviceBytes bytes = {low(static_cast<unsigned>(2 + 2 * text.size())), 3};
  for (const char c : text) {
    bytes.push_back(static_cast<std::uint8_t>(c));
    bytes.push_back(0);
  }
  return bytes;
}

}  // namespace detail

/// SuperSpeed; string 2 is the product, 3 the serial number.
inline DeviceBytes device_descriptor(const usb::DeviceInfo& info) {
  using detail::high;
  using detail::low;
  const std::uint8_t serial = info.serial.empty() ? 0 : 3;
  const DeviceBytes ids = {low(info.vendor),   high(info.vendor), low(info.product),
                           high(info.product), low(info.release), high(info.release)};
  DeviceBytes bytes = {18, 1, 0, 3, 0, 0, 0, 9};
  bytes.insert(bytes.end(), ids.begin(), ids.end());
  const DeviceBytes strings = {0, 2, serial, 1};
  bytes.insert(bytes.end(), strings.begin(), strings.end());
  return bytes;
}

/// One interface of the vendor's own class with bulk endpoints.
inline DeviceBytes configuration_descriptor(const usb::DeviceInfo& info) {
  using detail::high;
  using detail::low;
  DeviceBytes bytes = {9, 4, 0, 0, low(static_cast<unsigned>(info.bulk_endpoints.size())), 0xFF, 0x19, 0, 0};
  for (const std::uint8_t endpoint : info.bulk_endpoints) {
    const DeviceBytes pair = {7, 5, endpoint, 2, 0, 4, 0, 6, 0x30, 15, 0, 0, 0};
    bytes.insert(bytes.end(), pair.begin(), pair.end());
  }
  const auto total = static_cast<unsigned>(9 + bytes.size());
  const DeviceBytes head = {9, 2, low(total), high(total), 1, 1, 0, 0x80, 100};
  bytes.insert(bytes.begin(), head.begin(), head.end());
  return bytes;
}

/// The answer to GET_DESCRIPTOR; nothing: there is none. @param value of the request: kind and index
inline std::optional<DeviceBytes> descriptor(const usb::DeviceInfo& info, std::uint16_t value) {
  switch (value) {
    case 0x0100: return device_descriptor(info);
    case 0x0200: return configuration_descriptor(info);
    case 0x0300: return DeviceBytes{4, 3, 0x09, 0x04};  // the languages: English
    case 0x0302: return detail::text_descriptor(info.product_name);
    case 0x0303: return detail::text_descriptor(info.serial);
    case 0x0F00: {  // what SuperSpeed devices must say of themselves
      const DeviceBytes capabilities = {5, 15, 22, 0, 2, 7, 16, 2, 2, 0, 0, 0, 10, 16, 3, 0, 14, 0, 1, 10, 255, 7};
      return capabilities;
    }
    default: return std::nullopt;
  }
}

}  // namespace lecalib::test

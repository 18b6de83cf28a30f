// SPDX-License-Identifier: MIT
/// A Prophesee EVK4 with its IMX636: Treuzell frames, registers, and data once its registers say so.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/fake_device.hpp"

namespace lecalib::test {

class FakeEvk4 : public FakeDevice {
 public:
  std::uint8_t system_id = 0x31;
  std::uint32_t firmware = 0x030900;  ///< 3.9.0
  std::uint64_t serial = 0x00050423;
  std::uint32_t chip_id = 0xA0401806;
  std::uint32_t refused_register = 0xFFFFFFFF;     ///< writes to it fail with errno 5
  std::uint32_t unplugging_register = 0xFFFFFFFF;  ///< with a write to it the device is gone
  std::uint32_t mute_property = 0xFFFFFFFF;        ///< requests of it are not answered
  bool answers_twice = false;                      ///< each answer comes with a stale copy of the one before
  std::map<std::uint32_t, std::uint32_t> registers;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> writes;  ///< in order

  FakeEvk4() {
    info.vendor = 0x04B4;
    info.product = 0x00F5;
    info.release = 0x0309;
    info.bus = 1;
    info.address = 2;
    info.speed_mbit = 5000;
    info.bulk_endpoints = {0x82, 0x02, 0x81};
    info.product_name = "EVK4";
    reset();
  }

  std::optional<DeviceBytes> control(const usb::ControlRequest& request, const DeviceBytes& /*data*/) override {
    if (request.type != 0xC0 || request.request != 0x72) return std::nullopt;
    return DeviceBytes{system_id, 0};
  }

  bool command(const DeviceBytes& bytes) override {
    if (bytes.size() < 8 || word(bytes, 4) != bytes.size() - 8) return false;
    const std::uint32_t property = word(bytes, 0);
    if (property == mute_property) return true;
    if (answers_twice) answers.push_back(last_answer_);
    last_answer_ = answer(property, bytes);
    answers.push_back(last_answer_);
    return true;
  }

  [[nodiscard]] bool is_streaming() const override {
    const auto bit = [this](std::uint32_t address, unsigned at) { return (registers.at(address) >> at & 1) != 0; };
    return !bit(0x9028, 1) && bit(0x9008, 0) && bit(0x0004, 10) && registers.at(0xB000) == 0x2F9;
  }
  [[nodiscard]] std::uint8_t data_endpoint() const override { return 0x81; }
  void replug() override {
    reset();
    stream.replug();
    answers.clear();
    plugged_in = true;
  }

 private:
  void reset() {
    registers = {{0x0004, 0xF0005042}, {0x0014, chip_id},    {0xF128, 0},          {0x9008, 0x644},
                 {0x9028, 2},          {0xB000, 0x2F8},      {0x1000, 0x11A1007C}, {0x1004, 0x11A10053},
                 {0x100C, 0x11A10000}, {0x1010, 0x11A10066}, {0x1014, 0x11A1004D}, {0x1018, 0x11A10049},
                 {0x1020, 0x11A10014}};
  }

  static std::uint32_t word(const DeviceBytes& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4 && at + i < bytes.size(); ++i) value |= std::uint32_t{bytes[at + i]} << (8 * i);
    return value;
  }
  static DeviceBytes frame(std::uint32_t property, const std::vector<std::uint32_t>& words) {
    DeviceBytes bytes;
    const auto put = [&](std::uint32_t value) {
      for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    };
    put(property);
    put(static_cast<std::uint32_t>(4 * words.size()));
    for (const std::uint32_t w : words) put(w);
    return bytes;
  }
  static std::uint32_t low(std::uint64_t value) { return static_cast<std::uint32_t>(value); }

  DeviceBytes answer(std::uint32_t property, const DeviceBytes& bytes) {
    switch (property) {
      case 0x72: return frame(property, {low(serial), low(serial >> 32)});
      case 0x79: return frame(property, {firmware});
      case 0x7A: return frame(property, {0x65000000, 0});
      case 0x10000: return frame(property, {1});
      case 0x10003: return text(property, "psee,ccam5_imx636");
      case 0x10102: return read(bytes);
      case 0x40010102: return write(bytes);
      default: return frame(0x80000000, {});
    }
  }
  static DeviceBytes text(std::uint32_t property, const std::string& content) {
    DeviceBytes bytes = frame(property, {0});
    bytes.insert(bytes.end(), content.begin(), content.end());
    bytes.push_back(0);
    bytes[4] = static_cast<std::uint8_t>(bytes.size() - 8);
    return bytes;
  }
  DeviceBytes read(const DeviceBytes& bytes) {
    std::vector<std::uint32_t> words = {word(bytes, 8), word(bytes, 12)};
    for (std::uint32_t i = 0; i < word(bytes, 16) && i < 200; ++i) words.push_back(registers[words[1] + 4 * i]);
    return frame(0x10102, words);
  }
  DeviceBytes write(const DeviceBytes& bytes) {
    const std::uint32_t address = word(bytes, 12);
    for (std::size_t at = 16; at < bytes.size(); at += 4) {
      const auto to = address + static_cast<std::uint32_t>(at - 16);
      if (to == unplugging_register) plugged_in = false;
      if (to == refused_register) return frame(0xC0010102, {0, 5});
      const bool was_streaming = is_streaming();
      registers[to] = word(bytes, at);
      writes.emplace_back(to, word(bytes, at));
      if (!was_streaming && is_streaming()) stream.start();
    }
    return frame(0x40010102, {0, address});
  }

  DeviceBytes last_answer_ = frame(0x71, {0});
};

}  // namespace lecalib::test

// SPDX-License-Identifier: MIT
/// An iniVation DAVIS346 or DVXplorer: parameters by vendor requests, and data once they say so.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "support/fake_device.hpp"

namespace lecalib::test {

class FakeFx3 : public FakeDevice {
 public:
  using Parameter = std::pair<unsigned, unsigned>;  ///< module, number
  enum class Kind : std::uint8_t { davis346, dvxplorer };

  std::map<Parameter, std::uint32_t> parameters;
  std::vector<std::pair<Parameter, std::uint32_t>> writes;  ///< in order
  Parameter refused = {99, 99};                             ///< neither written nor read
  Parameter short_answer = {99, 99};                        ///< read with two bytes
  bool swaps_axes = false;
  std::uint32_t logic = 18, logic_patch = 4;

  explicit FakeFx3(Kind kind = Kind::davis346) : is_davis_(kind == Kind::davis346) {
    info.vendor = 0x152A;
    info.product = is_davis_ ? 0x841A : 0x8419;
    info.release = 0x0009;
    info.bus = 1;
    info.address = 3;
    info.speed_mbit = 5000;
    info.bulk_endpoints = {0x82};
    info.product_name = is_davis_ ? "DAVIS346" : "DVXplorer";
    info.serial = "00000104";
  }

  std::optional<DeviceBytes> control(const usb::ControlRequest& request, const DeviceBytes& data) override {
    if (parameters.empty()) reset();
    const Parameter parameter{request.value, request.index};
    if (request.request != 0xBF || parameter == refused) return std::nullopt;
    if (request.type == 0xC0) return answer(parameter);
    if (request.type != 0x40 || data.size() != 4) return std::nullopt;
    const bool was_streaming = is_streaming();
    const std::uint32_t value = data[0] * 16777216U + data[1] * 65536U + data[2] * 256U + data[3];
    parameters[parameter] = value;
    writes.emplace_back(parameter, value);
    if (!was_streaming && is_streaming()) stream.start();
    return DeviceBytes{};
  }
  bool command(const DeviceBytes& /*bytes*/) override { return false; }
  [[nodiscard]] bool is_streaming() const override {
    const auto is = [this](Parameter parameter, std::uint32_t value) {
      const auto at = parameters.find(parameter);
      return at != parameters.end() && at->second == value;
    };
    const bool sends = is({0, 0}, 1) && is({0, 1}, 1) && is({0, 3}, 1) && is({1, 3}, 1) && is({9, 0}, 1);
    return sends && (is_davis_ || is({5, 0x3000}, 2));
  }
  [[nodiscard]] std::uint8_t data_endpoint() const override { return 0x82; }
  void replug() override {
    reset();
    stream.replug();
    plugged_in = true;
  }

 private:
  void reset() {
    parameters = {{{1, 0}, is_davis_ ? 346U : 640U},
                  {{1, 1}, is_davis_ ? 260U : 480U},
                  {{1, 2}, swaps_axes ? 4U : 0U},
                  {{1, 40}, 1},
                  {{3, 0}, 1},
                  {{3, 1}, 0},
                  {{6, 0}, logic},
                  {{6, 5}, 84},
                  {{6, 6}, 990},
                  {{6, 7}, logic_patch}};
  }
  DeviceBytes answer(Parameter parameter) {
    const std::uint32_t value = parameters[parameter];
    DeviceBytes bytes = {static_cast<std::uint8_t>(value / 16777216), static_cast<std::uint8_t>(value / 65536),
                         static_cast<std::uint8_t>(value / 256), static_cast<std::uint8_t>(value)};
    if (parameter == short_answer) bytes.resize(2);
    return bytes;
  }

  bool is_davis_;
};

}  // namespace lecalib::test

// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "lecalib/host/error.hpp"
#include "lecalib/usb/transport.hpp"

namespace lecalib::usb {

/// Prophesee's command protocol (Treuzell): frames of little-endian 32-bit words, `property`, size of the rest in
/// bytes, payload; each request has one answer.
class TreuzellLink {
 public:
  enum Property : std::uint32_t {
    kSerial = 0x72,        ///< answer: 64 bits, of old boards 32
    kRelease = 0x79,       ///< answer: major << 16 | minor << 8 | patch
    kRegisters = 0x10102,  ///< device, address, count; with kWrite: device, address, values
  };
  static constexpr std::uint32_t kWrite = 0x40000000;   ///< in a request
  static constexpr std::uint32_t kFailed = 0x80000000;  ///< in an answer: refused; alone: not known

  /// Takes the command endpoints from the descriptor where it looks like a Treuzell device's.
  explicit TreuzellLink(Transport* transport);

  /// One byte that tells board and sensor; asked for before anything else.
  host::Result<std::uint8_t> system_id();
  /// Sends a request and takes its answer's payload.
  host::Result<std::vector<std::uint32_t>> ask(std::uint32_t property, const std::vector<std::uint32_t>& payload);

  host::Result<std::uint32_t> read_register(std::uint32_t address);
  host::MaybeError write_register(std::uint32_t address, std::uint32_t value);

  [[nodiscard]] std::uint8_t data_endpoint() const { return data_in_; }

 private:
  host::Result<std::vector<std::uint32_t>> take_answer(std::uint32_t property,
                                                       const std::vector<std::uint32_t>& payload);

  Transport* transport_;
  std::uint8_t command_out_ = 0x02;
  std::uint8_t command_in_ = 0x82;
  std::uint8_t data_in_ = 0x81;
};

}  // namespace lecalib::usb

// SPDX-License-Identifier: MIT
/// The one place where bytes become words: bounds are checked and the byte order is fixed here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// So many bits of a word, from the first one on; fewer than 32.
constexpr std::uint32_t bits_of(std::uint32_t word, unsigned first, unsigned count) noexcept {
  return word >> first & ((1U << count) - 1U);
}

/// Cuts a byte stream that arrives in pieces of any size into little-endian words.
/// At most sizeof(Word) - 1 bytes are kept between the pieces.
template <class Word>
class WordReader {
 public:
  /// Hands the words of `*input` to `sink` and drops what it took from the front of `*input`.
  /// @param sink   bool(Word); false stops after this word.
  /// @param groups bool(std::uint64_t, std::size_t*): is shown the next 8 bytes where there are as many, and may take
  ///               whole words from their front by setting their bytes; false stops after them.
  template <class Sink, class Groups>
  void read(Span<const std::uint8_t>* input, Sink&& sink, Groups&& groups) noexcept {
    const std::uint8_t* byte = input->begin();
    const std::uint8_t* const end = input->end();
    bool wanted = true;
    if (carried_ > 0) {
      while (carried_ < sizeof(Word) && byte != end) carry_[carried_++] = *byte++;
      if (carried_ == sizeof(Word)) {
        carried_ = 0;
        wanted = sink(load(carry_));
      }
    }
    while (wanted && static_cast<std::size_t>(end - byte) >= sizeof(std::uint64_t)) {
      std::size_t taken = 0;
      wanted = groups(load_as<std::uint64_t>(byte), &taken);
      if (taken == 0) {
        wanted = sink(load(byte));
        taken = sizeof(Word);
      }
      byte += taken;
    }
    while (wanted && static_cast<std::size_t>(end - byte) >= sizeof(Word)) {
      wanted = sink(load(byte));
      byte += sizeof(Word);
    }
    if (wanted) {
      while (byte != end) carry_[carried_++] = *byte++;
    }
    const auto taken = static_cast<std::size_t>(byte - input->begin());
    offset_ += taken;
    *input = input->subspan(taken);
  }

  /// Bytes of an unfinished word.
  [[nodiscard]] std::size_t carried() const noexcept { return carried_; }
  /// Bytes taken so far, the unfinished word's included.
  [[nodiscard]] std::uint64_t offset() const noexcept { return offset_; }

 private:
  static Word load(const std::uint8_t* bytes) noexcept { return load_as<Word>(bytes); }
  template <class Unsigned>
  static Unsigned load_as(const std::uint8_t* bytes) noexcept {
    Unsigned word = 0;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    std::memcpy(&word, bytes, sizeof word);  // one load; compilers don't see it in the loop below
#else
    for (std::size_t i = sizeof word; i-- > 0;) word = static_cast<Unsigned>(std::uint64_t{word} << 8U | bytes[i]);
#endif
    return word;
  }
  static_assert(sizeof(Word) <= sizeof(std::uint64_t));

  std::uint8_t carry_[sizeof(Word)] = {};
  std::size_t carried_ = 0;
  std::uint64_t offset_ = 0;
};

}  // namespace lecalib

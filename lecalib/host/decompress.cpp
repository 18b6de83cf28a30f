// SPDX-License-Identifier: MIT
#include "lecalib/host/decompress.hpp"

#include <algorithm>
#include <memory>

#ifdef LECALIB_HAS_LZ4
#include <lz4frame.h>
#endif
#ifdef LECALIB_HAS_ZSTD
#include <zstd.h>
#endif

namespace lecalib::host {
namespace {

constexpr std::size_t kMinGrowth = std::size_t{1} << 16U;

/// Calls `step` with growing room until all of the input is used.
/// @param step  (input, &input_used, room, &room_used) -> whether the frame at hand goes on, or kBroken
constexpr int kBroken = -1;
template <class Step>
[[maybe_unused]] const char* run(Span<const std::uint8_t> input, std::size_t max_bytes, std::vector<std::uint8_t>* out,
                                 Step&& step) {
  std::size_t size = out->size();
  int goes_on = 1;
  const char* failure = nullptr;
  while (goes_on != 0 || !input.empty()) {
    if (out->size() == size) out->resize(std::min(max_bytes, std::max(2 * size, size + kMinGrowth + 4 * input.size())));
    if (out->size() == size) {
      failure = "a packet of less content";
      break;
    }
    std::size_t used = input.size();
    std::size_t made = out->size() - size;
    goes_on = step(input, &used, out->data() + size, &made);
    const bool stands_still = used == 0 && made == 0;
    if (goes_on == kBroken || (stands_still && goes_on != 0)) {
      failure = "a whole compressed frame";
      break;
    }
    size += made;
    input = input.subspan(used);
  }
  out->resize(size);
  return failure;
}

#ifdef LECALIB_HAS_LZ4
const char* decompress_lz4(Span<const std::uint8_t> input, std::size_t max_bytes, std::vector<std::uint8_t>* out) {
  LZ4F_dctx* created = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&created, LZ4F_VERSION)) != 0) return "more memory";
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(created, &LZ4F_freeDecompressionContext);
  return run(input, max_bytes, out, [&](Span<const std::uint8_t> in, std::size_t* used, void* room, std::size_t* made) {
    const std::size_t hint = LZ4F_decompress(context.get(), room, made, in.data(), used, nullptr);
    return LZ4F_isError(hint) != 0 ? kBroken : static_cast<int>(hint != 0);
  });
}
#else
const char* decompress_lz4(Span<const std::uint8_t>, std::size_t, std::vector<std::uint8_t>*) {
  return "a build of lecalib with LZ4 (liblz4-dev was not there)";
}
#endif

#ifdef LECALIB_HAS_ZSTD
const char* decompress_zstd(Span<const std::uint8_t> input, std::size_t max_bytes, std::vector<std::uint8_t>* out) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) return "more memory";
  return run(input, max_bytes, out, [&](Span<const std::uint8_t> in, std::size_t* used, void* room, std::size_t* made) {
    ZSTD_inBuffer source{in.data(), in.size(), 0};
    ZSTD_outBuffer target{room, *made, 0};
    const std::size_t hint = ZSTD_decompressStream(context.get(), &target, &source);
    *used = source.pos;
    *made = target.pos;
    return ZSTD_isError(hint) != 0 ? kBroken : static_cast<int>(hint != 0);
  });
}
#else
const char* decompress_zstd(Span<const std::uint8_t>, std::size_t, std::vector<std::uint8_t>*) {
  return "a build of lecalib with Zstandard (libzstd-dev was not there)";
}
#endif

}  // namespace

const char* decompress(Compression compression, Span<const std::uint8_t> input, std::size_t max_bytes,
                       std::vector<std::uint8_t>* out) {
  switch (compression) {
    case Compression::none:
      if (input.size() > max_bytes - out->size()) return "a packet of less content";
      out->insert(out->end(), input.begin(), input.end());
      return nullptr;
    case Compression::lz4:
    case Compression::lz4_high: return decompress_lz4(input, max_bytes, out);
    case Compression::zstd:
    case Compression::zstd_high: return decompress_zstd(input, max_bytes, out);
  }
  return "compression by LZ4, Zstandard or none";
}

}  // namespace lecalib::host

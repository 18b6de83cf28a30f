// SPDX-License-Identifier: MIT
#include "lecalib/usb/inivation_sequences.hpp"

namespace lecalib::usb {
namespace {

// clang-format off
// Modules: 0 multiplexer, 1 DVS, 2 APS (frames), 3 IMU, 4 external input, 5 chip, 9 USB.

constexpr ParameterStep kDavisStop[] = {
    {{1, 3}, 0}, {{2, 4}, 0}, {{3, 2}, 0}, {{3, 3}, 0}, {{3, 4}, 0}, {{4, 0}, 0}, {{4, 11}, 0}, {{0, 0}, 0},
    {{0, 1}, 0}, {{9, 0}, 0}, {{0, 3}, 0, 100'000}};

constexpr ParameterStep kDavisSetUp[] = {
    // Voltages, then biases: coarse and fine current, in the order of their numbers.
    {{5, 0}, 0x19B}, {{5, 1}, 0x195}, {{5, 2}, 0x1E0}, {{5, 3}, 0x1C1}, {{5, 4}, 0x1D5},
    {{5, 8}, 0x5A4F}, {{5, 9}, 0x7D7E}, {{5, 10}, 0x427F}, {{5, 11}, 0x5FFF}, {{5, 12}, 0x401F}, {{5, 13}, 0x690F},
    {{5, 14}, 0x23AD}, {{5, 15}, 0x110D}, {{5, 16}, 0x419D}, {{5, 17}, 0x614D}, {{5, 18}, 0x6DBF}, {{5, 19}, 0x514D},
    {{5, 20}, 0x1F}, {{5, 21}, 0x63CD}, {{5, 22}, 0x531F}, {{5, 23}, 0x65BF}, {{5, 24}, 0x450D}, {{5, 25}, 0x798D},
    {{5, 26}, 0x5FFF}, {{5, 27}, 0x5FFF}, {{5, 34}, 0x5FEF},
    // Masked pixels: eight that do not exist.
    {{1, 11}, 260}, {{1, 12}, 346}, {{1, 13}, 260}, {{1, 14}, 346}, {{1, 15}, 260}, {{1, 16}, 346}, {{1, 17}, 260},
    {{1, 18}, 346}, {{1, 19}, 260}, {{1, 20}, 346}, {{1, 21}, 260}, {{1, 22}, 346}, {{1, 23}, 260}, {{1, 24}, 346},
    {{1, 25}, 260}, {{1, 26}, 346},
    // Filters: background activity, refractory period, skipping, polarity.
    {{1, 31}, 0}, {{1, 32}, 8}, {{1, 33}, 0}, {{1, 34}, 1}, {{1, 51}, 0}, {{1, 52}, 0}, {{1, 61}, 0}, {{1, 62}, 0},
    {{1, 63}, 0},
    // The chip: shifted sources, multiplexers for debugging, switches.
    {{5, 35}, 0x8410}, {{5, 36}, 0x8410}, {{5, 128}, 0}, {{5, 129}, 0}, {{5, 130}, 0}, {{5, 131}, 0}, {{5, 132}, 0},
    {{5, 133}, 0}, {{5, 134}, 0}, {{5, 135}, 0}, {{5, 136}, 1}, {{5, 137}, 0}, {{5, 138}, 1}, {{5, 140}, 0},
    {{5, 141}, 0}, {{5, 143}, 1}, {{5, 144}, 0, 10'000}};

// The data of events is dropped rather than the camera's clock held when the USB does not keep up.
constexpr ParameterStep kDavisRun[] = {
    {{0, 3}, 1, 200'000}, {{9, 0}, 1}, {{0, 5}, 1}, {{0, 4}, 1}, {{0, 1}, 1}, {{0, 0}, 1, 50'000}, {{1, 4}, 0},
    {{1, 5}, 0}, {{1, 3}, 1}};

// Of a DVXplorer module 5 is the sensor itself, with addresses of 16 bits and values of 8.
constexpr ParameterStep kDvxplorerStop[] = {
    {{1, 3}, 0}, {{5, 0x3000}, 0}, {{3, 2}, 0}, {{3, 3}, 0}, {{3, 4}, 0}, {{4, 0}, 0}, {{4, 11}, 0}, {{0, 0}, 0},
    {{0, 1}, 0}, {{9, 0}, 0}, {{0, 3}, 0, 100'000}};

constexpr ParameterStep kDvxplorerSetUp[] = {
    {{0, 3}, 1, 10'000},
    // Trim, pins of the biases, biases in the middle of their ranges.
    {{5, 0x000D}, 0x24}, {{5, 0x000F}, 0x07}, {{5, 0x0010}, 0xFF}, {{5, 0x0013}, 0x03}, {{5, 0x0014}, 0x7F},
    {{5, 0x0015}, 0}, {{5, 0x000B}, 0}, {{5, 0x000C}, 0x14}, {{5, 0x0012}, 0x6F}, {{5, 0x0018}, 4}, {{5, 0x001C}, 8},
    {{5, 0x001E}, 8},
    // Clock, output, packets of two groups of pixels.
    {{5, 0x3011}, 0xA0}, {{5, 0x3019}, 0}, {{5, 0x301E}, 1}, {{5, 0x3067}, 0x80},
    // Timing, for a system clock of 50 MHz.
    {{5, 0x3255}, 0x0C}, {{5, 0x3266}, 0x08}, {{5, 0x3235}, 0x03}, {{5, 0x3236}, 0xE7}, {{5, 0x3234}, 49},
    {{5, 0x323D}, 50}, {{5, 0x3243}, 50}, {{5, 0x3247}, 50}, {{5, 0x3259}, 50}, {{5, 0x3244}, 0}, {{5, 0x3245}, 0},
    {{5, 0x3246}, 0}, {{5, 0x3256}, 0}, {{5, 0x3257}, 0}, {{5, 0x3258}, 1}, {{5, 0x323C}, 4}, {{5, 0x324C}, 6},
    {{5, 0x324E}, 4}, {{5, 0x324F}, 6}, {{5, 0x3253}, 8}, {{5, 0x3254}, 10}, {{5, 0x324B}, 4},
    {{5, 0x3261}, 0}, {{5, 0x3262}, 15},
    // Blocks of the sensor that count or reset, off; read-outs as they are needed, 5000 per second.
    {{5, 0x3500}, 1}, {{5, 0x3600}, 1}, {{5, 0x3260}, 0}, {{5, 0x3248}, 0}, {{5, 0x3200}, 0x02}, {{5, 0x3202}, 0},
    {{5, 0x3255}, 0x0D}, {{5, 0x3204}, 0}, {{5, 0x3201}, 0}, {{5, 0x325C}, 0}, {{5, 0x325D}, 0xAF}, {{5, 0x325E}, 0xC8},
    {{5, 0x3240}, 0}, {{5, 0x3241}, 0}, {{5, 0x3242}, 7}, {{5, 0x3201}, 1},
    // The whole sensor: columns 0 to 639, groups of rows 0 to 59.
    {{5, 0x3300}, 1}, {{5, 0x3305}, 0}, {{5, 0x3306}, 0}, {{5, 0x3307}, 0x02}, {{5, 0x3308}, 0x7F}, {{5, 0x3301}, 0},
    {{5, 0x3302}, 0xFF}, {{5, 0x3303}, 59}, {{5, 0x3304}, 0xFF}, {{5, 0x3300}, 0}, {{5, 0x3201}, 2},
    {{0, 4}, 1}, {{0, 5}, 0}};

constexpr ParameterStep kDvxplorerRun[] = {
    {{9, 0}, 1}, {{0, 1}, 1}, {{0, 0}, 1, 10'000}, {{1, 3}, 1}, {{5, 0x3000}, 2}};
// clang-format on

}  // namespace

InivationSequences davis346_sequences() noexcept { return {kDavisStop, kDavisSetUp, kDavisRun}; }

InivationSequences dvxplorer_sequences() noexcept { return {kDvxplorerStop, kDvxplorerSetUp, kDvxplorerRun}; }

}  // namespace lecalib::usb

// SPDX-License-Identifier: MIT
/// Exponential and natural logarithm from + - * / alone. The C library's differ in their last bit from machine to
/// machine; a simulated recording must not.
#pragma once

namespace lecalib::host {

/// e^x, relative error below 1e-14 for |x| <= 700.
double exponential(double x);

/// ln(x) for x > 0, absolute error below 1e-15 + 2e-16 |ln(x)|.
double logarithm(double x);

}  // namespace lecalib::host
